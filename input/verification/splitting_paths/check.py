"""How straight cracks of prescribed direction run through irregular meshes."""

import numpy as np

TITLE = "Paths of splitting"
SECTION = "strength"

SIZE, MESHES, DIRECTIONS = 40.0, 3, 16
FAR = 1e8


def chord(result, start):
    """From the node of the crack nearest to the asked start to the one furthest from it; all segments."""
    frame = result.cracks[-1]
    segments = frame.points[frame.cells][:, :, :2]
    points = segments.reshape(-1, 2)
    first = points[np.hypot(*(points - start).T).argmin()]
    last = points[np.hypot(*(points - first).T).argmax()]
    return first, last, segments


def check(case):
    """48 cracks; the angle between the path's chord and the direction asked for."""
    errors, drawn, inside = [], [], 0
    for m in range(1, MESHES + 1):
        for i in range(DIRECTIONS):
            angle = 2 * np.pi * (i + m / MESHES) / DIRECTIONS
            direction = np.array([np.cos(angle), np.sin(angle)])
            start = SIZE / 2 - 0.2 * SIZE * direction
            values = dict(zip(("X", "Y", "FAR_X", "FAR_Y"), (*start, *(start + FAR * direction))))
            run = case.run("splitting_paths.inp", set={"SEED": m, **values}, name="path")
            first, last, segments = chord(run, start)
            run.close()
            along = last - first
            turn = direction[0] * along[1] - direction[1] * along[0]
            errors.append(np.degrees(np.arctan2(turn, direction @ along)))
            inside += bool((np.abs(last - SIZE / 2) < SIZE / 2 - 0.01).all())
            drawn.append((m, segments, first, first + direction * np.hypot(*along)))
    rms = np.sqrt(np.mean(np.square(errors)))
    case.at_most("48 paths: rms angle between path and direction", rms, 5.5, kind="own", unit="degrees")
    case.note(
        f"Mean {np.mean(errors):.2f} degrees, largest {np.abs(errors).max():.1f} degrees; {inside} of {len(errors)} "
        "paths end inside the body, where no admissible split is left."
    )
    draw(case, drawn)


def draw(case, drawn):
    """The paths and where they should have gone."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, MESHES, figsize=(7.2, 2.6), sharey=True)
    for m, segments, first, aim in drawn:
        axes[m - 1].plot(*np.array([first, aim]).T, color="0.7", lw=0.6)
        for ends in segments:
            axes[m - 1].plot(*ends.T, color="tab:red", lw=0.8)
    for m, axis in enumerate(axes, 1):
        axis.set_aspect("equal")
        axis.set(xlim=(0, SIZE), ylim=(0, SIZE), title=f"mesh {m}", xlabel="x")
    figure.tight_layout()
    case.figure("paths", figure, "Cracks of prescribed direction (grey) and the paths through the triangles (red).")

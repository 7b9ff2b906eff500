"""A crack along the edges of the mesh against one through the triangles: length, load, energy."""

import numpy as np

TITLE = "Cracks along edges, for comparison"
SECTION = "strength"

HEIGHT = 100.0
MESHES = [(80, 1), (80, 2), (80, 3)]  # (elements along the beam, seed)
FINE = (160, 1)


def crack(result):
    """Segments of the last frame, and length over height of the crack."""
    frame = result.cracks[-1]
    ends = frame.points[frame.cells][:, :, :2]
    return ends, np.hypot(*(ends[:, 0] - ends[:, 1]).T).sum() / ends[:, :, 1].max()


def check(case):
    """Three jittered meshes, and a finer one in the long part; both ways of splitting on each."""
    deck = case.source / "along_edges.inp"
    through = case.edited("along_edges.inp", ("SPLITTING=EDGE", "SPLITTING=ELEMENT"), name="through_elements.inp")
    runs, ratios = {}, {"EDGE": {}, "ELEMENT": {}}
    for nx, seed in MESHES if case.quick else [*MESHES, FINE]:
        for splitting, path in (("EDGE", deck), ("ELEMENT", through)):
            run = case.run(path, set={"NX": nx, "NY": nx // 4, "SEED": seed}, name=f"{splitting.lower()}_{nx}_{seed}")
            runs[splitting, nx, seed] = run
            ratios[splitting][nx, seed] = crack(run)[1]
            peak, first = np.abs(run.history["LOAD_rf2"]).max(), abs(run.events["LOAD_rf2"][0])
            case.note(
                f"{splitting}, h = {400 / nx:g} mm, mesh {seed}: crack length over height "
                f"{ratios[splitting][nx, seed]:.2f}, {len(run.events['event'])} events, first crack {first:.1f} N, "
                f"peak {peak:.1f} N, released energy {run.history['released_energy'][-1]:.2f} N mm."
            )
    coarse = [mesh for mesh in ratios["EDGE"] if mesh != FINE]
    mean = {splitting: np.mean([found[mesh] for mesh in coarse]) for splitting, found in ratios.items()}
    case.at_most("through triangles: crack length / height, mean of three meshes", mean["ELEMENT"], 1.6, kind="trend")
    case.at_least(
        "along edges: the same, over that through triangles", mean["EDGE"] / mean["ELEMENT"], 1.1, kind="trend"
    )
    if FINE in ratios["EDGE"]:
        name = "along edges, twice as fine: crack length / height"
        case.at_least(name, ratios["EDGE"][FINE], 1.1, kind="trend")
    draw(case, runs)


def draw(case, runs):
    """Both paths on each mesh."""
    import matplotlib.pyplot as plt

    meshes = sorted({(nx, seed) for _, nx, seed in runs})
    figure, axes = plt.subplots(1, len(meshes), figsize=(7.2, 3.0), sharey=True)
    for axis, (nx, seed) in zip(axes, meshes):
        for splitting, colour in (("EDGE", "tab:red"), ("ELEMENT", "tab:blue")):
            ends, ratio = crack(runs[splitting, nx, seed])
            for k, pair in enumerate(ends):
                axis.plot(*pair.T, color=colour, lw=1.2, label=f"{splitting}: {ratio:.2f}" if k == 0 else None)
        axis.set_aspect("equal")
        axis.set(xlim=(170, 230), ylim=(0, HEIGHT), title=f"h = {400 / nx:g}, mesh {seed}", xlabel="x, mm")
        axis.legend(fontsize=6, loc="upper center", bbox_to_anchor=(0.5, -0.25))
    axes[0].set_ylabel("y, mm")
    case.figure(
        "paths", figure, "The same beam, cracked along edges and through triangles; length over height of each."
    )

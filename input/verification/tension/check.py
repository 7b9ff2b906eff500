"""Direct tension of a bar: peak stress, the crack, and what is left."""

import numpy as np

TITLE = "Direct tension"
SECTION = "strength"

STRENGTH, WIDTH, HEIGHT = 4.5, 40.0, 80.0
SEEDS = [1, 2, 3]


def last_crack(result):
    """End points of the crack segments of the last frame, (segments, 2, 2)."""
    frame = result.cracks[-1]
    return frame.points[frame.cells][:, :, :2]


INSIDE = 612  # an element in the middle


def left(run):
    """Force that the bar bears in the end over its peak."""
    force = run.history["GRIP_rf2"]
    return abs(force[-1]) / force.max()


def check(case):
    """Three irregular meshes, the weak triangle at the side; then the same with the weak triangle inside."""
    runs = {seed: case.run("tension.inp", set={"SEED": seed}, name=f"seed{seed}") for seed in SEEDS}
    for seed, run in runs.items():
        peak = run.history["GRIP_rf2"].max() / WIDTH
        at_peak = int(run.history["converged"][run.history["GRIP_rf2"].argmax()])
        case.equal(f"the state of the peak is converged, mesh {seed}", at_peak, 1)
        case.value(f"peak stress, mesh {seed}", peak, STRENGTH, 0.01, kind="exact", unit="MPa")
    case.at_most("force left afterwards / peak", max(left(run) for run in runs.values()), 1e-5, kind="exact")
    case.equal("pieces", {int(run.history["fragments"][-1]) for run in runs.values()}, {2})
    case.equal("events in shear", sum(int(run.history["events_shear"][-1]) for run in runs.values()), 0)
    for seed in SEEDS:
        run = case.run("tension.inp", set={"SEED": seed, "WEAK": INSIDE}, name=f"inside{seed}")
        case.at_most(f"weak triangle inside, mesh {seed}: force left afterwards / peak", left(run), 1e-5, kind="exact")
    run = case.run("tension.inp", set={"SEED": 1, "WEAK": INSIDE, "LEVEL": 3}, name="inside1_level3")
    case.note(
        f"Weak triangle inside, mesh 1, with MAX LEVEL=3 instead of 2: force left {left(run):.1e} of the peak. With 2 "
        "the two ends of the crack overlap by a hook of cut triangles that cannot be cut again (exhausted)."
    )
    spans, angles = [], []
    for run in runs.values():
        points = last_crack(run).reshape(-1, 2)
        spans.append(np.ptp(points[:, 0]) / WIDTH)
        slope = np.polyfit(points[:, 0], points[:, 1], 1)[0]
        angles.append(abs(np.degrees(np.arctan(slope))))
    case.at_least("part of the section that the crack spans", min(spans), 1 - 1e-9, kind="exact")
    case.at_most("crack from the cross-section, line through it", max(angles), 5.0, kind="trend", unit="degrees")
    draw(case, runs)


def draw(case, runs):
    """Load-displacement curves and the cracks."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(7.2, 2.9), width_ratios=(2, 1))
    for seed, run in runs.items():
        axes[0].plot(1e3 * run.history["GRIP_u2"], run.history["GRIP_rf2"] / WIDTH, label=f"mesh {seed}")
        for k, ends in enumerate(last_crack(run)):
            axes[1].plot(*ends.T, color=f"C{seed - 1}", lw=1.2, label=f"mesh {seed}" if k == 0 else None)
    axes[0].axhline(STRENGTH, color="0.6", lw=0.8, ls="--")
    axes[0].set_xlabel(r"displacement of the grip, $\mu$m")
    axes[0].set_ylabel("mean stress, MPa")
    axes[0].legend(fontsize=7)
    axes[1].set_aspect("equal")
    axes[1].set(xlim=(0, WIDTH), ylim=(0, HEIGHT), xlabel="x, mm", ylabel="y, mm")
    case.figure("curve", figure, "Force over displacement, and the cracks, of three irregular meshes; dashed: 4.5 MPa.")

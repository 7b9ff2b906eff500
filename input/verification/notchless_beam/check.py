"""The paper's beam without a notch: the load of the first crack and the path, on three meshes."""

import numpy as np

TITLE = "Beam without a notch"
SECTION = "strength"

FIRST_CRACK = 106.2  # N, converged
SPAN_MIDDLE, HEIGHT = 200.0, 100.0


def segments(result):
    """Ends of the crack segments of the last frame."""
    frame = result.cracks[-1]
    return frame.points[frame.cells][:, :, :2]


def check(case):
    """h = 8, 4 and, in the long part, 2 mm."""
    deck = case.source.parents[1] / "paper" / "three_point_bending.inp"
    runs = {}
    for h in (8, 4) if case.quick else (8, 4, 2):
        runs[h] = case.run(deck, set={"H": h}, name=f"h{h}")
        events = runs[h].events
        first = abs(events["LOAD_rf2"][0])
        case.value(f"h = {h}: load of the first crack", first, FIRST_CRACK, 0.015, kind="own", unit="N")
        case.equal(f"h = {h}: events in shear", int(np.sum(events["mode"] != "tension")), 0, kind="own")
        low = events["y"] <= 0.7 * HEIGHT
        away = np.abs(events["x"][low] - SPAN_MIDDLE).max() / h
        case.at_most(f"h = {h}: largest distance of an event from mid-span up to 0.7 H / h", away, 1.5, kind="own")
    peaks = {h: np.abs(run.history["LOAD_rf2"]).max() for h, run in runs.items()}
    spread = max(peaks.values()) / min(peaks.values()) - 1
    case.at_most("largest peak / smallest peak - 1", spread, 0.03, kind="own")
    for h, run in runs.items():
        ends = segments(run)
        top = ends[:, :, 1].max()
        length = np.hypot(*(ends[:, 0] - ends[:, 1]).T).sum()
        left = abs(run.history["LOAD_rf2"][-1])
        case.note(
            f"h = {h}: {len(run.events['event'])} events, crack to {top / HEIGHT:.0%} of the height, its length over "
            f"that height {length / top:.3f}; the load falls from {peaks[h]:.1f} to {left:.1f} N."
        )
    draw(case, runs)


def draw(case, runs):
    """Paths of the meshes over each other, two irregular ones among them, and the curves."""
    import matplotlib.pyplot as plt

    others = {seed: case.run("irregular.inp", set={"SEED": seed}, name=f"irregular{seed}") for seed in (1, 2)}
    figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.2), width_ratios=(1, 1.6))
    labelled = [(f"h = {h}", run) for h, run in runs.items()]
    labelled += [(f"h = 5, jittered, {seed}", run) for seed, run in others.items()]
    for i, (label, run) in enumerate(labelled):
        for k, ends in enumerate(segments(run)):
            axes[0].plot(*ends.T, color=f"C{i}", lw=1.2, label=label if k == 0 else None)
        axes[1].plot(-1e3 * run.history["LOAD_u2"], np.abs(run.history["LOAD_rf2"]), color=f"C{i}", lw=1, label=label)
    axes[0].set_aspect("equal")
    axes[0].set(xlim=(175, 225), ylim=(0, HEIGHT), xlabel="x, mm", ylabel="y, mm")
    axes[1].axhline(FIRST_CRACK, color="0.6", lw=0.8, ls="--")
    axes[1].set(xlabel=r"displacement under the load, $\mu$m", ylabel="load, N")
    axes[1].legend(fontsize=7)
    figure.tight_layout()
    for seed, run in others.items():
        ends = segments(run)
        case.note(
            f"Jittered mesh of 5 mm, {seed} (not judged): first crack at {abs(run.events['LOAD_rf2'][0]):.1f} N, "
            f"crack up to {np.abs(ends[:, :, 0] - SPAN_MIDDLE).max():.1f} mm from mid-span."
        )
    caption = "Crack paths on the paper's meshes and two jittered ones, and load over displacement."
    case.figure("paths", figure, caption, first=True)

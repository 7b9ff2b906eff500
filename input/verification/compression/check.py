"""Uniaxial compression between smooth platens: peak and first direction; and all strengths, in against out."""

import numpy as np

TITLE = "Uniaxial compression"
SECTION = "strength"

PHI, COHESION, WIDTH = np.radians(30), 10.0, 50.0
SEEDS = [1, 2, 3]


def strength(confining=0.0):
    """Mohr-Coulomb: sigma_1 at failure under sigma_3 [MPa]."""
    n = (1 + np.sin(PHI)) / (1 - np.sin(PHI))
    return 2 * COHESION * np.cos(PHI) / (1 - np.sin(PHI)) + n * confining


def check(case):
    """Three irregular meshes."""
    peaks, angles, places = {}, [], []
    for seed in SEEDS:
        run = case.run("compression.inp", set={"SEED": seed}, name=f"seed{seed}")
        peaks[seed] = -run.history["PLATEN_rf2"].min() / WIDTH
        direction = run.events["direction_deg"][0]
        angles.append(abs((direction - 90 + 90) % 180 - 90))
        places.append(np.hypot(run.events["x"][0] - 25, run.events["y"][0] - 50))
        at_peak = int(run.history["converged"][run.history["PLATEN_rf2"].argmin()])
        case.equal(f"the state of the peak is converged, mesh {seed}", at_peak, 1)
        case.value(f"peak stress, mesh {seed}", peaks[seed], strength(), 0.01, kind="exact", unit="MPa")
        case.note(
            f"Mesh {seed}: after {len(run.events['event'])} events at the load of the first one, "
            f"{int(run.history['events_tension'][-1])} in tension, the platen bears "
            f"{-run.history['PLATEN_rf2'][-1] / WIDTH:.1f} MPa."
        )
    far = max(angles, key=lambda a: abs(a - 30))
    case.value("direction of the first event from the axis", far, 30.0, 1.0, "exact", unit="degrees", absolute=True)
    case.at_most("first event from the weak triangle's neighbourhood", max(places), 10.0, kind="exact", unit="mm")
    draw(case, peaks)


def draw(case, peaks):
    """Strength in against strength out."""
    import matplotlib.pyplot as plt

    root = case.source.parent
    pairs = {"uniaxial compression": [(strength(), p) for p in peaks.values()]}
    pairs["confined, 5, 10, 20 MPa"] = []
    for pressure, u in ((5, -0.2), (10, -0.25), (20, -0.40)):
        run = case.run(
            root / "confined" / "confined.inp", set={"P": pressure, "U": u, "EVENTS": 1}, name=f"confined{pressure}"
        )
        pairs["confined, 5, 10, 20 MPa"].append((strength(pressure), run.history["FOOT_rf2"].max() / WIDTH))
    run = case.run(root / "tension" / "tension.inp", name="tension")
    pairs["direct tension"] = [(4.5, run.history["GRIP_rf2"].max() / 40.0)]
    run = case.run(root / "brazilian" / "brazilian.inp", name="brazilian")
    half_arc = np.radians(10)
    centre = 2 / np.pi * (np.sin(2 * half_arc) - half_arc)  # tension at the centre per pressure (Hondros)
    pairs["Brazilian disc"] = [(4.5, centre * 50.0 * run.events["load_factor"][0])]
    figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.0))
    axes[0].plot([3, 120], [3, 120], color="0.6", lw=0.8)
    for (name, found), marker in zip(pairs.items(), "osD^"):
        given, computed = np.array(found).T
        axes[0].loglog(given, computed, marker, ms=5, label=name)
        axes[1].plot(given, 100 * (computed / given - 1), marker, ms=5)
    axes[1].axhspan(-1, 1, color="0.9")
    axes[1].axhline(0, color="0.6", lw=0.8)
    axes[1].set(xscale="log", ylim=(-3, 3), xlabel="strength put in, MPa", ylabel="error, per cent")
    axes[0].set(xlabel="strength put in, MPa", ylabel="strength computed, MPa")
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    caption = """Strength in = out: macroscopic strengths as put in against those computed on specimens, without
        calibration. Grey: 1 % (the Brazilian disc is judged by 3 %). The specimens in compression and tension
        have one triangle that is half a per cent weaker; the Brazilian disc's strength is the tension at its centre
        by Hondros's formula."""
    case.figure("strengths", figure, caption, first=True)

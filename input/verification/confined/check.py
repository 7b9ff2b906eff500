"""Compression under confining pressure: the strength of Mohr-Coulomb's line."""

import numpy as np

TITLE = "Compression under confining pressure"
SECTION = "strength"

PHI, COHESION, WIDTH = np.radians(30), 10.0, 50.0
RUNS = {5: -0.20, 10: -0.25, 20: -0.40}  # confining pressure [MPa]: displacement of the platen [mm]


def strength(confining):
    """Mohr-Coulomb: sigma_1 at failure under sigma_3 [MPa]."""
    n = (1 + np.sin(PHI)) / (1 - np.sin(PHI))
    return 2 * COHESION * np.cos(PHI) / (1 - np.sin(PHI)) + n * confining


def check(case):
    """Axial stress from the force at the foot, which bears platen and pressure."""
    for pressure, u in RUNS.items():
        run = case.run("confined.inp", set={"P": pressure, "U": u}, name=f"p{pressure}")
        force = run.history["FOOT_rf2"]
        case.value(
            f"peak stress at {pressure} MPa", force.max() / WIDTH, strength(pressure), 0.01, kind="exact", unit="MPa"
        )
        at_peak = int(run.history["converged"][force.argmax()])
        case.equal(f"the state of the peak at {pressure} MPa is converged", at_peak, 1)
        fallen = force[-1] / force.max()
        case.at_most(f"force after 10 events / peak at {pressure} MPa", fallen, 1 - 1e-4, kind="own")
        angle = abs((run.events["direction_deg"][0] - 90 + 90) % 180 - 90)
        name = f"direction of the first event from the axis at {pressure} MPa"
        case.value(name, angle, 30.0, 1.0, kind="exact", unit="degrees", absolute=True)

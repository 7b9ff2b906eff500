"""Brazilian disc: force, place and mode of the first failure, and the crack."""

import numpy as np

import mesh

TITLE = "Brazilian disc"
SECTION = "strength"

TENSILE, COHESION, PHI = 4.5, 10.0, np.radians(30)
HALF_ARC = np.radians(mesh.HALF_ARC)
PRESSURE = 50.0  # at load factor 1 [MPa]


def force(pressure):
    """Vertical force on an arc [kN/m = N/mm]."""
    return 2 * mesh.RADIUS * np.sin(HALF_ARC) * pressure


def principal(q):
    """(s1, s3) on the loaded diameter at r = q R under unit pressure, compression positive (Hondros 1959)."""
    one = (1 - q**2) * np.sin(2 * HALF_ARC) / (1 - 2 * q**2 * np.cos(2 * HALF_ARC) + q**4)
    two = np.arctan2((1 + q**2) * np.tan(HALF_ARC), 1 - q**2)
    return 2 / np.pi * (one + two), -2 / np.pi * (one - two)


def first_failure(griffith):
    """(force, r/R) of the first failure on the loaded diameter, up to 3/4 R, by Hondros's formula and the criterion."""
    q = np.linspace(0, 0.75, 75001)
    s1, s3 = principal(q)
    tension = np.where(s3 < 0, TENSILE / np.maximum(-s3, 1e-12), np.inf)
    growth = (s1 - s3) / 2 - np.sin(PHI) * (s1 + s3) / 2
    shear = np.where(growth > 0, COHESION * np.cos(PHI) / np.maximum(growth, 1e-12), np.inf)
    pressure = np.where(s1 < -3 * s3, tension, shear) if griffith else np.minimum(tension, shear)
    return force(pressure.min()), q[pressure.argmin()]


def check(case):
    """Two meshes with tension cut-off, one with the paper's criterion."""
    expected, _ = first_failure(griffith=False)
    runs = {}
    for n in (24, 48):
        mesh.write(n, case.work)
        runs[n] = case.run("brazilian.inp", set={"N": n, "EVENTS": 12 if n == 24 else 40}, name=f"n{n}")
        found = force(PRESSURE * runs[n].events["load_factor"][0])
        case.value(f"CUTOFF, {n} rings: force at the first failure", found, expected, 0.03, kind="exact", unit="kN/m")
    events = runs[48].events
    case.equal("CUTOFF: mode of the first failure", events["mode"][0], "tension")
    away = np.hypot(events["x"][0], events["y"][0]) / mesh.RADIUS
    case.at_most("CUTOFF: first failure from the centre / R", away, 1 / 8, kind="exact")
    ends = runs[48].cracks[-1]
    ends = ends.points[ends.cells][:, :, :2]
    points = ends.reshape(-1, 2)
    slope = np.polyfit(points[:, 1], points[:, 0], 1)[0]
    case.at_most(
        "CUTOFF: crack from the loaded diameter, line through it",
        abs(np.degrees(np.arctan(slope))),
        5.0,
        kind="trend",
        unit="degrees",
    )
    case.at_most(
        "CUTOFF: largest distance of the crack from that diameter / R",
        np.abs(points[:, 0]).max() / mesh.RADIUS,
        1 / 8,
        kind="trend",
    )
    case.at_least(
        "CUTOFF: length of the crack along the diameter / R", np.ptp(points[:, 1]) / mesh.RADIUS, 1.0, kind="trend"
    )
    griffith(case)
    draw(case, runs[48], ends)


def griffith(case):
    """The paper's criterion: no tension branch anywhere on the diameter."""
    expected, place = first_failure(griffith=True)
    run = case.run("brazilian_griffith.inp", set={"N": 48}, name="griffith")
    events = run.events
    found = force(PRESSURE * events["load_factor"][0])
    case.value("GRIFFITH: force at the first failure", found, expected, 0.03, kind="own", unit="kN/m")
    case.equal("GRIFFITH: mode of the first failure", events["mode"][0], "shear")
    away = np.hypot(events["x"][0], events["y"][0]) / mesh.RADIUS
    case.value("GRIFFITH: first failure from the centre / R", away, place, 0.05, kind="own", absolute=True)


def draw(case, run, ends):
    """The crack in the disc, and the criterion along the diameter."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.0))
    turn = np.linspace(0, 2 * np.pi, 361)
    axes[0].plot(mesh.RADIUS * np.cos(turn), mesh.RADIUS * np.sin(turn), color="0.5", lw=0.8)
    for at in (np.pi / 2, -np.pi / 2):
        arc = np.linspace(at - HALF_ARC, at + HALF_ARC, 30)
        axes[0].plot(mesh.RADIUS * np.cos(arc), mesh.RADIUS * np.sin(arc), color="k", lw=3)
    for pair in ends:
        axes[0].plot(*pair.T, color="tab:blue", lw=1.2)
    axes[0].plot(run.events["x"][0], run.events["y"][0], "r.", ms=5)
    axes[0].set_aspect("equal")
    axes[0].set(xlabel="x, mm", ylabel="y, mm")
    q = np.linspace(0, 0.75, 400)
    s1, s3 = principal(q)
    pressure = first_failure(griffith=False)[0] / force(1.0)
    shear = (s1 - s3) / 2 * pressure / (COHESION * np.cos(PHI) + np.sin(PHI) * (s1 + s3) / 2 * pressure)
    axes[1].plot(q, -s3 * pressure / TENSILE, label=r"$F_t$ (CUTOFF)")
    axes[1].plot(q, shear, label=r"$F_s$ (GRIFFITH where $\sigma_1 \geq -3 \sigma_3$: everywhere here)")
    axes[1].set(xlabel="r/R on the loaded diameter", ylabel="utilisation (Hondros), 366 kN/m", ylim=(0, 1.1))
    axes[1].legend(fontsize=6, loc="lower left")
    figure.tight_layout()
    caption = """Crack of the Brazilian disc with CUTOFF (48 rings, 40 events at the load of the first; red: its start),
        and both branches of the criterion along the loaded diameter by the closed form at 366 kN/m."""
    case.figure("disc", figure, caption)

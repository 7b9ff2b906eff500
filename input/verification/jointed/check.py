"""Block with a joint at several angles to the load: Jaeger's strength."""

import math

import numpy as np

TITLE = "Jointed block"
SECTION = "strength"

COHESION, PHI, JOINT_COHESION, JOINT_PHI = 2.0, math.radians(40), 2.0, math.radians(30)
INTACT = 2 * COHESION * math.cos(PHI) / (1 - math.sin(PHI))
ANGLES = [20, 25, 30, 35, 40, 45]


def jaeger(angle):
    """Uniaxial strength with a joint at an angle [degrees] to the load."""
    a = math.radians(angle)
    slides = math.tan(a) * math.tan(JOINT_PHI)
    if slides >= 1:
        return INTACT
    return min(INTACT, 2 * JOINT_COHESION / (math.sin(2 * a) * (1 - slides)))


def check(case):
    """Peak of the platen's force (the block is 1 m wide and thick)."""
    results = {"intact": case.run("intact.inp", name="intact")}
    for angle in [30] if case.quick else ANGLES:
        cot = 1 / math.tan(math.radians(angle))
        results[angle] = case.run("jointed.inp", set={"COT": cot, "MINUS_COT": -cot}, name=f"joint_{angle}")
    peaks = {name: -result.history["PLATEN_rf2"].min() for name, result in results.items()}
    case.value("intact: peak", peaks["intact"], INTACT, tolerance=0.03, kind="exact", unit="kPa")
    for angle in [name for name in peaks if name != "intact"]:
        case.value(
            f"joint at {angle} degrees: peak", peaks[angle], jaeger(angle), tolerance=0.03, kind="exact", unit="kPa"
        )
    events = {name: len(result.events) for name, result in results.items()}
    sliding = [name for name in peaks if name != "intact" and jaeger(name) < INTACT]
    case.equal("events in the rock where the joint slides", sum(events[name] for name in sliding), 0)
    if not case.quick:
        case.equal("joint at 45 degrees: the rock breaks first", events[45] > 0, True)
    draw(case, results, peaks)


def draw(case, results, peaks):
    """Strength over angle, force over shortening."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(6.8, 2.8))
    line = np.linspace(3, 87, 400)
    left.plot(line, [jaeger(a) for a in line], color="0.5", label="Jaeger")
    angles = [name for name in peaks if name != "intact"]
    left.plot(angles, [peaks[a] for a in angles], "o", markersize=4, label="rfem")
    left.axhline(peaks["intact"], color="C0", linestyle=":", linewidth=1, label="rfem, intact")
    left.set_xlabel("angle between joint and load (degrees)")
    left.set_ylabel("peak (kPa)")
    left.set_ylim(6, 9)
    left.legend(fontsize=7)
    for name, result in results.items():
        history = result.history
        right.plot(-1e6 * history["PLATEN_u2"], -history["PLATEN_rf2"], linewidth=1, label=str(name))
    right.set_xlabel("shortening (um)")
    right.set_ylabel("load on the platen (kN)")
    right.legend(fontsize=6, ncol=2)
    figure.tight_layout()
    case.figure(
        "strength", figure, "Left: strength of the block. Right: load on the platen for each angle of the joint."
    )

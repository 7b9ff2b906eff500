"""A shear box: the force is mu N while it slips, the friction work is force x slip, the loop closes."""

import numpy as np

TITLE = "Shear box"
SECTION = "contact"

PRESSED, FRICTION = 200.0, 0.6  # N, -


def check(case):
    """Pressed, then sheared to and fro and round again."""
    history = case.run("shear_box.inp").history
    step, moved, force = history["step"], history["GRIP_u1"], history["GRIP_rf1"]
    limit = FRICTION * PRESSED
    ends = {}
    for number, name, sense in ((2, "forth", 1), (3, "back", -1), (4, "again", 1)):
        rows = np.flatnonzero(step == number)
        slipping = rows[-15:]
        ends[name] = rows[-1]
        case.value(f"force, {name}", force[rows[-1]], sense * limit, 1e-6, kind="exact", unit="N")
        worst = np.abs(force[slipping] / (sense * limit) - 1).max()
        case.at_most(f"largest error of the force while slipping, {name}", worst, 1e-6, kind="exact")
        work = np.diff(history["friction_work"][slipping])
        error = np.abs(work / np.abs(force[slipping][1:] * np.diff(moved[slipping])) - 1).max()
        case.at_most(f"friction work / (force x slip) - 1, {name}", error, 1e-6, kind="exact")
    pressed = history["BASE_rf2"][step == 4].min()
    case.value("normal force at the base, smallest", pressed, PRESSED, 1e-6, kind="exact", unit="N")
    forth, again = ends["forth"], ends["again"]
    case.value("loop: force at its end / at its start", force[again] / force[forth], 1, 1e-6, kind="exact")
    strain = history["strain_energy"]
    case.value("loop: strain energy at its end / at its start", strain[again] / strain[forth], 1, 1e-6, kind="exact")
    area = history["external_work"][again] - history["external_work"][forth]
    lost = history["friction_work"][again] - history["friction_work"][forth]
    case.value("loop: enclosed area / friction work", area / lost, 1, 0.01, kind="exact")
    draw(case, moved[step > 1], force[step > 1], limit)


def draw(case, moved, force, limit):
    """Force over displacement."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(3.8, 2.8))
    for sign in (-1, 1):
        axes.axhline(sign * limit, color="0.6", linewidth=0.8)
    axes.plot(1000 * moved, force, ".-", markersize=3, linewidth=0.8)
    axes.set(xlabel="displacement of the upper half [um]", ylabel="force [N]")
    case.figure("loop", figure, "Force over displacement; lines: mu N.")

"""Where, in which branch and in which direction one triangle fails, for all principal states and directions."""

import numpy as np

import mesh

TITLE = "Failure criterion: all states, all directions"
SECTION = "strength"


def matched(events):
    """(body, row of its only event) of every body; one without event, or with two, shows in their count."""
    rows = {}
    for row in range(len(events["event"])):
        corner = mesh.SPACING * np.floor(np.array([events["x"][row], events["y"][row]]) / mesh.SPACING + 1e-9)
        rows.setdefault(tuple(corner), []).append(row)
    found = [(body, rows.get(tuple(body["corner"]), [])) for body in mesh.bodies()]
    return [(body, row[0]) for body, row in found if len(row) == 1]


def turn(direction, expected):
    """Angle between two directions without sense [degrees]."""
    return abs((direction - expected + 90) % 180 - 90)


def direction_error(body, direction):
    """From the s1 axis in tension, from the nearer of the two conjugate planes in shear [degrees]."""
    away = 45 - np.degrees(mesh.PHI) / 2
    turns = (0,) if body["mode"] == "tension" else (away, -away)
    return min(turn(direction, body["direction"] + t) for t in turns)


def check(case):
    """One run; for each criterion the figures over all its bodies."""
    n = mesh.write(case.work)
    events = case.run("criterion_map.inp").events
    found = matched(events)
    case.equal("triangles that failed once", len(found), n)
    for criterion in mesh.CRITERIA:
        mine = [(body, row) for body, row in found if body["criterion"] == criterion]
        radius = {}
        for body, row in mine:
            r = body["r"] * events["load_factor"][row] / body["factor"]
            radius.setdefault(body["state"], []).append(r / body["r"])
        ratio = np.concatenate(list(radius.values()))
        case.at_most(
            f"{criterion}: largest relative distance from the envelope", np.abs(ratio - 1).max(), 1e-6, kind="exact"
        )
        wrong = sum(events["mode"][row] != body["mode"] for body, row in mine)
        case.equal(f"{criterion}: states in the wrong branch", int(wrong), 0)
        error = max(direction_error(body, events["direction_deg"][row]) for body, row in mine)
        case.at_most(f"{criterion}: largest error of the direction", error, 1e-6, kind="exact", unit="degrees")
        spread = max(np.ptp(values) for values in radius.values())
        case.at_most(f"{criterion}: spread of a state over the directions", spread, 1e-6, kind="invariant")
    draw(case, events, found)


def draw(case, events, found):
    """Envelopes and first failures in the plane of the principal stresses."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(7.2, 2.9), sharey=True)
    for axis, criterion in zip(axes, mesh.CRITERIA):
        angles = np.radians(np.linspace(-134, 15.5, 2000))
        curve = np.array([mesh.envelope(criterion, a)[0] * np.array([np.cos(a), np.sin(a)]) for a in angles])
        axis.plot(curve[:, 1], curve[:, 0], color="0.6", lw=1, label="envelope")
        for mode, colour in (("tension", "tab:blue"), ("shear", "tab:red")):
            rows = [row for body, row in found if body["criterion"] == criterion and events["mode"][row] == mode]
            axis.plot(events["sigma3"][rows], events["sigma1"][rows], ".", ms=4, color=colour, label=f"fails in {mode}")
        axis.set_xlabel(r"$\sigma_3$ at first failure, MPa")
        axis.set_title(criterion, fontsize=9)
        axis.set_xlim(-7, 20)
        axis.set_ylim(-15, 95)
    axes[0].set_ylabel(r"$\sigma_1$, MPa (compression positive)")
    axes[0].legend(fontsize=7)
    case.figure(
        "envelope", figure, "First failure of each triangle on the two envelopes; six directions lie on each other."
    )

"""Angles at which an inclined crack under tension kinks, with softening and without."""

import math

TITLE = "Kink of an inclined crack under tension"
SECTION = "cracked"

HALF = 20.0  # half the length of the crack [mm]
EXPECTED = {15: 65.5, 30: 60.0, 45: 53.1, 60: 43.2, 75: 26.7}  # crack to load: kink [degrees]


def kinks(result, angle):
    """Mean kink of both tips [degrees], from the first node that failed at a tip to the last one (NaN: too few)."""
    table, found = result.events, []
    for side in (1, -1):
        ahead = (side * math.sin(math.radians(angle)), side * math.cos(math.radians(angle)))
        nodes = [(x, y) for x, y in zip(table["x"], table["y"], strict=True) if x * ahead[0] + y * ahead[1] > 0]
        if len(nodes) < 3:
            return float("nan")
        dx, dy = nodes[-1][0] - nodes[0][0], nodes[-1][1] - nodes[0][1]
        turn = math.degrees(math.atan2(dy, dx) - math.atan2(ahead[1], ahead[0]))
        found.append(abs((turn + 180) % 360 - 180))
    return sum(found) / len(found)


def run(case, angle, brittle):
    """One angle."""
    deck = "kink.inp"
    if brittle:
        deck = case.edited("kink.inp", ("*SOFTENING\n<GF>\n", ""), name="kink_brittle.inp")
    turn = math.radians(angle)
    values = {"A": angle, "X": f"{HALF * math.sin(turn):.6f}", "Y": f"{HALF * math.cos(turn):.6f}"}
    return kinks(case.run(deck, set=values, name=f"{'brittle' if brittle else 'soft'}_{angle}"), angle)


def check(case):
    """Five angles, with softening and without; two when quick."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3))
    axes.plot(list(EXPECTED), list(EXPECTED.values()), "k-", linewidth=1, label="Erdogan and Sih")
    for brittle, how, mark in ((False, "Gf 10 J/m2", "o"), (True, "without *SOFTENING", "s")):
        found = {a: run(case, a, brittle) for a in EXPECTED if not case.quick or (a == 45)}
        for angle, kink in found.items():
            name = f"kink of a crack at {angle} degrees to the load, {how}"
            case.value(name, kink, EXPECTED[angle], 6, kind="exact", unit="degrees", absolute=True)
        axes.plot(list(found), list(found.values()), mark, markersize=4, label=f"rfem, {how}")
    axes.set(xlabel="angle between crack and load [degrees]", ylabel="kink [degrees]")
    axes.legend(fontsize=7)
    figure.tight_layout()
    case.figure("angles", figure, "Angle between a crack and its kink.")

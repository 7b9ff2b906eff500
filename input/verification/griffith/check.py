"""Pressure at which a crack runs: Griffith's balance on three meshes, and two cohesive cracks."""

TITLE = "Griffith: crack under growing inner pressure"
SECTION = "cracked"

RUNS = 5.0  # growth under one pressure that counts as running [mm]


def pressure_of_growth(result, first, last):
    """Pressure [MPa] of the first state in which the crack has grown by more than RUNS since the one before; the states."""
    table = result.history
    states = [
        (first * f if step == 1 else first + f * (last - first), length)
        for step, f, length in zip(table["step"], table["load_factor"], table["crack_length"], strict=True)
    ]
    for before, after in zip(states, states[1:], strict=False):
        if after[1] - before[1] > RUNS:
            return after[0], states
    return float("nan"), states


def check(case):
    """Peaks; the finest mesh is left out when quick."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3))
    sizes, errors = [], []
    for h, first, last in (("1", 1.5, 4.5), ("0.5", 1.5, 3.0), ("0.25", 1.2, 2.4)):
        if h == "0.25" and case.quick:
            continue
        peak, states = pressure_of_growth(
            case.run("griffith.inp", set={"H": h, "P0": first, "P1": last}, name=f"t15_h{h}"), first, last
        )
        sizes.append(float(h))
        errors.append(abs(peak / 1.94 - 1))
        axes.plot([s[1] - 20 for s in states], [s[0] for s in states], label=f"15 MPa, 10 J/m2, {h} mm")
        if h == "0.25":
            case.value("pressure at which the crack runs, 15 MPa, 10 J/m2, 0.25 mm", peak, 1.94, 0.06, kind="exact", unit="MPa")
            case.order("pressure", sizes, errors, at_least=0.8)
    soft = {"H": "0.5", "T": 3.0, "C": 6.0}
    for energy, first, last, expected in ((10, 0.8, 1.8, 1.48), (50, 1.0, 2.4, 1.90)):
        if case.quick and energy == 10:
            continue
        values = {**soft, "GF": energy / 1000, "P0": first, "P1": last}
        peak, states = pressure_of_growth(case.run("griffith.inp", set=values, name=f"t3_g{energy}"), first, last)
        axes.plot([s[1] - 20 for s in states], [s[0] for s in states], label=f"3 MPa, {energy} J/m2, 0.5 mm")
        case.value(f"pressure at which the crack runs, 3 MPa, {energy} J/m2", peak, expected, 0.08, kind="code", unit="MPa")
    axes.set(xlabel="growth [mm]", ylabel="pressure [MPa]", xlim=(-1, 25))
    axes.legend(fontsize=6)
    figure.tight_layout()
    case.figure("growth", figure, "Pressure and growth of the crack.")

"""Pressure at which a crack runs: Griffith's balance on three meshes, and two cohesive cracks."""

import math
import shutil
import subprocess
import sys

TITLE = "Griffith: crack under growing inner pressure"
SECTION = "cracked"

MESHES = (("1", 1.5, 4.5), ("0.5", 1.5, 3.0), ("0.25", 1.2, 2.4))  # size at the tip [mm], pressures of both steps [MPa]
FINEST = ("0.125", 1.2, 2.4)  # a mesh too large to keep here: made by mesh.py where Gmsh is found
RUNS = 5.0  # growth under one pressure that counts as running [mm]


def pressure_of_growth(result, first, last):
    """Pressure [MPa] of the first state in which the crack grew by more than RUNS; all states."""
    table = result.history
    states = [
        (first * f if step == 1 else first + f * (last - first), length)
        for step, f, length in zip(table["step"], table["load_factor"], table["crack_length"], strict=True)
    ]
    for before, after in zip(states, states[1:], strict=False):
        if after[1] - before[1] > RUNS:
            return after[0], states
    return float("nan"), states


def without_softening(case, sizes, softened):
    """The load of the first step from the tip, which is all that a strength alone knows, on the three meshes."""
    deck = case.edited(
        "griffith.inp", ("*SOFTENING\n<GF>\n", ""), ("MAX EVENTS=40", "MAX EVENTS=1"), name="brittle.inp"
    )
    peaks = []
    for h, first, last in MESHES:
        table = case.run(deck, set={"H": h, "P0": first, "P1": last}, name=f"brittle_h{h}").events
        f = table["load_factor"][0]
        peaks.append(first * f if table["step"][0] == 1 else first + f * (last - first))
    slope = math.log(peaks[0] / peaks[-1]) / math.log(float(MESHES[0][0]) / float(MESHES[-1][0]))
    found = ", ".join(f"{peak:.2f} MPa at {mesh[0]} mm" for peak, mesh in zip(peaks, MESHES, strict=True))
    case.note(f"Without *SOFTENING the first pressure falls with the mesh, as h to the {slope:.2f}: {found}.")
    trend_figure(case, [float(mesh[0]) for mesh in MESHES], peaks, sizes, softened)


def trend_figure(case, sizes, peaks, softened_sizes, softened):
    """The trend with the mesh that a strength without a length has, beside the same with a fracture energy."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(4.2, 3))
    axes.loglog(sizes, peaks, "s-", label="without *SOFTENING: first pressure")
    axes.loglog(sizes, [peaks[-1] * (h / sizes[-1]) ** 0.5 for h in sizes], ":", color="0.5", label="root of h")
    axes.loglog(softened_sizes, softened, "o-", label="15 MPa, 10 J/m2: crack runs")
    axes.axhline(1.94, color="k", linewidth=0.8, label="Griffith, 1.94 MPa")
    axes.set_xticks(softened_sizes, [f"{h:g}" for h in softened_sizes])
    axes.set_yticks([1, 2, 4], ["1", "2", "4"])
    axes.minorticks_off()
    axes.set(xlabel="element size at the tips [mm]", ylabel="pressure [MPa]", ylim=(1, 6))
    axes.legend(fontsize=6)
    figure.tight_layout()
    case.figure(
        "trend",
        figure,
        "A strength without a length knows no size: without *SOFTENING the pressure falls with the mesh. With a "
        "fracture energy it levels off once the mesh resolves the zone that softens (1.2 mm).",
    )


def check(case):
    """Peaks; the finest mesh is left out when quick."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3))
    sizes, errors, peaks = [], [], []
    meshes = list(MESHES[:2] if case.quick else MESHES)
    if not case.quick and shutil.which("gmsh"):
        subprocess.run([sys.executable, case.source / "mesh.py", FINEST[0]], cwd=case.work, check=True)
        meshes.append(FINEST)
    elif not case.quick:
        case.note("Gmsh is not there: the mesh of 0.125 mm is left out.")
    for h, first, last in meshes:
        peak, states = pressure_of_growth(
            case.run("griffith.inp", set={"H": h, "P0": first, "P1": last}, name=f"t15_h{h}"), first, last
        )
        sizes.append(float(h))
        errors.append(abs(peak / 1.94 - 1))
        peaks.append(peak)
        axes.plot([s[1] - 20 for s in states], [s[0] for s in states], label=f"15 MPa, 10 J/m2, {h} mm")
        if h in ("0.25", "0.125"):
            quantity = f"pressure at which the crack runs, 15 MPa, 10 J/m2, {h} mm"
            case.value(quantity, peak, 1.94, 0.06, kind="exact", unit="MPa")
    if not case.quick:
        case.order("pressure", sizes, errors, at_least=0.8)
    soft = {"H": "0.5", "T": 3.0, "C": 6.0}
    for energy, first, last, expected in ((10, 0.8, 1.8, 1.48), (50, 1.0, 2.4, 1.90)):
        if case.quick and energy == 10:
            continue
        values = {**soft, "GF": energy / 1000, "P0": first, "P1": last}
        peak, states = pressure_of_growth(case.run("griffith.inp", set=values, name=f"t3_g{energy}"), first, last)
        axes.plot([s[1] - 20 for s in states], [s[0] for s in states], label=f"3 MPa, {energy} J/m2, 0.5 mm")
        case.value(
            f"pressure at which the crack runs, 3 MPa, {energy} J/m2", peak, expected, 0.08, kind="code", unit="MPa"
        )
    if not case.quick:
        without_softening(case, sizes, peaks)
    axes.set(xlabel="growth [mm]", ylabel="pressure [MPa]", xlim=(-1, 25))
    axes.legend(fontsize=6)
    figure.tight_layout()
    case.figure("growth", figure, "Pressure and growth of the crack.")

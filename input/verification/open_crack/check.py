"""Open crack across a large plate under tension: its opening."""

import math

import numpy as np

TITLE = "Open crack"
SECTION = "contact"

MODULUS, POISSON, LOAD, HALF = 27400.0, 0.25, 1.0, 50.0
LARGEST = 4 * (1 - POISSON**2) / MODULUS * LOAD * HALF  # [mm]


def look(result):
    """Places along the crack, lengths, openings of the segments."""
    cracks = result.cracks[-1]
    ends = cracks.points[cracks.cells][:, :, 0]
    return ends.mean(axis=1), np.abs(np.diff(ends, axis=1)[:, 0]), cracks.cell_data["opening"]


def check(case):
    """Three meshes; the finest is the deck's."""
    sizes, errors = [4, 2, 1], []
    for h in sizes:
        deck = "open_crack.inp" if h == 1 else case.edited("open_crack.inp", ("h1.inp", f"h{h}.inp"), name=f"h{h}.inp")
        result = case.run(deck, name=f"h{h}")
        x, length, opening = look(result)
        exact = LARGEST * np.sqrt(np.maximum(0, 1 - (x / HALF) ** 2))
        errors.append(math.sqrt((length * (opening - exact) ** 2).sum() / (length * exact**2).sum()))
    case.value(
        "opening at the middle",
        1e3 * opening[np.argmin(np.abs(x))],
        1e3 * LARGEST,
        tolerance=0.03,
        kind="exact",
        unit="um",
    )
    case.at_most("opening along the crack: 2-norm of its error / its 2-norm", errors[-1], 0.03, kind="exact")
    case.at_most(
        "traction on the faces",
        np.abs(result.cracks[-1].cell_data["normal_traction"]).max(),
        0.0,
        kind="exact",
        unit="MPa",
    )
    case.order("opening along the crack", sizes, errors, at_least=0.8, unit="mm")
    draw(case, x, opening)


def draw(case, x, opening):
    """The ellipse."""
    import matplotlib.pyplot as plt

    line = np.linspace(-1, 1, 201)
    figure, axes = plt.subplots(figsize=(4.2, 2.7))
    axes.plot(HALF * line, 1e3 * LARGEST * np.sqrt(1 - line**2), color="0.5", label="exact")
    axes.plot(x, 1e3 * opening, ".", markersize=3, label="rfem")
    axes.set_xlabel("along the crack (mm)")
    axes.set_ylabel("opening (um)")
    axes.legend(fontsize=7)
    case.figure("opening", figure, "Opening of the crack, triangles of 1 mm beside it.")

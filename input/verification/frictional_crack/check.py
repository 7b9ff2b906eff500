"""Closed crack with friction in a large plate under uniaxial compression: normal traction and slip."""

import math

import numpy as np

TITLE = "Closed crack with friction"
SECTION = "contact"

BULK, SHEAR, LOAD, ANGLE, FRICTION, HALF = 16.67e3, 10e3, 100.0, math.radians(20), math.tan(math.radians(30)), 1.0
MODULUS = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
POISSON = (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))
NORMAL = -LOAD * math.sin(ANGLE) ** 2  # traction, tension positive [MPa]
NET = LOAD * math.sin(ANGLE) * math.cos(ANGLE) + NORMAL * FRICTION  # shear that friction does not bear [MPa]
LARGEST = 4 * (1 - POISSON**2) / MODULUS * NET * HALF  # slip in the middle [m]
TIP = 0.9  # tractions are looked at within this part of the half-length


def look(result):
    """Places along the crack, lengths, slips, normal tractions of the segments."""
    cracks = result.cracks[-1]
    ends = cracks.points[cracks.cells][:, :, :2] @ np.array([math.sin(ANGLE), math.cos(ANGLE)])
    slip = np.abs(cracks.cell_data["slip"])
    return ends.mean(axis=1), np.abs(np.diff(ends, axis=1)[:, 0]), slip, cracks.cell_data["normal_traction"]


def check(case):
    """Three meshes; the finest is the deck's."""
    sizes, errors = [80, 40, 20], []
    for h in sizes:
        deck = (
            "frictional_crack.inp"
            if h == 20
            else case.edited("frictional_crack.inp", ("h20.inp", f"h{h}.inp"), name=f"h{h}.inp")
        )
        s, length, slip, traction = look(case.run(deck, name=f"h{h}"))
        exact = LARGEST * np.sqrt(np.maximum(0, 1 - (s / HALF) ** 2))
        errors.append(math.sqrt((length * (slip - exact) ** 2).sum() / (length * exact**2).sum()))
    inner = np.abs(s) < TIP * HALF
    mean = (length * traction)[inner].sum() / length[inner].sum()
    case.value(
        f"mean normal traction within {TIP} b of the middle", mean, NORMAL, tolerance=0.03, kind="exact", unit="MPa"
    )
    case.value("largest slip", 1e3 * slip.max(), 1e3 * LARGEST, tolerance=0.03, kind="exact", unit="mm")
    case.at_most("slip along the crack: 2-norm of its error / its 2-norm", errors[-1], 0.03, kind="exact")
    case.value("length of the crack", length.sum(), 2 * HALF, tolerance=1e-7, kind="exact", unit="m")
    case.order("slip along the crack", np.array(sizes) / 1e3, errors, at_least=0.8)
    scatter = np.sqrt((length * (traction - mean) ** 2)[inner].sum() / length[inner].sum())
    case.note(
        f"The tractions of single segments scatter by {scatter:.2f} MPa about their mean: each is that of two pairs of"
        " nodes, whose triangles differ."
    )
    draw(case, s, slip, traction)


def draw(case, s, slip, traction):
    """Slip and normal traction along the crack."""
    import matplotlib.pyplot as plt

    order = np.argsort(s)
    line = np.linspace(-1, 1, 201)
    figure, (left, right) = plt.subplots(1, 2, figsize=(6.8, 2.7))
    left.plot(line, 1e3 * LARGEST * np.sqrt(1 - line**2), color="0.5", label="exact")
    left.plot(s[order], 1e3 * slip[order], ".", markersize=3, label="rfem")
    left.set_xlabel("along the crack, s (m)")
    left.set_ylabel("slip (mm)")
    left.legend(fontsize=7)
    right.axhline(NORMAL, color="0.5", label="exact")
    right.plot(s[order], traction[order], ".", markersize=3, label="rfem")
    right.set_ylim(2 * NORMAL, 0)
    right.set_xlabel("along the crack, s (m)")
    right.set_ylabel("normal traction (MPa)")
    right.legend(fontsize=7)
    figure.tight_layout()
    case.figure("slip", figure, "Slip and normal traction of the crack, triangles of 20 mm beside it.")

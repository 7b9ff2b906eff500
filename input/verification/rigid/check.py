"""Rigid motions of a body: displacements as prescribed, no stress."""

from pathlib import Path

import numpy as np

TITLE = "Rigid motion"
SECTION = "elastic"

MODULUS, SIZE = 27400.0, 100.0
# shift along x, along y, small angle
MOTIONS = {"translation": (3.0, -2.0, 0.0), "rotation": (0.0, 0.0, 0.01), "both": (3.0, -2.0, 0.01)}


def motion(points, a, b, angle):
    """Displacements of a small rigid motion."""
    return np.column_stack([a - angle * points[:, 1], b + angle * points[:, 0]])


def largest_errors(frame, a, b, angle):
    """(nodal error / largest displacement, largest stress / (E x displacement / size))."""
    u = motion(frame.points, a, b, angle)
    largest = np.hypot(*u.T).max()
    stress = np.abs(frame.cell_data["stress"]).max()
    return np.abs(frame.displacement - u).max() / largest, stress / (MODULUS * largest / SIZE)


def check(case):
    """The elastic body, and the same with cracks in it."""
    for body, deck in {"": "rigid.inp", "cracked, ": "rigid_cracked.inp"}.items():
        for name, (a, b, angle) in MOTIONS.items():
            values = {"A": a, "B": b, "B_RIGHT": b + angle * SIZE}
            frame = case.run(deck, set=values, name=f"{Path(deck).stem}_{name}").frames[-1]
            error, stress = largest_errors(frame, a, b, angle)
            case.at_most(f"{body}{name}: nodal error / largest displacement", error, 1e-9, kind="exact")
            case.at_most(f"{body}{name}: largest stress / (E displacement / size)", stress, 1e-9, kind="exact")

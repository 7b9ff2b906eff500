"""Writes excavation_nN.inp: the plate of ../kirsch with its hole filled, N triangles along the wall.

    mesh.py N..

The nodes and triangles of the plate have the ids that they have there; those inside the wall come after them (set
HOLE). The nodes of the outer circle get what the hole alone moves them by in an infinite plate.
"""

import importlib.util
import sys
from pathlib import Path

import numpy as np

FILLING = [0.8, 0.6, 0.4, 0.2]  # radii of the rings inside the hole [m]

_spec = importlib.util.spec_from_file_location(
    "kirsch_mesh", Path(__file__).resolve().parents[1] / "kirsch" / "mesh.py"
)
kirsch = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(kirsch)


def induced(x, y):
    """u1, u2 [m] that the hole makes: with it less without it."""
    mean, deviator = (kirsch.SXX + kirsch.SYY) / 2, (kirsch.SXX - kirsch.SYY) / 2
    u, v = kirsch.displacements(x, y)
    stretch = mean * (1 - 2 * kirsch.POISSON)
    return u - (stretch + deviator) * x / (2 * kirsch.SHEAR), v - (stretch - deviator) * y / (2 * kirsch.SHEAR)


def filling(n, first):
    """Points inside the wall (numbered from `first`, the wall from 0) and triangles of indices from 0."""
    angle = 2 * np.pi * np.arange(n) / n
    points = [np.column_stack([r * np.cos(angle), r * np.sin(angle)]) for r in FILLING] + [np.zeros((1, 2))]
    rings = [np.arange(n)] + [first + k * n + np.arange(n) for k in range(len(FILLING))]
    triangles = []
    for outer, inner in zip(rings, rings[1:]):
        for j in range(n):
            k = (j + 1) % n
            triangles += [(inner[j], outer[j], outer[k]), (inner[j], outer[k], inner[k])]
    triangles += [(first + n * len(FILLING), rings[-1][j], rings[-1][(j + 1) % n]) for j in range(n)]
    return np.vstack(points), triangles


def write(n, folder):
    """The include files of mesh and outer displacements."""
    plate, triangles = kirsch.plate(n)
    inside, filled = filling(n, len(plate))
    lines = [f"** made by mesh.py {n}: plate and what is taken out of it", "*NODE"]
    lines += [f"{i}, {x:.12g}, {y:.12g}" for i, (x, y) in enumerate(np.vstack([plate, inside]).tolist(), 1)]
    for name, first, group in (("PLATE", 1, triangles), ("HOLE", len(triangles) + 1, filled)):
        lines += [f"*ELEMENT, TYPE=CPE3, ELSET={name}"]
        lines += [f"{i}, {a + 1}, {b + 1}, {c + 1}" for i, (a, b, c) in enumerate(group, first)]
    outer = np.arange(len(plate) - n, len(plate))
    lines += ["*NSET, NSET=OUTER, GENERATE", f"{outer[0] + 1}, {outer[-1] + 1}, 1"]
    (folder / f"excavation_n{n}.inp").write_text("\n".join(lines) + "\n")
    lines = ["** what the hole moves the outer circle by"]
    for node, (u1, u2) in zip(outer + 1, np.column_stack(induced(*plate[outer].T)).tolist()):
        lines += [f"{node}, 1, 1, {u1:.12g}", f"{node}, 2, 2, {u2:.12g}"]
    (folder / f"excavation_n{n}_outer.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    for word in sys.argv[1:]:
        write(int(word), Path.cwd())

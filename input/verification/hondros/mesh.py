"""Writes hondros_nN.inp: a quarter of a disc of 40 mm, N rings of triangles, and the closed form.

mesh.py N..          N a multiple of 12: a node stands where the loaded arc ends
"""

import sys
from pathlib import Path

import numpy as np

RADIUS = 20.0  # mm
HALF_ARC = np.radians(5.0)  # alpha: the arc is 2 alpha wide
PRESSURE = 50.0  # MPa


def disc(n, jitter=0.2, seed=1):
    """Points and triangles of the quarter x >= 0, y >= 0: ring i has 3 i/2 cells, inner nodes moved at random."""
    random = np.random.default_rng(seed)
    cells = [0] + [max(1, round(1.5 * i)) for i in range(1, n + 1)]
    first, points = [], []
    for i, m in enumerate(cells):
        first.append(len(points))
        for j in range(m + 1):
            r, angle = RADIUS * i / n, np.pi / 2 * j / max(m, 1)
            inner = 0 < i < n
            r += jitter * RADIUS / n * random.uniform(-1, 1) * inner
            angle += jitter * np.pi / 2 / max(m, 1) * random.uniform(-1, 1) * (inner and 0 < j < m)
            x, y = r * np.cos(angle), r * np.sin(angle)
            points.append((0.0 if j == m else x, 0.0 if j == 0 else y))
    triangles = []
    for i in range(n):
        a, b = first[i], first[i + 1]
        end_a, end_b = a + cells[i], b + cells[i + 1]
        while a < end_a or b < end_b:  # step along the ring whose next node comes first
            part_a = (a + 1 - first[i]) / max(cells[i], 1) if a < end_a else 2.0
            part_b = (b + 1 - first[i + 1]) / cells[i + 1] if b < end_b else 2.0
            if part_b <= part_a:
                triangles.append((a, b, b + 1))
                b += 1
            else:
                triangles.append((a, b, a + 1))
                a += 1
    return np.array(points), triangles, first[-1], cells[-1]


def write(n, folder):
    """The include file."""
    points, triangles, first, m = disc(n)
    arc = round(m * (1 - HALF_ARC / (np.pi / 2)))
    lines = [f"** made by mesh.py {n}: quarter of a disc, {len(points)} nodes", "*NODE"]
    lines += [f"{i}, {x:.15g}, {y:.15g}" for i, (x, y) in enumerate(points.tolist(), 1)]
    lines += ["*ELEMENT, TYPE=CPS3, ELSET=DISC"]
    lines += [f"{i}, {a + 1}, {b + 1}, {c + 1}" for i, (a, b, c) in enumerate(triangles, 1)]
    lines += ["*NSET, NSET=ARC, GENERATE", f"{first + arc + 1}, {first + m + 1}"]
    for name, k in (("X_AXIS", 1), ("Y_AXIS", 0)):
        on_axis = [str(i + 1) for i in np.flatnonzero(points[:, k] == 0)]
        lines += [f"*NSET, NSET={name}", *(", ".join(on_axis[j : j + 12]) for j in range(0, len(on_axis), 12))]
    (folder / f"hondros_n{n}.inp").write_text("\n".join(lines) + "\n")


def loaded_diameter(q):
    """(across, along) the loaded diameter at r = q R, tension positive (Hondros 1959)."""
    a = HALF_ARC
    one = (1 - q**2) * np.sin(2 * a) / (1 - 2 * q**2 * np.cos(2 * a) + q**4)
    two = np.arctan2((1 + q**2) * np.tan(a), 1 - q**2)
    return 2 * PRESSURE / np.pi * (one - two), -2 * PRESSURE / np.pi * (one + two)


def other_diameter(q):
    """(along, across) the diameter at right angles at r = q R: stresses along x and along y."""
    a = HALF_ARC
    one = (1 - q**2) * np.sin(2 * a) / (1 + 2 * q**2 * np.cos(2 * a) + q**4)
    two = np.arctan((1 - q**2) / (1 + q**2) * np.tan(a))
    return 2 * PRESSURE / np.pi * (one - two), -2 * PRESSURE / np.pi * (one + two)


if __name__ == "__main__":
    for word in sys.argv[1:]:
        write(int(word), Path.cwd())

"""Writes kirsch_nN.inp: a plate round a hole, irregular triangles, N of them along the wall.

    mesh.py N..

Radii run from 1 m to 5 m in geometric progression, so that triangles keep their shape; inner nodes are moved at random.
The nodes of the outer circle get the exact displacements of the infinite plate.
"""

import sys
from pathlib import Path

import numpy as np

HOLE, OUTER = 1.0, 5.0  # radii [m]
SXX, SYY = -30.0, -15.0  # stress far away [MPa]
SHEAR, BULK = 2800.0, 3900.0  # moduli [MPa]
POISSON = (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))


def displacements(x, y):
    """u1, u2 [m] in plane strain, of the plate loaded far away (Muskhelishvili; Timoshenko & Goodier art. 35)."""
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    mean, deviator, kappa, q = (SXX + SYY) / 2, (SXX - SYY) / 2, 3 - 4 * POISSON, HOLE**2 / r**2
    radial = mean * r * ((kappa - 1) / 2 + q) + deviator * r * (1 + (kappa + 1) * q - q**2) * np.cos(2 * angle)
    tangential = -deviator * r * (1 + (kappa - 1) * q + q**2) * np.sin(2 * angle)
    cosine, sine = x / r, y / r
    return (radial * cosine - tangential * sine) / (2 * SHEAR), (radial * sine + tangential * cosine) / (2 * SHEAR)


def stresses(x, y):
    """sxx, syy, sxy [MPa] of the plate with a hole (Kirsch 1898)."""
    r2, angle = x**2 + y**2, np.arctan2(y, x)
    mean, deviator, q = (SXX + SYY) / 2, (SXX - SYY) / 2, HOLE**2 / r2
    radial = mean * (1 - q) + deviator * (1 - 4 * q + 3 * q**2) * np.cos(2 * angle)
    hoop = mean * (1 + q) - deviator * (1 + 3 * q**2) * np.cos(2 * angle)
    shear = -deviator * (1 + 2 * q - 3 * q**2) * np.sin(2 * angle)
    c, s = np.cos(angle), np.sin(angle)
    return (
        radial * c**2 + hoop * s**2 - 2 * shear * s * c,
        radial * s**2 + hoop * c**2 + 2 * shear * s * c,
        (radial - hoop) * s * c + shear * (c**2 - s**2),
    )


def plate(n, jitter=0.2, seed=1):
    """Points of a grid of rings, (nodes, 2), ring by ring from the wall out; triangles of indices from 0."""
    rings = round(n * np.log(OUTER / HOLE) / (2 * np.pi))
    step = np.array([np.log(OUTER / HOLE) / rings, 2 * np.pi / n])
    moves = jitter * step * np.random.default_rng(seed).uniform(-1, 1, (rings + 1, n, 2))
    moves[0] = moves[-1] = 0  # the wall and the outer circle stay
    i, j = np.meshgrid(np.arange(rings + 1), np.arange(n), indexing="ij")
    log_r, angle = np.moveaxis(np.stack([i, j], axis=-1) * step + moves, -1, 0)
    r = HOLE * np.exp(log_r)
    points = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1).reshape(-1, 2)
    triangles = []
    for a in range(rings * n):
        b, after = a + n, a + 1 if (a + 1) % n else a + 1 - n
        c, d = after + n, after
        short = np.hypot(*(points[a] - points[c])) < np.hypot(*(points[b] - points[d]))
        triangles += [(a, b, c), (a, c, d)] if short else [(a, b, d), (b, c, d)]
    return points, triangles


def write(n, folder):
    """The include files of mesh and outer displacements."""
    points, triangles = plate(n)
    first = len(points) - n + 1  # of the outer circle
    lines = [f"** made by mesh.py {n}: plate round a hole, {len(points)} nodes", "*NODE"]
    lines += [f"{i}, {x:.15g}, {y:.15g}" for i, (x, y) in enumerate(points.tolist(), 1)]
    lines += ["*ELEMENT, TYPE=CPE3, ELSET=PLATE"]
    lines += [f"{i}, {a + 1}, {b + 1}, {c + 1}" for i, (a, b, c) in enumerate(triangles, 1)]
    (folder / f"kirsch_n{n}.inp").write_text("\n".join(lines) + "\n")
    lines = ["** exact displacements of the outer circle"]
    for node, (u1, u2) in enumerate(np.column_stack(displacements(*points[first - 1 :].T)).tolist(), first):
        lines += [f"{node}, 1, 1, {u1:.15g}", f"{node}, 2, 2, {u2:.15g}"]
    (folder / f"kirsch_n{n}_outer.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    for word in sys.argv[1:]:
        write(int(word), Path.cwd())

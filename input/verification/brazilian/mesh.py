"""Writes disc_nN.inp: a disc of 50 mm in N rings of triangles (ring i has 6 i), its inner nodes moved at random.

mesh.py N [SEED]          N a multiple of 6: nodes stand where the loaded arcs (20 degrees) end
"""

import sys
from pathlib import Path

import numpy as np

RADIUS = 25.0  # mm
HALF_ARC = 10.0  # alpha in degrees: each arc is 2 alpha wide


def disc(n, seed, jitter=0.2):
    """Points, triangles, and the first node of each ring."""
    random = np.random.default_rng(seed)
    points, first = [(0.0, 0.0)], [0]
    for i in range(1, n + 1):
        first.append(len(points))
        for j in range(6 * i):
            r, angle = RADIUS * i / n, 2 * np.pi * j / (6 * i)
            if i < n:
                r += jitter * RADIUS / n * random.uniform(-1, 1)
                angle += jitter * 2 * np.pi / (6 * i) * random.uniform(-1, 1)
            points.append((r * np.cos(angle), r * np.sin(angle)))
    triangles = []
    for i in range(1, n + 1):
        inner, outer = max(6 * (i - 1), 1), 6 * i
        a = b = 0
        while a < inner * (i > 1) or b < outer:  # step along the ring whose next node comes first
            node_a, node_b = first[i - 1] + a % inner, first[i] + b % outer
            if b < outer and (i == 1 or a == inner or (b + 1) / outer <= (a + 1) / inner):
                triangles.append((node_a, node_b, first[i] + (b + 1) % outer))
                b += 1
            else:
                triangles.append((node_a, node_b, first[i - 1] + (a + 1) % inner))
                a += 1
    return np.array(points), triangles, first


def write(n, folder, seed=1):
    """The include file."""
    points, triangles, first = disc(n, seed)
    angle = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    rim = np.arange(len(points)) >= first[n]
    lines = [f"** made by mesh.py {n} {seed}: disc of {n} rings, {len(points)} nodes", "*NODE"]
    lines += [f"{i}, {x:.12g}, {y:.12g}" for i, (x, y) in enumerate(points.tolist(), 1)]
    lines += ["*ELEMENT, TYPE=CPE3, ELSET=DISC"]
    lines += [f"{i}, {a + 1}, {b + 1}, {c + 1}" for i, (a, b, c) in enumerate(triangles, 1)]
    for name, at in (("UPPER", 90.0), ("LOWER", -90.0)):
        arc = [str(i + 1) for i in np.flatnonzero(rim & (np.abs(angle - at) <= HALF_ARC + 1e-6))]
        lines += [f"*NSET, NSET={name}", *(", ".join(arc[j : j + 12]) for j in range(0, len(arc), 12))]
    (folder / f"disc_n{n}.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    write(int(sys.argv[1]), Path.cwd(), *map(int, sys.argv[2:]))

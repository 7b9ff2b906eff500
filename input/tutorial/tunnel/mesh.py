"""Writes mesh.inp: rock round a tunnel, and in it, in irregular triangles (numpy).

    mesh.py [N]          N triangles along the wall (100)

Rings whose radii grow in proportion, from the wall at 2.5 m out to 20 m; nodes between are moved at random by a fifth
of a cell, so that no direction is easier to break than another. The tunnel itself (set TUNNEL) is filled with rings.
"""

import sys
from pathlib import Path

import numpy as np

WALL, OUTER = 2.5, 20.0  # radii [m]
FILLING = [2.0, 1.5, 1.0, 0.5]  # radii of the rings inside [m]
JITTER, SEED = 0.2, 1


def rings(n):
    """Nodes ring by ring, from the wall out, then from the wall in, then the centre; the number of outer rings."""
    outer = round(n * np.log(OUTER / WALL) / (2 * np.pi))
    step = np.array([np.log(OUTER / WALL) / outer, 2 * np.pi / n])
    moves = JITTER * step * np.random.default_rng(SEED).uniform(-1, 1, (outer + 1, n, 2))
    moves[0] = moves[-1] = 0
    i, j = np.meshgrid(np.arange(outer + 1), np.arange(n), indexing="ij")
    log_r, angle = np.moveaxis(np.stack([i, j], axis=-1) * step + moves, -1, 0)
    points = WALL * np.exp(log_r)[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    angle = 2 * np.pi * np.arange(n) / n
    inside = [r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in FILLING]
    return np.vstack([points.reshape(-1, 2), *inside, np.zeros((1, 2))]), outer


def triangles(points, n, inner, outer):
    """Two triangles in each cell between two rings (given by their first nodes), cut along the shorter diagonal."""
    found = []
    for j in range(n):
        k = (j + 1) % n
        a, b, c, d = inner + j, outer + j, outer + k, inner + k
        if np.hypot(*(points[a] - points[c])) < np.hypot(*(points[b] - points[d])):
            found += [(a, b, c), (a, c, d)]
        else:
            found += [(a, b, d), (b, c, d)]
    return found


def main():
    """Nodes, elements of the rock and of the tunnel, the outer circle."""
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    points, outer = rings(n)
    rock = [t for i in range(outer) for t in triangles(points, n, i * n, (i + 1) * n)]
    first = (outer + 1) * n
    inside = [0] + [first + i * n for i in range(len(FILLING))]
    tunnel = [t for a, b in zip(inside, inside[1:]) for t in triangles(points, n, b, a)]
    tunnel += [(len(points) - 1, inside[-1] + j, inside[-1] + (j + 1) % n) for j in range(n)]
    lines = [f"** made by mesh.py {n}: {len(points)} nodes", "*NODE"]
    lines += [f"{i}, {x:.6g}, {y:.6g}" for i, (x, y) in enumerate(points.tolist(), 1)]
    for name, group, start in (("ROCK", rock, 1), ("TUNNEL", tunnel, len(rock) + 1)):
        lines += [f"*ELEMENT, TYPE=CPE3, ELSET={name}"]
        lines += [f"{i}, {a + 1}, {b + 1}, {c + 1}" for i, (a, b, c) in enumerate(group, start)]
    lines += ["*NSET, NSET=OUTER, GENERATE", f"{outer * n + 1}, {(outer + 1) * n}, 1"]
    lines += ["*NSET, NSET=WALL, GENERATE", f"1, {n}, 1"]
    Path("mesh.inp").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

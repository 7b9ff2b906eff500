"""Writes petersson_hH.inc: the notched beam in triangles that are symmetric about its middle, H high, H wide at the ligament.

mesh.py H..
"""

import sys
from pathlib import Path

LENGTH, HEIGHT = 2000.0, 200.0


def columns(h):
    """Distances from the middle: steps of h, growing by a quarter up to 80."""
    x, step = [0.0], h
    while x[-1] < LENGTH / 2:
        if x[-1] >= 4 * h:
            step = min(1.25 * step, 80.0)
        x.append(x[-1] + step)
    return [LENGTH / 2 * v / x[-1] if v > 5 * h else v for v in x]


def write(h, folder="."):
    """Nodes row by row from the lower left; the diagonals lean towards the middle."""
    right = columns(h)
    x = [LENGTH / 2 - v for v in reversed(right[1:])] + [LENGTH / 2 + v for v in right]
    rows, n = round(HEIGHT / h), len(x)
    lines = ["*NODE"]
    for j in range(rows + 1):
        lines += [f"{1 + i + j * n}, {x[i]:.6g}, {j * HEIGHT / rows:.6g}" for i in range(n)]
    lines.append("*ELEMENT, TYPE=CPS3, ELSET=BEAM")
    count = 0
    for j in range(rows):
        for i in range(n - 1):
            a, b, c, d = 1 + i + j * n, 2 + i + j * n, 2 + i + (j + 1) * n, 1 + i + (j + 1) * n
            left = x[i] < LENGTH / 2
            for triangle in ((a, b, c), (a, c, d)) if left == (j % 2 == 0) else ((a, b, d), (b, c, d)):
                count += 1
                lines.append(f"{count}, " + ", ".join(map(str, triangle)))
    Path(folder, f"petersson_h{h:g}.inc").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    for size in sys.argv[1:]:
        write(float(size))

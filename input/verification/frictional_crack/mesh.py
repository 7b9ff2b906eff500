#!/usr/bin/env python3
"""Makes the meshes of this case again, with Gmsh (4.8.4 made those that are here).

    mesh.py                 the meshes with triangles of 80, 40 and 20 mm at the crack
    mesh.py H FILE          a mesh with triangles of size H at the crack

A plate of 24 x 24 m, triangles fine about the line of the crack and larger with the distance from it. The crack is no
part of the mesh: rfem puts it in (*CRACK).
"""

import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HALF_WIDTH, GROWTH = 12.0, 0.15
ANGLE = math.radians(20.0)  # between crack and load, which is along y
TIP = (math.sin(ANGLE), math.cos(ANGLE))
GEOMETRY = """
Point(1) = {{-{w}, -{w}, 0}}; Point(2) = {{{w}, -{w}, 0}}; Point(3) = {{{w}, {w}, 0}}; Point(4) = {{-{w}, {w}, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 1}};
Curve Loop(1) = {{1:4}}; Plane Surface(1) = {{1}};
Point(5) = {{-{x}, -{y}, 0}}; Point(6) = {{{x}, {y}, 0}}; Line(5) = {{5, 6}};
Field[1] = Distance; Field[1].EdgesList = {{5}}; Field[1].NNodesByEdge = 400;
Field[2] = MathEval; Field[2].F = "{h} + {g}*F1";
Background Field = 2;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.Algorithm = 6;
"""


def make(h, path, w=HALF_WIDTH, tip=TIP):
    """A mesh with triangles of size h at the line from -tip to tip."""
    with tempfile.TemporaryDirectory() as folder:
        geometry, mesh = Path(folder) / "plate.geo", Path(folder) / "plate.inp"
        geometry.write_text(GEOMETRY.format(w=w, x=tip[0], y=tip[1], h=h, g=GROWTH))
        subprocess.run(["gmsh", "-2", geometry, "-format", "inp", "-o", mesh], check=True, stdout=subprocess.DEVNULL)
        text = mesh.read_text()
    nodes = re.search(r"\*NODE\n(.*?)(?:\n\*|\Z)", text, re.S).group(1).splitlines()
    triangles = re.search(r"type=CPS3.*?\n(.*?)(?:\n\*|\Z)", text, re.S).group(1).splitlines()
    used = {int(n) for line in triangles for n in line.split(",")[1:]}
    lines = [f"** gradually refined plate, by {Path(__file__).name}", "*NODE"]
    for line in nodes:
        number, x, y = line.split(",")[:3]
        if int(number) in used:
            lines.append(f"{int(number)}, {float(x):.6g}, {float(y):.6g}")
    lines.append("*ELEMENT, TYPE=CPE3, ELSET=ROCK")
    lines += [f"{i}, {', '.join(str(int(n)) for n in line.split(',')[1:])}" for i, line in enumerate(triangles, 1)]
    Path(path).write_text("\n".join(lines) + "\n")
    return len(triangles)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        print(make(float(sys.argv[1]), sys.argv[2]), "triangles")
    else:
        here = Path(__file__).resolve().parent
        for millimetres in (80, 40, 20):
            print(make(millimetres / 1000, here / f"plate_h{millimetres}.inp"), "triangles")

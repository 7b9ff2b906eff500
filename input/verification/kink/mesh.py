"""Writes kink_A.inc: a plate with a crack at A degrees to the y axis, elements of 0.5 at its tips (Gmsh).

mesh.py A..
"""

import math
import subprocess
import sys
import tempfile
from pathlib import Path


def triangles(geometry, file, folder="."):
    """Mesh of a Gmsh geometry as keyword text: nodes and elements of the surfaces only, set ROCK."""
    with tempfile.TemporaryDirectory() as place:
        geo, raw = Path(place, "case.geo"), Path(place, "case.inp")
        geo.write_text(geometry)
        subprocess.run(["gmsh", "-2", "-format", "inp", "-o", raw, geo], check=True, stdout=subprocess.DEVNULL)
        points, corners, block = {}, [], ""
        for line in raw.read_text().splitlines():
            if line.startswith("*"):
                block = line.upper()
            elif block.startswith("*NODE"):
                i, x, y = line.split(",")[:3]
                points[int(i)] = (float(x), float(y))
            elif "CPS3" in block:
                corners.append([int(i) for i in line.split(",")[1:4]])
    used = {n: i + 1 for i, n in enumerate(sorted({n for e in corners for n in e}))}
    lines = [f"** {len(used)} nodes, {len(corners)} triangles, by mesh.py with Gmsh", "*NODE"]
    lines += [f"{i}, {round(points[n][0], 6):.9g}, {round(points[n][1], 6):.9g}" for n, i in used.items()]
    lines += ["*ELEMENT, TYPE=CPE3, ELSET=ROCK"]
    lines += [f"{i}, " + ", ".join(str(used[n]) for n in e) for i, e in enumerate(corners, 1)]
    Path(folder, file).write_text("\n".join(lines) + "\n")


HALF = 20.0  # half the length of the crack

GEOMETRY = """
Point(1) = {{-100, -100, 0}}; Point(2) = {{100, -100, 0}}; Point(3) = {{100, 100, 0}}; Point(4) = {{-100, 100, 0}};
Point(5) = {{-{x}, -{y}, 0}}; Point(6) = {{{x}, {y}, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 1}}; Line(5) = {{5, 6}};
Line Loop(1) = {{1, 2, 3, 4}}; Plane Surface(1) = {{1}}; Line {{5}} In Surface {{1}};
Field[1] = Distance; Field[1].PointsList = {{5, 6}};
Field[2] = Threshold; Field[2].InField = 1; Field[2].SizeMin = {h}; Field[2].SizeMax = 12;
Field[2].DistMin = 4; Field[2].DistMax = 80; Background Field = 2;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.Algorithm = 6;
"""

if __name__ == "__main__":
    for a in sys.argv[1:]:
        turn = math.radians(float(a))
        x, y = HALF * math.sin(turn), HALF * math.cos(turn)
        triangles(GEOMETRY.format(x=round(x, 6), y=round(y, 6), h=0.5), f"kink_{a}.inc")

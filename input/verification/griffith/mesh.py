"""Writes griffith_hH.inc, half of the plate (x >= 0), graded to H at the tip (Gmsh).

mesh.py H..
"""

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


GEOMETRY = """
Point(1) = {{0, -60, 0}}; Point(2) = {{60, -60, 0}}; Point(3) = {{60, 60, 0}}; Point(4) = {{0, 60, 0}};
Point(5) = {{0, 0, 0}}; Point(6) = {{20, 0, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 5}}; Line(5) = {{5, 1}}; Line(6) = {{5, 6}};
Line Loop(1) = {{1, 2, 3, 4, 5}}; Plane Surface(1) = {{1}}; Line {{6}} In Surface {{1}};
Field[1] = Box; Field[1].VIn = {h}; Field[1].VOut = 6; Field[1].Thickness = 30;
Field[1].XMin = 16; Field[1].XMax = 32; Field[1].YMin = -3; Field[1].YMax = 3; Background Field = 1;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.Algorithm = 6;
"""

if __name__ == "__main__":
    for h in sys.argv[1:]:
        triangles(GEOMETRY.format(h=h), f"griffith_h{h}.inc")

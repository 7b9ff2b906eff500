"""Writes wing_hH.inc: a block of 50 x 100 with a flaw at 45 degrees, elements of H at its tips (Gmsh).

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
Point(1) = {{0, 0, 0}}; Point(2) = {{50, 0, 0}}; Point(3) = {{50, 100, 0}}; Point(4) = {{0, 100, 0}};
Point(5) = {{23.232233, 48.232233, 0}}; Point(6) = {{26.767767, 51.767767, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 1}}; Line(5) = {{5, 6}};
Line Loop(1) = {{1, 2, 3, 4}}; Plane Surface(1) = {{1}}; Line {{5}} In Surface {{1}};
Field[1] = Distance; Field[1].PointsList = {{5, 6}};
Field[2] = Threshold; Field[2].InField = 1; Field[2].SizeMin = {h}; Field[2].SizeMax = 4;
Field[2].DistMin = 3; Field[2].DistMax = 35; Background Field = 2;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.Algorithm = 6;
"""

if __name__ == "__main__":
    for h in sys.argv[1:]:
        triangles(GEOMETRY.format(h=h), f"wing_h{h}.inc")

"""Writes griffith_hH.inc, half of the plate (x >= 0), graded to H at the tip (Gmsh).

mesh.py H..
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from gmsh_mesh import triangles

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

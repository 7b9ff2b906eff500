"""Writes pressurised_hH.inc: a plate of 40 x 40 with elements of H along the crack (Gmsh).

mesh.py H..
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from gmsh_mesh import triangles

GEOMETRY = """
Point(1) = {{-20, -20, 0}}; Point(2) = {{20, -20, 0}}; Point(3) = {{20, 20, 0}}; Point(4) = {{-20, 20, 0}};
Point(5) = {{-1, 0, 0}}; Point(6) = {{1, 0, 0}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 1}}; Line(5) = {{5, 6}};
Line Loop(1) = {{1, 2, 3, 4}}; Plane Surface(1) = {{1}}; Line {{5}} In Surface {{1}};
Field[1] = Box; Field[1].VIn = {h}; Field[1].VOut = 3; Field[1].Thickness = 18;
Field[1].XMin = -1.2; Field[1].XMax = 1.2; Field[1].YMin = -0.2; Field[1].YMax = 0.2; Background Field = 1;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.Algorithm = 6;
"""

if __name__ == "__main__":
    for h in sys.argv[1:]:
        triangles(GEOMETRY.format(h=h), f"pressurised_h{h}.inc")

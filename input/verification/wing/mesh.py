"""Writes wing_hH.inc: a block of 50 x 100 with a flaw at 45 degrees, elements of H at its tips (Gmsh).

mesh.py H..
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from gmsh_mesh import triangles

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

"""Writes kink_A.inc: a plate with a crack at A degrees to the y axis, elements of 0.5 at its tips (Gmsh).

mesh.py A..
"""

import math
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from gmsh_mesh import triangles

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

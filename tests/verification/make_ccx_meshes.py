#!/usr/bin/env python3
"""Makes the meshes of the ccx_* cases again, with Gmsh (4.8.4 made those that are in input/verification).

    make_ccx_meshes.py [CASE..]

Each mesh is one include file that CalculiX and rfem read as it is: nodes, triangles by set, sets of nodes, and for
pressure the lines `element, Pface, pressure` of *DLOAD in a file of its own.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

CASES = Path(__file__).resolve().parents[2] / "input" / "verification"
BOX = """
Point(1) = {{0, 0, 0, {h}}}; Point(2) = {{{w}, 0, 0, {h}}}; Point(3) = {{{w}, {t}, 0, {h}}};
Point(4) = {{0, {t}, 0, {h}}};
Line(1) = {{1, 2}}; Line(2) = {{2, 3}}; Line(3) = {{3, 4}}; Line(4) = {{4, 1}};
Curve Loop(1) = {{1:4}};
Physical Curve("BOTTOM") = {{1}}; Physical Curve("RIGHT") = {{2}}; Physical Curve("TOP") = {{3}};
Physical Curve("LEFT") = {{4}};
"""
CIRCLE = """
Point(5) = {{{x}, {y}, 0, {h}}}; Point(6) = {{{x} + {r}, {y}, 0, {f}}}; Point(7) = {{{x}, {y} + {r}, 0, {f}}};
Point(8) = {{{x} - {r}, {y}, 0, {f}}}; Point(9) = {{{x}, {y} - {r}, 0, {f}}};
Circle(5) = {{6, 5, 7}}; Circle(6) = {{7, 5, 8}}; Circle(7) = {{8, 5, 9}}; Circle(8) = {{9, 5, 6}};
Curve Loop(2) = {{5:8}};
Physical Curve("HOLE") = {{5:8}};
Plane Surface(1) = {{1, 2}};
"""
WHOLE = 'Plane Surface(1) = {1}; Physical Surface("ROCK") = {1};'
HOLE = 'Physical Surface("ROCK") = {1};'
INCLUSION = 'Plane Surface(2) = {2}; Physical Surface("ROCK") = {1}; Physical Surface("STIFF") = {2};'
SLOPE = """
h = 2.0; f = 0.8;
Point(1) = {0, 0, 0, h}; Point(2) = {60, 0, 0, h}; Point(3) = {60, 12, 0, h}; Point(4) = {42, 12, 0, f};
Point(5) = {30, 30, 0, f}; Point(6) = {18, 30, 0, f}; Point(7) = {0, 30, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6}; Line(6) = {6, 7};
Line(7) = {7, 1};
Curve Loop(1) = {1:7};
Physical Curve("BOTTOM") = {1}; Physical Curve("RIGHT") = {2}; Physical Curve("CREST") = {5};
Physical Curve("LEFT") = {7};
"""
# case: (geometry of Gmsh, element type, curves with pressure: {name: MPa})
MESHES = {
    "ccx_hole": (BOX.format(w=200, t=100, h=8) + CIRCLE.format(x=80, y=50, r=20, h=8, f=1.5) + HOLE, "CPE3", {}),
    "ccx_hole_pressure": (
        BOX.format(w=150, t=100, h=8) + CIRCLE.format(x=90, y=40, r=15, h=8, f=1.5) + HOLE,
        "CPE3",
        {"HOLE": 5.0},
    ),
    "ccx_cantilever": (BOX.format(w=200, t=40, h=3.3) + WHOLE, "CPE3", {}),
    "ccx_beam": (BOX.format(w=320, t=40, h=3.7) + WHOLE, "CPE3", {}),
    "ccx_two_materials": (
        BOX.format(w=60, t=120, h=4) + CIRCLE.format(x=26, y=66, r=14, h=3, f=2) + INCLUSION,
        "CPE3",
        {},
    ),
    "ccx_slope": (SLOPE + WHOLE, "CPE3", {"CREST": 0.2}),
    "ccx_plane_stress": (
        BOX.format(w=200, t=100, h=8) + CIRCLE.format(x=80, y=50, r=20, h=8, f=2) + HOLE,
        "CPS3",
        {},
    ),
}
# sets of one node, nearest to a point: {case: {set: (x, y)}}
POINTS = {
    "ccx_beam": {"PIN": (2.5, 0), "ROLLER": (317.5, 0), "MIDDLE": (160, 40)},
    "ccx_cantilever": {"TIP": (200, 20)},
    "ccx_two_materials": {"CORNER": (0, 0)},
}


def read_msh(text):
    """Nodes {id: (x, y)}, triangles and lines {physical name: [(nodes)]} of a .msh file of version 2."""
    lines = iter(text.splitlines())
    names, nodes, triangles, curves = {}, {}, {}, {}
    for line in lines:
        if line == "$PhysicalNames":
            for _ in range(int(next(lines))):
                dimension, number, name = next(lines).split(None, 2)
                names[int(dimension), int(number)] = name.strip('"')
        elif line == "$Nodes":
            for _ in range(int(next(lines))):
                number, x, y, _ = next(lines).split()
                nodes[int(number)] = (float(x), float(y))
        elif line == "$Elements":
            for _ in range(int(next(lines))):
                words = [int(word) for word in next(lines).split()]
                kind, corners = words[1], tuple(words[3 + words[2] :])
                if kind in (1, 2):
                    group = (curves, triangles)[kind - 1]
                    group.setdefault(names[kind, words[3]], []).append(corners)
    used = {node for group in triangles.values() for corners in group for node in corners}
    return {number: at for number, at in nodes.items() if number in used}, triangles, curves


def in_rows(ids):
    """Lines of ids, twelve in one."""
    words = [str(number) for number in ids]
    return [", ".join(words[k : k + 12]) for k in range(0, len(words), 12)]


def write(name):
    """The include file(s) of one case."""
    geometry, element, pressures = MESHES[name]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.geo").write_text(geometry + "Mesh.Algorithm = 6;\n")
        command = ["gmsh", "-2", "-v", "2", "-nt", "1", "-format", "msh2", "case.geo", "-o", "case.msh"]
        subprocess.run(command, cwd=folder, check=True)
        nodes, triangles, curves = read_msh((Path(folder) / "case.msh").read_text())
    lines = [f"** made by tests/verification/make_ccx_meshes.py {name}", "*NODE"]
    lines += [f"{number}, {x:.12g}, {y:.12g}" for number, (x, y) in sorted(nodes.items())]
    number, face_of = 0, {}
    for group, cells in triangles.items():
        lines.append(f"*ELEMENT, TYPE={element}, ELSET={group}")
        for corners in cells:
            number += 1
            lines.append(", ".join(map(str, (number, *corners))))
            for face in range(3):
                face_of[frozenset((corners[face], corners[(face + 1) % 3]))] = (number, face + 1)
    lines += ["*NSET, NSET=ALL", *in_rows(sorted(nodes))]
    for group, edges in curves.items():
        lines += [f"*NSET, NSET={group}", *in_rows(sorted({node for edge in edges for node in edge}))]
    for group, at in POINTS.get(name, {}).items():
        node = min(nodes, key=lambda n: (nodes[n][0] - at[0]) ** 2 + (nodes[n][1] - at[1]) ** 2)
        lines += [f"*NSET, NSET={group}", str(node)]
    folder = CASES / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}_mesh.inp").write_text("\n".join(lines) + "\n")
    for group, pressure in pressures.items():
        faces = sorted(face_of[frozenset(edge)] for edge in curves[group])
        lines = [f"** pressure on {group}, made by make_ccx_meshes.py"]
        lines += [f"{element_id}, P{face}, {pressure}" for element_id, face in faces]
        (folder / f"{name}_pressure.inp").write_text("\n".join(lines) + "\n")
    print(f"{name}: {len(nodes)} nodes, {number} triangles")


if __name__ == "__main__":
    for case in sys.argv[1:] or MESHES:
        write(case)

"""Meshes of cases from a Gmsh geometry; the mesh.py of a case holds its geometry and calls this."""

import subprocess
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

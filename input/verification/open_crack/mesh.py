#!/usr/bin/env python3
"""Makes the meshes of this case again, with Gmsh, as those of the frictional crack.

A plate of 1200 x 1200 mm, triangles of 4, 2 and 1 mm about the line of the crack (-50, 0) to (50, 0), which is no part
of the mesh.
"""

import importlib.util
from pathlib import Path

HERE = Path(__file__).resolve().parent

if __name__ == "__main__":
    spec = importlib.util.spec_from_file_location("plate_mesh", HERE.parent / "frictional_crack" / "mesh.py")
    plate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plate)
    for h in (4, 2, 1):
        print(plate.make(h, HERE / f"plate_h{h}.inp", w=600.0, tip=(50.0, 0.0)), "triangles")

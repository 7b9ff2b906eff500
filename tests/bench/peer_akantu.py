"""Element updates per second of Akantu, explicit with lumped mass, plane strain: peer_akantu.py SIZE.."""

import sys
import time

import akantu
import meshio
import numpy as np

MATERIAL = "material elastic [\n name = rock\n rho = 1\n E = 27400\n nu = 0.25\n]\n"


def measure(size):
    """Best window of steps of a beam of about so many triangles, nodes row by row."""
    rows = round((size / 8) ** 0.5)
    columns = 4 * rows
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    points = np.column_stack([4 * i.ravel() / columns, j.ravel() / rows, 0 * i.ravel()])
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    first = (i + j * (columns + 1)).ravel()
    lower = np.column_stack([first, first + 1, first + columns + 2])
    upper = np.column_stack([first, first + columns + 2, first + columns + 1])
    triangles = np.stack([lower, upper], axis=1).reshape(-1, 3)
    tags = [np.ones(len(triangles), dtype=int)]
    name = f"akantu_{size}.msh"
    meshio.write(
        name,
        meshio.Mesh(points, [("triangle", triangles)], cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags}),
        file_format="gmsh22",
        binary=False,
    )
    with open("akantu_material.dat", "w", encoding="utf-8") as file:
        file.write(MATERIAL)
    akantu.parseInput("akantu_material.dat")
    mesh = akantu.Mesh(2)
    mesh.read(name)
    model = akantu.SolidMechanicsModel(mesh)
    model.initFull(_analysis_method=akantu._explicit_lumped_mass)
    model.setTimeStep(0.8 * model.getStableTimeStep())
    model.getDisplacement()[:, 1] = 1e-6 * points[:, 0] ** 2
    steps = max(3, 1_000_000 // len(triangles))
    best = float("inf")
    end = time.monotonic() + 6
    while time.monotonic() < end:
        start = time.process_time()
        for _ in range(steps):
            model.solveStep("explicit_lumped")
        best = min(best, time.process_time() - start)
    print("akantu", size, len(triangles) * steps / best, flush=True)


for word in sys.argv[1:]:
    measure(int(word))

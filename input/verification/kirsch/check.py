"""Stresses round a circular hole on three meshes against Kirsch's solution."""

import numpy as np

import mesh

TITLE = "Kirsch: hole in a plate under compression"
SECTION = "elastic"

MESHES = [36, 72, 144, 288]  # triangles along the wall
REFERENCE = 144  # the mesh whose values are judged


def integrals(frame):
    """Mean square errors of the elements' stresses over the plate, relative to the exact ones."""
    corners = frame.points[frame.cells]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    exact = np.column_stack(mesh.stresses(*corners.mean(axis=1).T))
    error = frame.cell_data["stress"][:, [0, 1, 3]] - exact
    weights = np.array([1, 1, 2])  # sxy counts twice, as in the norm of the tensor
    return np.sqrt((area * (error**2 @ weights)).sum() / (area * (exact**2 @ weights)).sum())


def nodal(frame):
    """Largest error of the nodes' recovered stresses, relative to the largest stress, and of the displacements."""
    exact = np.column_stack(mesh.stresses(*frame.points.T))
    stress = np.abs(frame.point_data["stress"][:, [0, 1, 3]] - exact).max() / np.abs(exact).max()
    u = np.column_stack(mesh.displacements(*frame.points.T))
    return stress, np.abs(frame.displacement - u).max() / np.hypot(*u.T).max()


def hoop_stress(frame, n):
    """Hoop stress of the nodes of the wall (the first n), and their angles."""
    angle, s = 2 * np.pi * np.arange(n) / n, frame.point_data["stress"][:n]
    return s[:, 0] * np.sin(angle) ** 2 + s[:, 1] * np.cos(angle) ** 2 - s[:, 3] * np.sin(2 * angle), angle


def check(case):
    """Hoop stress at the wall; stresses and displacements of the whole field; orders."""
    sizes, walls, fields = [], [], []
    for n in MESHES[:3] if case.quick else MESHES:
        mesh.write(n, case.work)
        frame = case.run("kirsch.inp", set={"N": n}, name=f"n{n}").frames[-1]
        hoop, angle = hoop_stress(frame, n)
        field, (worst, displacement) = integrals(frame), nodal(frame)
        sizes.append(2 * np.pi / n)
        walls.append(np.sqrt(((hoop + 45 - 30 * np.cos(2 * angle)) ** 2).mean()) / 75)
        fields.append(field)
        if n == REFERENCE:
            top, side = -hoop[n // 4], -hoop[0]
            case.value("hoop stress at (0, 1), across the larger load", top, 75, 0.02, kind="exact", unit="MPa")
            case.value("hoop stress at (1, 0), along the larger load", side, 15, 0.02, kind="exact", unit="MPa")
            case.at_most("largest error of a node's stress / largest stress", worst, 0.02, kind="exact")
            case.at_most("largest error of a displacement / largest displacement", displacement, 0.02, kind="exact")
            draw(case, frame)
    case.order(
        "hoop stress along the wall (mean square, of 75 MPa)", sizes, walls, at_least=0.8, label="error / 75 MPa"
    )
    case.order("element stresses over the plate (mean square)", sizes, fields, at_least=0.8, label="relative error")


def draw(case, frame):
    """Stresses along the two axes, and the field of the hoop stress."""
    import matplotlib.pyplot as plt
    import matplotlib.tri as tri

    x, y = frame.points.T
    angle, s = np.arctan2(y, x), frame.point_data["stress"]
    hoop = s[:, 0] * np.sin(angle) ** 2 + s[:, 1] * np.cos(angle) ** 2 - s[:, 3] * np.sin(2 * angle)
    figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3), gridspec_kw={"width_ratios": [1, 1.15]})
    colours = left.tricontourf(x, y, frame.cells, -hoop, levels=13, cmap="viridis")
    figure.colorbar(colours, ax=left, label="hoop stress [MPa], compression")
    left.set(xlim=(-3, 3), ylim=(-3, 3), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    grid = tri.Triangulation(x, y, frame.cells)
    r = np.linspace(1.0001, 4.999, 33)
    zero = np.zeros_like(r)
    lines = (
        ("hoop, y axis", zero, r, 0),
        ("hoop, x axis", r, zero, 1),
        ("radial, y axis", zero, r, 1),
        ("radial, x axis", r, zero, 0),
    )
    for k, (label, at_x, at_y, component) in enumerate(lines):
        right.plot(r, -mesh.stresses(at_x, at_y)[component], color=f"C{k}", linewidth=1, label=label)
        found = tri.LinearTriInterpolator(grid, -s[:, component])(at_x, at_y)
        right.plot(r, found, "o", color=f"C{k}", markersize=2.5)
    right.set(xlabel="distance from the centre [m]", ylabel="stress [MPa], compression")
    right.legend(fontsize=7, title="lines: exact; dots: rfem", title_fontsize=7)
    figure.tight_layout()
    caption = f"Hoop stress (left), stresses along the axes (right); {REFERENCE} triangles along the wall."
    case.figure("field", figure, caption)

"""Stresses along both diameters of a disc pressed on two arcs, against Hondros's closed form."""

import numpy as np

import mesh

TITLE = "Hondros: disc pressed on two arcs"
SECTION = "elastic"

MESHES = [24, 48, 96]  # rings
REFERENCE = 96


def along(frame, axis):
    """r/R and stresses (sxx, syy) of the nodes of the y axis (loaded, axis 1) or the x axis (0), by radius."""
    where = np.flatnonzero(frame.points[:, 1 - axis] == 0)
    where = where[np.argsort(frame.points[where, axis])]
    return frame.points[where, axis] / mesh.RADIUS, frame.point_data["stress"][where, :2]


def errors(frame):
    """Largest errors: tension and compression on the loaded diameter, the two stresses on the other."""
    centre = mesh.loaded_diameter(0.0)
    q, found = along(frame, 1)
    across, along_it = mesh.loaded_diameter(q)
    inner = q <= 0.7
    tension = np.abs(found[:, 0] - across)[inner].max() / centre[0]
    compression = np.abs(found[:, 1] / along_it - 1).max()
    q, found = along(frame, 0)
    both = [np.abs(found[:, k] - exact).max() / abs(centre[k]) for k, exact in enumerate(mesh.other_diameter(q))]
    return tension, compression, *both


def check(case):
    """The centre, both diameters, the order of the mean error."""
    sizes, tensions = [], []
    for n in MESHES:
        mesh.write(n, case.work)
        frame = case.run("hondros.inp", set={"N": n}, name=f"n{n}").frames[-1]
        sizes.append(mesh.RADIUS / n)
        q, found = along(frame, 1)
        inner = q <= 0.7
        exact = mesh.loaded_diameter(q)[0]
        tensions.append(np.sqrt(((found[:, 0] - exact)[inner] ** 2).mean()) / exact[0])
        if n == REFERENCE:
            rows(case, frame)
            draw(case, frame)
    case.order(
        "tension on the loaded diameter (mean square)", sizes, tensions, at_least=0.8, label="tension, r <= 0.7 R"
    )


def rows(case, frame):
    """What is judged."""
    centre, found = mesh.loaded_diameter(0.0), along(frame, 1)[1][0]
    case.value("tension at the centre", found[0], centre[0], 0.03, kind="exact", unit="MPa")
    case.value("compression at the centre", -found[1], -centre[1], 0.03, kind="exact", unit="MPa")
    tension, compression, other_x, other_y = errors(frame)
    case.at_most("loaded diameter, r <= 0.7 R: largest error of the tension / centre", tension, 0.03, kind="exact")
    case.at_most("loaded diameter: largest relative error of the compression", compression, 0.03, kind="exact")
    case.at_most("other diameter: largest error of the tension / centre", other_x, 0.03, kind="exact")
    case.at_most("other diameter: largest error of the compression / centre", other_y, 0.03, kind="exact")


def draw(case, frame):
    """Stresses along both diameters."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(7.2, 2.8))
    fine = np.linspace(0, 1, 400)
    for ax, axis, exact, title in (
        (axes[0], 1, mesh.loaded_diameter(fine), "loaded diameter"),
        (axes[1], 0, mesh.other_diameter(fine), "diameter at right angles"),
    ):
        q, found = along(frame, axis)
        for k, label in enumerate(("across the load", "along the load")):
            ax.plot(fine, exact[k], color=f"C{k}", linewidth=1, label=label)
            ax.plot(q[::3], found[::3, k], "o", color=f"C{k}", markersize=2.5)
        ax.set(xlabel="r / R", title=title)
        ax.axhline(0, color="0.7", linewidth=0.6)
    axes[0].set(ylim=(-52, 8), ylabel="stress [MPa], tension positive")
    axes[0].legend(fontsize=7, title="lines: closed form; dots: rfem", title_fontsize=7)
    figure.tight_layout()
    case.figure("diameters", figure, f"Stresses along the two diameters, {REFERENCE} rings of triangles.")

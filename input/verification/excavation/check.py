"""Stresses and displacements round a hole made by taking elements out of stressed rock, against Kirsch's solution."""

from pathlib import Path

import numpy as np

import mesh

TITLE = "Excavation of a circular hole"
SECTION = "elastic"

REFERENCE = 144  # triangles along the wall of the mesh whose values are judged
SAME = 72  # of the mesh that is compared with the plate that has its hole from the start


def hoop(frame, n):
    """Hoop stress of the nodes of the wall (the first n), tension positive."""
    angle, s = 2 * np.pi * np.arange(n) / n, frame.point_data["stress"][:n]
    return s[:, 0] * np.sin(angle) ** 2 + s[:, 1] * np.cos(angle) ** 2 - s[:, 3] * np.sin(2 * angle)


def check(case):
    """The state in place; the hole; the way there; the plate loaded from outside, triangle by triangle."""
    mesh.write(REFERENCE, case.work)
    result = case.run("excavation.inp", set={"N": REFERENCE}, name=f"n{REFERENCE}")
    history, frames = result.history, list(result.frames)
    case.at_most("unbalanced ratio of the state in place", history["residual"][1], 1e-8, kind="exact")
    still = np.abs(frames[1].displacement).max()
    case.at_most("largest displacement of the state in place", still, 1e-12, kind="exact", unit="m")

    frame = frames[-1]
    exact = np.column_stack(mesh.kirsch.stresses(*frame.points.T))
    case.equal("nodes and elements left", str((len(frame.points), len(frame.cells))), str(left(REFERENCE)))
    wall = -hoop(frame, REFERENCE)
    case.value(
        "hoop stress at (0, 1), across the larger load", wall[REFERENCE // 4], 75, 0.02, kind="exact", unit="MPa"
    )
    case.value("hoop stress at (1, 0), along the larger load", wall[0], 15, 0.02, kind="exact", unit="MPa")
    error = np.abs(frame.point_data["stress"][:, [0, 1, 3]] - exact).max() / np.abs(exact).max()
    case.at_most("largest error of a node's stress / largest stress", error, 0.02, kind="exact")
    u = np.column_stack(mesh.induced(*frame.points.T))
    moved = np.abs(frame.displacement[:, :2] - u).max() / np.hypot(*u.T).max()
    case.at_most("largest error of a displacement / largest displacement", moved, 0.02, kind="exact")
    half = frames[-3].displacement  # of the second of four increments
    linear = np.abs(2 * half - frame.displacement).max() / np.abs(frame.displacement).max()
    case.at_most("half the way at half the step", linear, 1e-5, kind="invariant")
    case.at_most("energy error", np.abs(history["energy_error"]).max(), 1e-5, kind="invariant")
    compare(case)
    draw(case, frame)


def left(n):
    """Nodes and elements of the plate."""
    points, triangles = mesh.kirsch.plate(n)
    return len(points), len(triangles)


def compare(case):
    """The same triangles as a plate with a hole that is loaded from outside: the same stresses."""
    loaded = case.run(Path(mesh.kirsch.__file__).with_name("kirsch.inp"), set={"N": SAME}, name="loaded").frames[-1]
    dug = case.run("excavation.inp", name=f"n{SAME}").frames[-1]
    difference = np.abs(dug.cell_data["stress"] - loaded.cell_data["stress"]).max()
    relative = difference / np.abs(loaded.cell_data["stress"]).max()
    case.at_most("difference from the plate with its hole from the start", relative, 1e-5, kind="invariant")


def draw(case, frame):
    """Hoop stress along the wall, and how the wall has come in."""
    import matplotlib.pyplot as plt

    angle = 2 * np.pi * np.arange(REFERENCE + 1) / REFERENCE
    wall = -hoop(frame, REFERENCE)
    figure, (left_axes, right) = plt.subplots(1, 2, figsize=(7.2, 3))
    left_axes.plot(np.degrees(angle), 45 - 30 * np.cos(2 * angle), color="0.4", label="Kirsch")
    left_axes.plot(np.degrees(angle), np.append(wall, wall[0]), "o", markersize=2.5, label="rfem")
    left_axes.set(xlabel="angle from the larger load [degrees]", ylabel="hoop stress at the wall [MPa]")
    left_axes.set_xticks(range(0, 361, 90))
    left_axes.legend(fontsize=7)
    points, scale = frame.points[:REFERENCE], 15
    exact = points + scale * np.column_stack(mesh.induced(*points.T))
    found = points + scale * frame.displacement[:REFERENCE, :2]
    right.plot(*np.vstack([points, points[:1]]).T, ":", color="0.6", label="before")
    right.plot(*np.vstack([exact, exact[:1]]).T, color="0.4", label="Kirsch")
    right.plot(*found.T, "o", markersize=2.5, label="rfem")
    right.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    right.legend(fontsize=7)
    figure.tight_layout()
    case.figure("wall", figure, f"Hoop stress at the wall, and the wall before and after (displacements x {scale}).")

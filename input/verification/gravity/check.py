"""A column under gravity: stresses of uniaxial strain; and the same column in place, at rest."""

import numpy as np

TITLE = "Gravity"
SECTION = "elastic"

WIDTH, HEIGHT, WEIGHT = 10.0, 20.0, 2600 * 9.81  # m, m, N/m3
NU = 0.25


def areas(frame):
    """Areas of the triangles."""
    a, b, c = np.moveaxis(frame.points[frame.cells], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def check(case):
    """Switched on, then in place with three ratios of horizontal to vertical stress."""
    result = case.run("gravity.inp")
    frame, history = result.frames[-1], result.history
    weight = areas(frame)
    stress = weight @ frame.cell_data["stress"] / weight.sum()
    case.value("mean horizontal / mean vertical stress", stress[0] / stress[1], NU / (1 - NU), 1e-6, kind="exact")
    case.value("out of the plane / vertical stress", stress[2] / stress[1], NU / (1 - NU), 1e-6, kind="exact")
    case.value("reaction of the base", history["BASE_rf2"][-1], WEIGHT * WIDTH * HEIGHT, 1e-6, kind="exact", unit="N")
    push = -NU / (1 - NU) * WEIGHT * HEIGHT**2 / 2
    case.value("reaction of a side", history["SIDE_rf1"][-1], push, 1e-6, kind="exact", unit="N")
    field(case, "node stresses, gravity switched on", frame, NU / (1 - NU))
    draw(case, frame)
    for ratio in (1 / 3, 0.6, 1.5):
        in_place(case, ratio)
    fault(case)


def field(case, what, frame, ratio):
    """Largest error of the recovered stresses at nodes against the weight above."""
    vertical = WEIGHT * frame.points[:, 1]
    exact = np.column_stack([ratio * vertical, vertical, ratio * vertical, 0 * vertical])
    error = np.abs(frame.point_data["stress"][:, :4] - exact).max() / np.abs(exact).max()
    case.at_most(f"{what}: largest error / largest stress", error, 0.02, kind="exact")


def in_place(case, ratio):
    """The state in place stays at rest."""
    name = f"K0 = {ratio:.3g}"
    result = case.run("in_place.inp", set={"K0": ratio, "K0Z": ratio}, name=f"in_place_{ratio:.2f}")
    history, frame = result.history, result.frames[-1]
    case.equal(f"events, {name}", int(history["event_count"][-1]), 0)
    case.at_most(f"unbalanced ratio, {name}", history["residual"][-1], 1e-8, kind="exact")
    moved = np.abs(frame.displacement).max() / (HEIGHT * 510120.0 / 27.4e9)
    case.at_most(f"largest displacement / (largest strain x height), {name}", moved, 1e-8, kind="exact")
    push = -ratio * WEIGHT * HEIGHT**2 / 2
    case.value(f"reaction of a side, {name}", history["SIDE_rf1"][-1], push, 1e-6, kind="exact", unit="N")
    field(case, f"node stresses, {name}", frame, ratio)


def fault(case):
    """A fault through the column in place: its faces press against each other and stick, nothing moves."""
    crack = "*CRACK, NAME=FAULT\n2., -15.\n8., -7.\n*BOUNDARY"
    result = case.run(case.edited("in_place.inp", ("*BOUNDARY", crack), name="fault.inp"))
    history, frame = result.history, result.frames[-1]
    case.at_most("unbalanced ratio, with a fault", history["residual"][-1], 1e-8, kind="exact")
    moved = np.abs(frame.displacement).max() / (HEIGHT * 510120.0 / 27.4e9)
    case.at_most("largest displacement / (largest strain x height), with a fault", moved, 1e-8, kind="exact")
    case.equal(
        "pairs of the fault that open or slip", int(history["contacts_open"][-1] + history["contacts_slip"][-1]), 0
    )
    case.at_least("pairs of the fault that stick", history["contacts_stick"][-1], 5, kind="exact")


def draw(case, frame):
    """Stresses of the nodes over depth, gravity switched on."""
    import matplotlib.pyplot as plt

    depth, stress = -frame.points[:, 1], -frame.point_data["stress"] / 1e6
    figure, axes = plt.subplots(figsize=(3.6, 2.8))
    line = np.array([0, HEIGHT])
    for k, (label, component, ratio) in enumerate((("vertical", 1, 1), ("horizontal", 0, NU / (1 - NU)))):
        axes.plot(depth, stress[:, component], ".", markersize=3, color=f"C{k}", label=label)
        axes.plot(line, ratio * WEIGHT * line / 1e6, color="0.4", linewidth=0.8)
    axes.set(xlabel="depth [m]", ylabel="stress [MPa], compression")
    axes.legend(fontsize=7, title="lines: exact; dots: nodes", title_fontsize=7)
    case.figure("depth", figure, "Stresses of the nodes over depth, gravity switched on.")

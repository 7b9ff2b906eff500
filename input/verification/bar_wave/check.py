"""Speed, plateau and shape of a pulse in a bar on three meshes."""

import numpy as np

TITLE = "Wave in a bar"
SECTION = "elastic"

SPEED, DENSITY, VELOCITY = np.sqrt(72e9 / 2650), 2650.0, 0.1
TIMES, FACTORS = [0.0, 4e-6, 16e-6, 20e-6], [0.0, 1.0, 1.0, 0.0]
LOOK_AT = 45e-6  # s


def displacement(x, t):
    """d'Alembert: what the end has moved at the time when the wave left it."""
    grid = np.linspace(0, 20e-6, 2001)
    moved = VELOCITY * np.concatenate([[0], np.cumsum(np.diff(grid) * np.interp(grid[:-1] + 5e-9, TIMES, FACTORS))])
    return np.interp(t - x / SPEED, grid, moved)


def mean_time(time, moved):
    """Mean time of the velocity pulse whose integral is given."""
    return time[-1] - np.sum(np.diff(time) * 0.5 * (moved[1:] + moved[:-1])) / moved[-1]


def check(case):
    """h = 4, 2, 1 mm."""
    sizes, errors, last = [], [], None
    for cells in (100, 200, 400):
        result = case.run("bar_wave.inp", set={"NX": cells, "NY": cells // 50}, name=f"n{cells}")
        frame = min(result.frames, key=lambda f: abs(f.time - LOOK_AT))
        x = frame.points[:, 0]
        exact = displacement(x, frame.time)
        sizes.append(0.4 / cells * 1000)
        errors.append(np.sqrt(np.mean((frame.displacement[:, 0] - exact) ** 2) / np.mean(exact**2)))
        last = result, frame
    result, frame = last
    history = result.history
    lag = mean_time(history["time"], history["SECOND_u1"]) - mean_time(history["time"], history["FIRST_u1"])
    case.value("speed", 0.2 / lag, SPEED, 0.01, kind="exact", unit="m/s")
    centre = frame.points[frame.cells][:, :, 0].mean(axis=1)
    plateau = np.abs(centre - SPEED * (frame.time - 10e-6)) < 0.01
    stress = -frame.cell_data["stress"][plateau, 0].mean()
    case.value("plateau", stress / 1e6, DENSITY * SPEED * VELOCITY / 1e6, 0.02, kind="exact", unit="MPa")
    case.order("displacement", sizes, errors, at_least=1.0, label="relative error (root mean square)")
    case.at_most("largest energy error", np.abs(history["energy_error"]).max(), 1e-12, kind="exact")
    draw(case, frame)


def draw(case, frame):
    """Stress along the bar."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(4.6, 2.6))
    x = np.linspace(0, 0.4, 2001)
    exact = DENSITY * SPEED * VELOCITY * np.interp(frame.time - x / SPEED, TIMES, FACTORS, left=0, right=0)
    centre = frame.points[frame.cells][:, :, 0].mean(axis=1)
    axes.plot(x, exact / 1e6, color="0.4", linewidth=0.8, label="exact")
    axes.plot(centre, -frame.cell_data["stress"][:, 0] / 1e6, ".", markersize=1, label="rfem, h = 1 mm")
    axes.set(xlabel="x [m]", ylabel="-sxx [MPa]", title=f"t = {1e6 * frame.time:.1f} us")
    axes.legend(fontsize=7, loc="upper right")
    case.figure("stress", figure, "Stress along the bar while the pulse runs.")

"""A block that is thrown along a plane stops where Coulomb's friction says."""

import numpy as np

TITLE = "Stopping distance"
SECTION = "contact"

G, FRICTION = 9.81, np.tan(np.radians(30))
SIZE = 0.25  # m, elements
RELEASE = 1.02  # s: the push is over


def mean_of_block(frame, values):
    """Mean over the block, by area."""
    corners = frame.cells[frame.points[frame.cells][:, :, 1].mean(axis=1) > 0]
    a, b, c = np.moveaxis(frame.points[corners], 1, 0)
    area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return area @ values[corners].mean(axis=1) / area.sum()


def check(case):
    """Distance from the end of the push to the rest of the block."""
    result = case.run("stopping.inp")
    frames = [frame for frame in result.frames if frame.time >= 1]
    time = np.array([frame.time for frame in frames])
    moved = np.array([mean_of_block(frame, frame.displacement[:, 0]) for frame in frames])
    velocity = np.array([mean_of_block(frame, frame.point_data["velocity"][:, 0]) for frame in frames])
    start = int(np.argmin(np.abs(time - RELEASE)))
    distance = moved[start:].max() - moved[start]
    expected = velocity[start] ** 2 / (2 * FRICTION * G)
    case.value("distance", 1000 * distance, 1000 * expected, 0.01, kind="exact", unit="mm")
    case.at_most("distance / element size", distance / SIZE, 0.2, kind="exact")
    fitted = (time >= RELEASE) & (velocity > 0.2 * velocity[start])
    slowing = -np.polyfit(time[fitted], velocity[fitted], 1)[0]
    case.value("deceleration", slowing, FRICTION * G, 0.01, kind="exact", unit="m/s2")
    top = frames[0].points[:, 1] > 1.999
    rise = max(np.ptp(frame.displacement[top, 1]) for frame in frames)
    case.at_most("no tipping: largest tilt of the top", rise / 4.0, 1e-4, kind="exact", unit="rad")
    history = result.history
    ledger = history["energy_error"] * np.maximum.accumulate(np.abs(history["external_work"]))
    drift = np.ptp(ledger[history["step"] > 1]) / history["external_work"].max()
    case.at_most("drift of the energy ledger in the dynamic steps / work", drift, 1e-9, kind="exact")
    draw(case, time - 1, velocity, velocity[start])


def draw(case, time, velocity, at_release):
    """Velocity over time."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(3.8, 2.8))
    line = np.array([RELEASE - 1, RELEASE - 1 + at_release / (FRICTION * G)])
    axes.plot(1000 * line, [1000 * at_release, 0], color="0.4", linewidth=0.8, label="slope -mu g")
    axes.plot(1000 * time, 1000 * velocity, "o", markersize=3, label="rfem")
    axes.set(xlabel="time [ms]", ylabel="mean velocity of the block [mm/s]")
    axes.legend(fontsize=7)
    case.figure("velocity", figure, "A push of 20 ms throws the block; friction stops it.")

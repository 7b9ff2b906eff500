"""A block on an inclined plane: equilibrium below the angle of friction, a mechanism above it; how fast it slides."""

import numpy as np

TITLE = "Block on an incline"
SECTION = "contact"

G, FRICTION = 9.81, np.tan(np.radians(30))
SLIDING_FROM = 5e-3  # s: when all of the slope acts


def check(case):
    """At rest at 29.9 and 30.1 degrees; sliding at 35 and 40 degrees."""
    at_rest(case, 29.9)
    at_rest(case, 30.1)
    curves = {angle: sliding(case, angle) for angle in (35, 40)}
    draw(case, curves)
    case.note(
        "The static decks have a soft rock (10 MPa; displacements go with 1/E): that a block that finds no rest is a "
        "mechanism shows in its movement, more than 0.2 of the element size, when MAX ITERATIONS is reached. With "
        "27.4 GPa it has moved 4 micrometres by then, and the run fails with exit status 1 (not converged)."
    )


def at_rest(case, angle):
    """The outcome of a static step."""
    name = f"at_{angle:.1f}"
    values = {"SINE": np.sin(np.radians(angle)), "COSINE": np.cos(np.radians(angle))}
    result = case.run("incline.inp", set={k: f"{v:.10f}" for k, v in values.items()}, name=name)
    outcome = "equilibrium" if result.history["converged"][-1] == 1 else "none"
    if "stopped: mechanism" in case.log(name):
        outcome = "mechanism"
    case.equal(f"static, {angle} degrees", outcome, "equilibrium" if angle < 30 else "mechanism")


def mean_of_block(frame, values):
    """Mean over the block, by area."""
    corners = frame.cells[frame.points[frame.cells][:, :, 1].mean(axis=1) > 0]
    a, b, c = np.moveaxis(frame.points[corners], 1, 0)
    area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return area @ values[corners].mean(axis=1) / area.sum()


def sliding(case, angle):
    """Acceleration by a straight line through the mean velocities; time and velocities of the dynamic step."""
    slope, across = np.sin(np.radians(angle)) * G, np.cos(np.radians(angle)) * G
    along = 0.9 * FRICTION * across
    values = {"ACROSS": across, "ALONG": along, "MORE": slope - along}
    result = case.run("sliding.inp", set={k: f"{v:.10f}" for k, v in values.items()}, name=f"sliding_{angle}")
    frames = [frame for frame in result.frames if frame.time >= 1]
    time = np.array([frame.time - 1 for frame in frames])
    velocity = np.array([mean_of_block(frame, frame.point_data["velocity"][:, 0]) for frame in frames])
    fitted = time >= SLIDING_FROM
    found = np.polyfit(time[fitted], velocity[fitted], 1)[0]
    expected = slope - FRICTION * across
    case.value(f"acceleration, {angle} degrees", found, expected, 0.01, kind="exact", unit="m/s2")
    case.at_most(f"slip / element size, {angle} degrees", result.history["TOP_u1"][-1] / 0.25, 0.2, kind="exact")
    return time, velocity, expected


def draw(case, curves):
    """Mean velocities over time."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(3.8, 2.8))
    for k, (angle, (time, velocity, expected)) in enumerate(curves.items()):
        fitted = time >= SLIDING_FROM
        axes.plot(1000 * time, 1000 * velocity, "o", markersize=3, color=f"C{k}", label=f"{angle} degrees")
        start = np.mean(velocity[fitted] - expected * time[fitted])
        line = np.array([SLIDING_FROM, time[-1]])
        axes.plot(1000 * line, 1000 * (start + expected * line), color=f"C{k}", linewidth=0.8)
    axes.set(xlabel="time [ms]", ylabel="mean velocity of the block [mm/s]")
    axes.legend(fontsize=7, title="lines: g (sin a - mu cos a)", title_fontsize=7)
    case.figure("velocity", figure, "Mean velocity of the sliding block; lines have the expected slope.")

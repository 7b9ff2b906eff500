"""Work of softening in Petersson's notched beam, against fracture energy times parted area."""

import numpy as np

TITLE = "Petersson's notched beam"
SECTION = "cracked"

ENERGY, STRENGTH, THICKNESS, LIGAMENT = 0.124, 3.33, 50.0, 100.0  # [N/mm], [MPa], [mm]


def parted_area(frame):
    """Area of the new segments that have opened by more than the critical jump 2 Gf/T [mm2]."""
    ends = frame.points[frame.cells]
    length = np.hypot(ends[:, 1, 0] - ends[:, 0, 0], ends[:, 1, 1] - ends[:, 0, 1])
    parted = (frame.cell_data["event"] > 0) & (frame.cell_data["opening"] > 2 * ENERGY / STRENGTH)
    return THICKNESS * length[parted].sum()


def check(case):
    """The whole curve; only its beginning when quick."""
    import matplotlib.pyplot as plt

    result = case.run("petersson.inp", set={"U": 2, "DU": 0.005} if case.quick else None)
    table = result.history
    work, force = table["softening_work"][-1], -np.array(table["LOAD_rf2"])
    case.at_most("energy error at the end", abs(table["energy_error"][-1]), 0.01, kind="invariant")
    case.note(f"Largest load {force.max():.0f} N; it is {force.min():.0f} N at the end or before.")
    if case.quick:
        return
    area = parted_area(result.crack_frame(-1))
    case.value("softening work / parted area", 1000 * work / area, 1000 * ENERGY, 0.01, kind="exact", unit="N/m")
    if area > 0.99 * LIGAMENT * THICKNESS:
        case.value("softening work in all", work / 1000, ENERGY * LIGAMENT * THICKNESS / 1000, 0.03, kind="exact", unit="J")
    else:
        case.note(
            f"The beam does not part: {area / THICKNESS:.0f} of {LIGAMENT:.0f} mm have, the rest under the load stays pressed. "
            f"Work so far {work / 1000:.3f} J of 0.62 J."
        )
    figure, axes = plt.subplots(figsize=(5, 3))
    axes.plot(-np.array(table["LOAD_u2"]), force)
    axes.set(xlabel="deflection [mm]", ylabel="load [N]", xlim=(0, 2))
    figure.tight_layout()
    case.figure("load", figure, "Load and deflection of the notched beam.")

"""Work of softening in Petersson's notched beam, against fracture energy times parted area."""

TITLE = "Petersson's notched beam"
SECTION = "cracked"

ENERGY, THICKNESS, NOTCH, LIGAMENT = 0.124, 50.0, 100.0, 100.0  # [N/mm], [mm]


def check(case):
    """The whole curve; a coarser one in displacement when quick."""
    import matplotlib.pyplot as plt

    table = case.run("petersson.inp").history
    work, length = table["softening_work"], table["crack_length"]
    area = (length[-1] - NOTCH) * THICKNESS
    peak = -min(table["LOAD_rf2"])
    case.value("softening work / cracked area", 1000 * work[-1] / area, 1000 * ENERGY, 0.01, kind="exact", unit="N/m")
    case.value("softening work in all", work[-1] / 1000, ENERGY * LIGAMENT * THICKNESS / 1000, 0.03, kind="exact", unit="J")
    case.at_most("energy error at the end", abs(table["energy_error"][-1]), 0.01, kind="invariant")
    case.note(f"Largest load {peak:.0f} N; crack {length[-1] - NOTCH:.0f} mm long at the end, load {-table['LOAD_rf2'][-1]:.0f} N.")
    figure, axes = plt.subplots(figsize=(5, 3))
    axes.plot([-u for u in table["LOAD_u2"]], [-f for f in table["LOAD_rf2"]])
    axes.set(xlabel="deflection [mm]", ylabel="load [N]")
    figure.tight_layout()
    case.figure("load", figure, "Load and deflection of the notched beam.")

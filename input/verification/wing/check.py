"""Where wing cracks begin at a closed flaw under compression, and where they turn."""

TITLE = "Wing cracks from a flaw under compression"
SECTION = "cracked"

LARGEST = 12.0  # pressure at the end [MPa]
CENTRE, FLAW = (25.0, 50.0), 45.0  # middle of the flaw [mm], its direction [degrees]


def check(case):
    """Two fracture energies."""
    for energy in (2,) if case.quick else (2, 10):
        table = case.run("wing.inp", set={"GF": energy / 1000}, name=f"g{energy}").events
        rows = list(
            zip(table["x"], table["y"], table["load_factor"], table["direction_deg"], table["mode"], strict=True)
        )
        case.equal(f"events in shear, Gf {energy} J/m2", sum(row[4] != "tension" for row in rows), 0, kind="trend")
        for tip, side, ahead in (("right", 1, FLAW), ("left", -1, FLAW + 180)):
            mine = [row for row in rows if (row[0] - CENTRE[0] + row[1] - CENTRE[1]) * side > 0]
            # a tip without an event, or with a single one, is a row that fails
            nan = float("nan")
            first = mine[0] if mine else (nan,) * 4
            last = mine[-1][3] if len(mine) > 1 else nan
            case.within(
                f"pressure at the first wing, {tip} tip, Gf {energy} J/m2",
                first[2] * LARGEST,
                5,
                9,
                kind="trend",
                unit="MPa",
            )
            turn = (first[3] - ahead + 180) % 360 - 180
            case.within(
                f"its angle to the flaw, {tip} tip, Gf {energy} J/m2", turn, 60, 72, kind="trend", unit="degrees"
            )
            away = abs(last % 180 - 90)  # the load is along y
            case.at_most(
                f"last direction against the load, {tip} tip, Gf {energy} J/m2", away, 20, kind="trend", unit="degrees"
            )

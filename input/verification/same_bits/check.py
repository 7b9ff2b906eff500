"""One deck, the same bits: for any threads, any outputs, twice."""

from rfem_verify import PROJECT

TITLE = "The same bits for any threads and any outputs"
SECTION = "invariance"

BEAM = PROJECT / "input" / "paper" / "three_point_bending.inp"
ROUGH = PROJECT / "input" / "paper" / "uniaxial_compression.inp"
PLAIN = "*OUTPUT, FIELD, FREQUENCY=10, EVENTS=1\n*OUTPUT, HISTORY, EVENTS=1\n"
OUTPUTS = {
    "few": "*OUTPUT, FIELD, FREQUENCY=1000\n*OUTPUT, HISTORY, FREQUENCY=1000\n",
    "default": "",
    "ANSYS": "*OUTPUT, FIELD, FREQUENCY=7, FORMAT=APDL\n",
    "all": "*OUTPUT, FIELD, FREQUENCY=1, EVENTS=1, FORMAT=BOTH\n*OUTPUT, HISTORY, FREQUENCY=1, EVENTS=1\n"
    "*MONITOR, NAME=FEET, NSET=AT_SUPPORTS\n*NODE PRINT, NSET=LOAD\nU, RF\n*EL PRINT, ELSET=ROCK\nS, E\n",
}


def copied(case, path, *edits):
    """A deck of the paper in the work folder, its mesh still found."""
    (case.work / path.name).write_text(path.read_text().replace("INPUT=mesh/", f"INPUT={path.parent}/mesh/"))
    return case.edited(path.name, *edits) if edits else case.work / path.name


def same_tables(case, one, other):
    """Whether history and events are equal, figure for figure."""
    return all(
        (case.work / f"{one}_{table}.csv").read_text() == (case.work / f"{other}_{table}.csv").read_text()
        for table in ("history", "events")
    )


def say(case, quantity, same):
    """A row."""
    case.equal(quantity, "same" if same else "others", "same", kind="invariant")


def check(case):
    """The beam broken through, the rough block for twelve events."""
    h = 8 if case.quick else 4
    deck = copied(case, BEAM)
    case.run(deck, set={"H": h}, name="beam")
    for threads in (2, 3):
        name = f"beam_t{threads}"
        case.run(deck, set={"H": h}, name=name, threads=threads)
        same = case.digests(name) == case.digests("beam") and same_tables(case, name, "beam")
        say(case, f"beam broken through, {threads} threads: digests and tables", same)
    block = copied(case, ROUGH, ("STOP DROP=0.3", "MAX EVENTS=12, STOP DROP=0.3"))
    case.run(block, set={"H": 5}, name="block")
    case.run(block, set={"H": 5}, name="block_t2", threads=2)
    same = case.digests("block_t2") == case.digests("block") and same_tables(case, "block_t2", "block")
    say(case, "rough block, 12 events in contact, 2 threads: digests and tables", same)
    for name, words in OUTPUTS.items():
        edited = case.edited(BEAM.name, (PLAIN, words), name=f"outputs_{name}.inp")
        case.run(edited, set={"H": h}, name=f"outputs_{name}")
        say(
            case,
            f"beam broken through, outputs {name}: digests",
            case.digests(f"outputs_{name}") == case.digests("beam"),
        )

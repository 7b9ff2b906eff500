"""One deck, one answer: the same bits for any threads, any outputs, any way in; the same answer for any ordering."""

import h5py
import numpy as np
import pytest
from rfem_run import BEAM, PAPER, Run, call, close, edited, run

ROUGH = PAPER / "uniaxial_compression.inp"
BEAM_H4 = ["--set", "H=4"]
ALL_OUTPUTS = """*OUTPUT, FIELD, FREQUENCY=1, EVENTS=1, FORMAT=BOTH
*OUTPUT, HISTORY, FREQUENCY=1, EVENTS=1
*MONITOR, NAME=FEET, NSET=AT_SUPPORTS
*NODE PRINT, NSET=LOAD
U, RF
*EL PRINT, ELSET=ROCK
S, E
*END STEP"""
PLAIN = "*OUTPUT, FIELD, FREQUENCY=10, EVENTS=1\n*OUTPUT, HISTORY, EVENTS=1\n"
OUTPUTS = {
    "few": [(PLAIN, "*OUTPUT, FIELD, FREQUENCY=1000\n*OUTPUT, HISTORY, FREQUENCY=1000\n")],
    "default": [(PLAIN, "")],
    "apdl": [(PLAIN, "*OUTPUT, FIELD, FREQUENCY=7, FORMAT=APDL\n")],
    "every third event": [(PLAIN, "*OUTPUT, FIELD, EVENTS=3\n*OUTPUT, HISTORY, FREQUENCY=2\n")],
    "all": [(PLAIN + "*END STEP", ALL_OUTPUTS)],
    "no checks": [("*SECTION CHECK, NAME=QUARTER\n125., 50., 1., 0.\n", "")],
}


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    return run(BEAM, tmp_path_factory.mktemp("beam"), *BEAM_H4)


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_beam(beam, threads, tmp_path):
    done = run(BEAM, tmp_path, *BEAM_H4, "--threads", threads)
    assert done.digests == beam.digests
    for table in ("_history.csv", "_events.csv"):
        assert done.path(table).read_text() == beam.path(table).read_text(), "all figures, not only the last ones"
    assert f", {threads} threads, " in done.log


def test_threads_rough_block(tmp_path):
    deck = edited(ROUGH, tmp_path, ("STOP DROP=0.3", "MAX EVENTS=12, STOP DROP=0.3"))
    runs = [run(deck, tmp_path / f"t{n}", "--set", "H=5", "--threads", n) for n in (1, 2, 3)]
    assert runs[0].history["event_count"][-1] == 12
    assert runs[0].history["contacts_stick"][-1] + runs[0].history["contacts_slip"][-1] > 0, "contact takes part"
    for done in runs[1:]:
        assert done.digests == runs[0].digests
        for table in ("_history.csv", "_events.csv"):
            assert done.path(table).read_text() == runs[0].path(table).read_text()


def test_twice(beam, tmp_path):
    done = run(BEAM, tmp_path, *BEAM_H4)
    for suffix in (".vtkhdf", "_cracks.vtkhdf"):
        one, other = datasets(done.path(suffix)), datasets(beam.path(suffix))
        assert one.keys() == other.keys() and len(one) > 20
        for name, values in one.items():
            assert values.tobytes() == other[name].tobytes(), name


def datasets(path):
    """All datasets of a file, by name (HDF5 dates its objects, so that files differ)."""
    found = {}

    def take(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(take)
    return found


@pytest.mark.parametrize("name", OUTPUTS)
def test_outputs(beam, name, tmp_path):
    done = run(edited(BEAM, tmp_path, *OUTPUTS[name]), tmp_path / "results", *BEAM_H4, "--verbose")
    assert done.digests == beam.digests
    events = done.events
    for column, values in beam.events.items():
        assert np.array_equal(values, events[column]), column
    history = done.history
    assert history["event_count"][-1] == beam.history["event_count"][-1], (
        "the last state is written whatever is asked for"
    )
    for column in ("time", "LOAD_rf2", "external_work", "released_energy", "max_utilisation", "crack_length"):
        assert history[column][-1] == beam.history[column][-1], column
    rows = {(t, n): f for t, n, f in zip(*(beam.history[c] for c in ("time", "event_count", "LOAD_rf2")))}
    for t, n, f in zip(*(history[c] for c in ("time", "event_count", "LOAD_rf2"))):
        assert rows[t, n] == f, "rows that both have are equal"


def test_standard_input(beam, tmp_path):
    text = edited(BEAM, tmp_path).read_text()
    done = call("--output", tmp_path / "results", *BEAM_H4, input=text)
    assert done.returncode == 0
    done = Run(done, tmp_path / "results", "rfem")
    assert done.digests == beam.digests
    assert done.path("_events.csv").read_text() == beam.path("_events.csv").read_text()


@pytest.mark.parametrize("ordering", ["NONE", "METIS"])
@pytest.mark.parametrize("deck, settings", [(BEAM, "H=8"), (BEAM, "H=4"), (ROUGH, "H=5")])
def test_ordering(deck, settings, ordering, tmp_path):
    """Another internal numbering adds in another order: round-off, which relaxation damps like any other error."""
    edits = [("STOP DROP", "MAX EVENTS=1, STOP DROP")]
    decks = [
        edited(deck, tmp_path / name, *edits, ("*PARAMETER\n", f"*JOB, ORDERING={name}\n*PARAMETER\n"))
        for name in ("HILBERT", ordering)
    ]
    if "built without METIS" in call("--check", decks[1]).stderr:
        pytest.skip("this rfem was built without METIS")
    hilbert, other_one = (run(path, path.parent / "results", "--set", settings) for path in decks)
    before = [done.history["event_count"] == 0 for done in (hilbert, other_one)]
    assert sum(before[0]) == sum(before[1]) > 2
    monitor = "LOAD" if deck == BEAM else "PLATEN"
    for column in (f"{monitor}_rf2", f"{monitor}_u1", "external_work", "max_utilisation", "time"):
        assert close(other_one.history[column][before[1]], hilbert.history[column][before[0]], 1e-9), column
    one, other = hilbert.events, other_one.events
    for column in ("node", "element", "mode", "type", "new_nodes", "new_elements"):
        assert one[column].tolist() == other[column].tolist(), column
    assert close(one["direction_deg"], other["direction_deg"], 1e-9)


SPALLING = PAPER.parent / "tutorial" / "spalling" / "spalling.inp"


def test_threads_and_outputs_of_a_dynamic_step(tmp_path):
    """Waves, splits, impacts and friction in time: neither threads nor outputs change a bit; the ledger closes."""
    one = run(SPALLING, tmp_path / "t1", "--threads", 1)
    assert one.history["event_count"][-1] > 20
    assert one.history["damping_work"][-1] > 0 < one.history["friction_work"][-1]
    assert abs(one.history["energy_error"]).max() < 1e-12
    two = run(SPALLING, tmp_path / "t2", "--threads", 2)
    assert two.digests == one.digests
    for table in ("_history.csv", "_events.csv"):
        assert two.path(table).read_text() == one.path(table).read_text()
    text = "*OUTPUT, FIELD, FREQUENCY=100, EVENTS=10\n*OUTPUT, HISTORY, FREQUENCY=7, EVENTS=1\n*END STEP"
    other = run(edited(SPALLING, tmp_path, ("*END STEP", text)), tmp_path / "outputs", "--threads", 1)
    assert other.digests == one.digests
    assert other.path("_events.csv").read_text() == one.path("_events.csv").read_text()

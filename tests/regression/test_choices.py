"""Choices of *FRACTURE that are there for comparison: cracks along edges, several splits at a time."""

import numpy as np
import pytest
from rfem_run import BEAM, PAPER, edited, run

BLOCK = PAPER / "uniaxial_compression.inp"
BEAM_H8 = ["--set", "H=8"]
BLOCK_H5 = ["--set", "H=5"]
APPROXIMATE = "note: SELECT={} is approximate"


@pytest.fixture(scope="module")
def worst(tmp_path_factory):
    """The beam as it stands: one element after the other."""
    return run(BEAM, tmp_path_factory.mktemp("worst"), *BEAM_H8)


@pytest.fixture(scope="module")
def along_edges(tmp_path_factory):
    folder = tmp_path_factory.mktemp("edge")
    deck = edited(BEAM, folder, ("STOP DROP=0.8", "SPLITTING=EDGE, STOP DROP=0.8"))
    return run(deck, folder / "results", *BEAM_H8)


def test_cracks_along_edges(worst, along_edges):
    """Nothing is bisected; the same first crack at the same load; the path is longer than one through elements."""
    assert set(along_edges.events["type"]) == {"edge"}
    assert not along_edges.events["new_elements"].any()
    assert along_edges.history["elements"].min() == along_edges.history["elements"].max()
    for name in ("node", "load_factor", "LOAD_rf2", "direction_deg"):
        assert along_edges.events[name][0] == worst.events[name][0], name
    height = along_edges.events["y"].max() / worst.events["y"].max()
    assert along_edges.history["crack_length"][-1] > 1.2 * height * worst.history["crack_length"][-1]


def test_balance_along_edges(along_edges):
    """Section balance and energy as with elements; an edge that opens nothing releases nothing and takes no step."""
    assert along_edges.history["QUARTER_error"].max() < 1e-4
    assert np.abs(along_edges.history["energy_error"]).max() < 1e-4
    released = along_edges.events["released_energy"].sum()
    assert released == pytest.approx(along_edges.history["released_energy"][-1], rel=1e-12)


@pytest.fixture(scope="module")
def together(tmp_path_factory):
    """The block between rough platens, its first 30 events: one at a time, separated, all."""
    done = {}
    for selection in ("WORST", "SEPARATED", "ALL"):
        folder = tmp_path_factory.mktemp(selection.lower())
        edit = ("STOP DROP=0.3", f"SELECT={selection}, MAX EVENTS=30, STOP DROP=0.3")
        done[selection] = run(edited(BLOCK, folder, edit), folder / "results", *BLOCK_H5)
    return done


def test_log_says_approximate(together):
    for selection, done in together.items():
        others = {"SEPARATED", "ALL"} - {selection}
        assert selection == "WORST" or done.log.count(APPROXIMATE.format(selection)) == 1
        assert not any(APPROXIMATE.format(other) in done.log for other in others)


def test_rounds(together):
    """Each split is a row; those of a round share load and reactions, fall in utilisation; the last has the rest."""
    events = together["ALL"].events
    assert events["event"].tolist() == list(range(1, 31))
    round_ends = np.flatnonzero(np.append(np.diff(events["PLATEN_rf2"]) != 0, True))
    assert 1 < len(round_ends) < 30
    start = 0
    for end in round_ends:
        rows = slice(start, end + 1)
        assert (np.diff(events["utilisation"][rows]) <= 1e-6 * events["utilisation"][start]).all()
        assert not events["iterations"][start:end].any() and not events["released_energy"][start:end].any()
        assert events["iterations"][end] > 0 and (events["utilisation"][rows] >= 1).all()
        start = end + 1
    history = together["ALL"].history
    assert events["released_energy"].sum() == pytest.approx(history["released_energy"][-1], rel=1e-9)
    assert events["new_elements"].sum() == history["elements"][-1] - history["elements"][0]
    assert np.abs(history["energy_error"]).max() < 1e-4


def test_all_at_once_spoils_localisation(together):
    """The same first event; then 30 splits one at a time are one crack, in rounds they are several side by side."""
    assert len({done.events["node"][0] for done in together.values()}) == 1
    cracks = {selection: done.history["cracks"][-1] for selection, done in together.items()}
    assert cracks["ALL"] > cracks["WORST"]
    assert np.std(together["ALL"].events["x"]) > np.std(together["WORST"].events["x"])


def test_max_events_within_a_round(tmp_path):
    """The step ends after MAX EVENTS splits, also in the middle of a round."""
    deck = edited(BLOCK, tmp_path, ("STOP DROP=0.3", "SELECT=ALL, MAX EVENTS=7, STOP DROP=0.3"))
    done = run(deck, tmp_path / "results", *BLOCK_H5)
    assert done.history["event_count"][-1] == 7
    assert "stopped: MAX EVENTS=7" in done.log

"""A mesh that grows is numbered anew on the way. Nothing shows it: not threads, results, nor what later steps name.

The deck's own numbering (ORDERING=NONE) never changes: a run in it is what the other one must be, but for round-off.
"""

import pytest
import rfem_results
from rfem_run import SOURCE, close, edited, run

GROWN = SOURCE / "tests" / "deck" / "good" / "grown.inp"
ANEW = "step 1: numbered anew, as the mesh has grown by "
DECKS = {
    "static": [],
    # the same plate is pulled by a blow and goes on moving: splits in many moments
    "dynamic": [
        ("PULL\n*STATIC\n0.5, 1.\n*RELAXATION, TOLERANCE=1E-8", "PULL\n*DYNAMIC, EXPLICIT, LOOK=5\n, 1E-5"),
        ("SELECT=ALL, MAX EVENTS=230", "SELECT=ALL"),
        ("*BOUNDARY\nRIGHT, 1, 1, 0.012", "*BOUNDARY, TYPE=VELOCITY\nRIGHT, 1, 1, 1200."),
        ("NAMED\n*STATIC\n1., 1.\n*RELAXATION, TOLERANCE=1E-8", "NAMED\n*DYNAMIC, EXPLICIT, LOOK=5\n, 1E-6"),
        ("481, 2, 2, 0.002", "481, 2, 2"),
        ("*MONITOR", "*OUTPUT, FIELD, FREQUENCY=1000\n*OUTPUT, HISTORY, FREQUENCY=10\n*MONITOR"),
    ],
}


@pytest.fixture(scope="module", params=DECKS)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def one(kind, tmp_path_factory):
    folder = tmp_path_factory.mktemp(kind)
    return run(edited(GROWN, folder, *DECKS[kind]), folder / "results")


def test_threads(one, kind, tmp_path):
    assert one.log.count("numbered anew") == one.log.count(ANEW) > 0
    assert one.history["nodes"][-1] > 925 + 512
    two = run(edited(GROWN, tmp_path, *DECKS[kind]), tmp_path / "results", "--threads", 2)
    assert two.digests == one.digests
    for table in ("_history.csv", "_events.csv"):
        assert two.path(table).read_text() == one.path(table).read_text()


def test_the_same_in_the_numbers_of_the_deck(one, kind, tmp_path):
    deck = edited(GROWN, tmp_path, *DECKS[kind], ("ORDERING=HILBERT", "ORDERING=NONE"))
    other = run(deck, tmp_path / "results")
    assert "numbered anew" not in other.log
    assert other.digests[1] == one.digests[1], "the same elements, broken in the same order"
    assert other.digests[0] != one.digests[0], "sums in another order: if not, ORDERING did nothing"
    for name in "step event_count nodes elements cracks fragments".split(" "):
        assert (other.history[name] == one.history[name]).all(), name
    for name in (
        "time crack_length external_work strain_energy kinetic_energy friction_work softening_work damping_work "
        "released_energy GRIP_u1 GRIP_u2 GRIP_rf1 GRIP_rf2"
    ).split(" "):
        assert close(other.history[name], one.history[name], 1e-9), name
    for name in "node element mode type new_nodes new_elements".split(" "):
        assert other.events[name].tolist() == one.events[name].tolist(), name


def test_what_later_steps_name(one, kind):
    """The support and the elements of the second step are those of the deck."""
    frames = rfem_results.Results(one.folder, one.job).frames
    last = frames[len(frames) - 1]
    nodes, origin = last.point_data, last.cell_data["element_origin"]
    gone = {400, 900}
    assert set(range(1, 1729)) - set(origin.tolist()) == gone
    held = nodes["node_id"] == 481
    if kind == "static":
        assert nodes["displacement"][held][:, 1] == pytest.approx([0.002], rel=1e-6)
    # held upwards are the corner, by a line before the steps, and this node
    assert set(nodes["node_origin"][nodes["reaction"][:, 1] != 0].tolist()) == {1, 481}

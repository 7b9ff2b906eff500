"""Rock in place: at rest where its stress balances the loads; a crack, or an excavation, releases what is stored."""

import numpy as np
import rfem_results
from rfem_run import run

ROCK = """\
*MATERIAL, NAME=ROCK
*ELASTIC
27.4E9, 0.25
*DENSITY
2600.
*STRENGTH, CRITERION=CUTOFF
4.5E6, 10.E6, 30.
*HETEROGENEITY, DISTRIBUTION=NORMAL
0.02
*SOLID SECTION, ELSET=ROCK, MATERIAL=ROCK
"""

COLUMN = f"""\
*MESH, SHAPE=RECTANGLE, ELSET=ROCK, JITTER=0.2
0., -20., 10., 20., 8, 16
{ROCK}
*INITIAL CONDITIONS, TYPE=STRESS, GEOSTATIC
ROCK, 0., 0., -510120., -20., 0.6
*BOUNDARY
LEFT, 1, 1
RIGHT, 1, 1
BOTTOM, 2, 2
*STEP
*STATIC
*FRACTURE
*DLOAD
ROCK, GRAV, 9.81, 0., -1.
*SECTION CHECK, NAME=MIDDLE
5., -10., 0., 1.
*END STEP
"""

BAR = f"""\
*MESH, SHAPE=RECTANGLE, TYPE=CPS3, ELSET=ROCK
0., 0., 60., 20., 30, 10
{ROCK}
*INITIAL CONDITIONS, TYPE=STRESS
ROCK, 4.4E6, 0., 0., 0.
*NSET, NSET=CORNER, NEAREST
0., 0.
60., 0.
*BOUNDARY
LEFT, 1, 1
RIGHT, 1, 1
CORNER, 2, 2
*STEP
*STATIC
0.05, 1.
*FRACTURE, STOP DROP=0.99, MONITOR=GRIP
*BOUNDARY
RIGHT, 1, 1, 0.002
*MONITOR, NAME=GRIP, NSET=RIGHT
*END STEP
"""

# a tunnel below an open cut, in two steps; the rock round it breaks
CUT = f"""\
*MESH, SHAPE=RECTANGLE, ELSET=ROCK
0., 0., 20., 20., 20, 20
*ELSET, ELSET=TUNNEL, CIRCLE
10., 10., 0., 2.5
*ELSET, ELSET=CUT, BOX
-1., 5., 15., 21.
{ROCK}
*INITIAL CONDITIONS, TYPE=STRESS
ROCK, -38.E6, -16.E6, -13.5E6, 0.
*BOUNDARY
LEFT, 1, 1
RIGHT, 1, 1
BOTTOM, 2, 2
TOP, 2, 2
*STEP
*STATIC
*END STEP
*STEP
*STATIC
0.25, 1.
*FRACTURE, MAX EVENTS=8
*MODEL CHANGE, REMOVE, TYPE=ELEMENT
TUNNEL
*OUTPUT, FIELD, EVENTS=1
*END STEP
*STEP
*STATIC
0.5, 1.
*MODEL CHANGE, REMOVE, TYPE=ELEMENT
CUT, 400
*FRACTURE, MAX EVENTS=8
*OUTPUT, FIELD, EVENTS=1
*END STEP
"""


def run_text(text, folder):
    deck = folder / "in_situ.inp"
    deck.write_text(text)
    return run(deck, folder)


def test_geostatic_state_stays_at_rest(tmp_path):
    done = run_text(COLUMN, tmp_path)
    history = done.history
    assert history["event_count"][-1] == 0
    assert history["residual"][-1] < 1e-8
    assert history["iterations"][-1] == 0
    # weight of the upper half, carried by the section
    assert abs(abs(history["MIDDLE_f2"][-1]) / (2600 * 9.81 * 10 * 10) - 1) < 1e-2  # its nodes do not lie on the line
    assert history["MIDDLE_error"][-1] < 1e-12


def test_crack_releases_the_initial_stress(tmp_path):
    """A bar between fixed ends, stressed to 98 % of its strength from the start: the crack that a little pull makes
    sets the whole energy of the initial stress free, and what the pull has stored besides."""
    done = run_text(BAR, tmp_path)
    history = done.history
    assert history["event_count"][-1] > 0
    assert abs(history["GRIP_rf1"][-1]) < 0.01 * 4.4e6 * 20  # apart: debris may still touch
    stored = 4.4e6**2 / (2 * 27.4e9) * 60 * 20
    assert abs(history["strain_energy"][-1] / -stored - 1) < 2e-3
    # all that was done and stored has been released
    spent = history["released_energy"][-1] + history["friction_work"][-1]
    assert abs(spent / (history["external_work"][-1] - history["strain_energy"][-1]) - 1) < 1e-3
    assert np.max(np.abs(history["energy_error"])) < 1e-4


def test_excavation_in_two_steps(tmp_path):
    """What is left keeps its ids, in the deck's order; the ledger closes; threads do not show."""
    done = run_text(CUT, tmp_path)
    history = done.history
    assert history["event_count"][-1] > 5
    # to round-off and the tolerance while nothing slips; afterwards friction is counted with the traction at the end
    assert np.max(np.abs(history["energy_error"][history["event_count"] == 0])) < 1e-5
    assert np.max(np.abs(history["energy_error"])) < 1e-2
    frames = rfem_results.open_results(tmp_path / "in_situ").frames
    first, last = frames[0], frames[-1]
    for data in ("node_id", "element_id"):
        before, after = ids(first, data), ids(last, data)
        kept = after[np.isin(after, before)]
        assert len(kept) < len(before)
        assert (np.diff(after) > 0).all()
        assert len(after) == len(set(after))
    assert 400 not in ids(last, "element_id")
    place = dict(zip(ids(first, "node_id"), first.points))
    for node, x in zip(ids(last, "node_id"), last.points):
        assert node not in place or (place[node] == x).all()
    assert history["elements"][-1] == len(last.cells)
    other = tmp_path / "other"
    other.mkdir()
    deck = tmp_path / "in_situ.inp"
    assert run(deck, other, threads=2).digests == done.digests


def ids(frame, name):
    """Ids of the points or cells of a frame."""
    data = frame.point_data if name == "node_id" else frame.cell_data
    return np.asarray(data[name])


FIRST, SECOND, _ = CUT.replace("0.25, 1.\n*FRACTURE, MAX EVENTS=8\n", "").split("*STEP\n*STATIC\n", 3)[1:]
BLAST = (
    CUT.split("*STEP\n")[0]
    + "*STEP\n*STATIC\n"
    + FIRST
    + "*STEP\n*DYNAMIC, EXPLICIT\n, 0.002\n"
    + SECOND
    + "*STEP\n*STATIC\n*END STEP\n"
)


def test_sudden_excavation(tmp_path):
    """In a dynamic step the forces of what goes are gone at once: waves, and a ledger that closes to round-off, also
    where the moving body is then brought to rest."""
    done = run_text(BLAST, tmp_path)
    history = done.history
    moving = (history["step"] == 2) & (history["increment"] > 0)
    assert np.max(history["kinetic_energy"][moving]) > 0.1 * np.max(np.abs(history["strain_energy"]))
    assert np.max(np.abs(history["energy_error"])) < 1e-9
    assert history["kinetic_energy"][-1] == 0
    assert history["damping_work"][-1] > 0


LINED = f"""\
*MESH, SHAPE=RECTANGLE, ELSET=ROCK, PATTERN=CROSS
0., 0., 20., 20., 10, 10
*ELSET, ELSET=ROOM, BOX
6., 14., 8., 14.
*NSET, NSET=WALL, BOX
6., 14., 8., 14.
{ROCK}
*INITIAL CONDITIONS, TYPE=STRESS
ROCK, -5.E6, -5.E6, -2.5E6, 0.
*BOUNDARY
LEFT, 1, 1
RIGHT, 1, 1
BOTTOM, 2, 2
TOP, 2, 2
*STEP
*STATIC
*END STEP
*STEP
*STATIC
0.25, 1.
*MODEL CHANGE, REMOVE, TYPE=ELEMENT
ROOM
*PRESSURE
WALL, 5.E6
*END STEP
"""


def test_pressure_takes_over(tmp_path):
    """Under equal pressure from all sides a room is taken out while a pressure on its wall grows in its place: at no
    load factor anything moves."""
    done = run_text(LINED, tmp_path)
    assert (done.history["iterations"] == 0).all()
    for frame in rfem_results.open_results(tmp_path / "in_situ").frames:
        assert np.abs(frame.displacement).max() < 1e-12 * 20
    assert done.history["elements"][-1] < done.history["elements"][0]

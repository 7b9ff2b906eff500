"""Rock under initial stress: at rest where it balances the loads; a crack releases what is stored."""

import numpy as np
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

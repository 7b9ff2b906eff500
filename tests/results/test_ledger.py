"""The energy ledger of static runs with friction closes."""

import numpy as np
import pytest
from rfem_run import run

SLIDING = """*HEADING
A block cut at 63.43 degrees, loaded in proportion: the faces slide from the start
*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=ROCK, PATTERN=DIAGONAL
0., 0., 1., 2., 8, 16
*MATERIAL, NAME=ROCK
*ELASTIC
1000., 0.25
*SOLID SECTION, ELSET=ROCK, MATERIAL=ROCK
*CRACK, NAME=CUT
0., 0.
1., 2.
*FRICTION
1.
*BOUNDARY
BOTTOM, 1, 2
*STEP
*STATIC
{increment}, 1.
*RELAXATION, TOLERANCE=1.E-9
*BOUNDARY
TOP, 1, 1
TOP, 2, 2, -0.01
*END STEP
"""


@pytest.mark.parametrize("increment", [1.0, 0.25])
def test_sliding_in_proportion(increment, tmp_path):
    """Traction and slip grow together: their work is half the product, however many increments there are."""
    deck = tmp_path / "sliding.inp"
    deck.write_text(SLIDING.format(increment=increment))
    done = run(deck, tmp_path / "results")
    assert done.status == 0
    history = done.history
    assert history["contacts_slip"][-1] > 5
    assert history["friction_work"][-1] > 0.01 * history["external_work"][-1]
    assert np.abs(history["energy_error"]).max() < 1e-6

"""A block that a joint has let go: it slides as far as the platen drives it, and does not coast on without force."""

import pytest
from rfem_run import run

DECK = """*HEADING
A block on a joint at 45 degrees with cohesion: it holds, gives way, and slides one to one
*MESH, SHAPE=RECTANGLE, TYPE=CPS3, ELSET=B
0., 0., 50., 100., 10, 20
*CRACK, NAME=J
-5., 20.
55., 80.
*FRICTION, COHESION=0.5
0.3
*MATERIAL, NAME=ROCK
*ELASTIC
30000., 0.
*SOLID SECTION, ELSET=B, MATERIAL=ROCK
*NSET, NSET=C
1
*BOUNDARY
BOTTOM, 2, 2
C, 1, 1
*STEP
*STATIC
{increment}, 1.
*BOUNDARY
TOP, 2, 2, -0.01
*MONITOR, NAME=P, NSET=TOP
*END STEP
"""


@pytest.mark.parametrize("increment", [0.05, 0.02])
def test_block_does_not_coast(increment, tmp_path):
    """The strength is Coulomb's, 2 c/(1 - mu) on the block's width; then the top has moved as far sideways as down."""
    deck = tmp_path / "block.inp"
    deck.write_text(DECK.format(increment=increment))
    done = run(deck, tmp_path / "results")
    assert done.status == 0
    history = done.history
    assert max(abs(history["P_rf2"])) <= 2 * 0.5 / (1 - 0.3) * 50 * 1.001
    assert history["P_u1"][-1] == pytest.approx(-0.01, rel=0.05)

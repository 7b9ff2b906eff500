"""A slab on a plane is pushed for 4 ms; friction brings it to rest: where faces have slipped to, there they stick."""

import numpy as np
import pytest
from rfem_run import run

MASS = 2600.0 * 8 * 0.25
GRAVITY, FRICTION, PUSH, RISE = 8.0, 0.5, 20.0, 0.002

DECK = f"""*HEADING
A slab 8 x 0.25 m on a plane, stiff: how much it gives is not asked for here
*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=ALL, PATTERN=ALTERNATING
0., -0.25, 8., 0.5, 32, 4
*MATERIAL, NAME=ROCK
*ELASTIC
27.4E11, 0.
*DENSITY
2600.
*SOLID SECTION, ELSET=ALL, MATERIAL=ROCK
*CRACK, NAME=PLANE, SPLITTING=EDGE
0., 0.
8., 0.
*FRICTION
{FRICTION}
{{joint}}*ELSET, ELSET=PUSH
ALL
*AMPLITUDE, NAME=PULSE
0., 0., {RISE}, 1., {2 * RISE}, 0.
*BOUNDARY
BOTTOM, 1, 2
*STEP
*STATIC
*DLOAD
ALL, GRAV, {GRAVITY}, 0., -1.
*MONITOR, NAME=TOP, NSET=TOP
*END STEP
*STEP
*DYNAMIC, EXPLICIT
, 0.03
*DLOAD, AMPLITUDE=PULSE
PUSH, GRAV, {PUSH}, 1., 0.
*END STEP
"""

#: a vertical joint through slab and plane: where it meets the plane, pairs share nodes
JOINT = f"""*CRACK, NAME=JOINT, SPLITTING=EDGE
4., -0.25
4., 0.25
*FRICTION
{FRICTION}
"""


def slip_of_rigid_slab():
    """Slip at rest of a rigid slab under the pulse: Newton and Coulomb."""
    time = np.linspace(0, 0.03, 300001)
    push = np.interp(time, [0, RISE, 2 * RISE], [0, PUSH, 0])
    start = np.argmax(push > FRICTION * GRAVITY)
    velocity = np.concatenate([[0], np.cumsum((push - FRICTION * GRAVITY)[start:-1] * np.diff(time[start:]))])
    velocity[np.argmax(velocity[1:] <= 0) + 1 :] = 0
    return float(np.sum(velocity[:-1] * np.diff(time[start:])))


@pytest.mark.parametrize("joint", ["", JOINT], ids=["plane", "joint"])
def test_slab_comes_to_rest(joint, tmp_path):
    """It slips as far as a rigid slab does, stays there, and friction only takes energy."""
    deck = tmp_path / "slab.inp"
    deck.write_text(DECK.format(joint=joint))
    history = run(deck, tmp_path / "results").history
    slip = slip_of_rigid_slab()
    late = history["time"] > history["time"][-1] - 0.01
    assert history["TOP_u1"][late] == pytest.approx(slip, rel=0.03)
    work = history["friction_work"]
    assert np.all(np.diff(work) >= -1e-6 * work[-1])
    assert work[-1] == pytest.approx(FRICTION * MASS * GRAVITY * slip, rel=0.05)

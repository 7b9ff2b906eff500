"""Loads, monitors and the start of a run, where elements are taken out of the body or nothing is left to carry."""

import h5py
import numpy as np
import pytest
from rfem_run import run

BLOCK = """*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=BLOCK, PATTERN=DIAGONAL
0., 0., 1., 1., 4, 4
*ELSET, ELSET=HOLE, BOX
{hole}
*NSET, NSET=WALL, BOX
{hole}
*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*DENSITY
0.0026
*SOLID SECTION, ELSET=BLOCK, MATERIAL=ROCK
1.
*BOUNDARY
BOTTOM, 1, 2
"""
FIRST = """*STEP
*STATIC
1., 1.
{load}*MONITOR, NAME=FOOT, NSET=BOTTOM
*MONITOR, NAME=TOP, NSET=TOP
*END STEP
"""
SECOND = """*STEP
*STATIC
{increment}, 1.
*MODEL CHANGE, REMOVE, TYPE=ELEMENT
HOLE
{load}*OUTPUT, HISTORY, FREQUENCY=1
*END STEP
"""
NOTCH, INSIDE = "0.25, 0.75, 0.5, 1.", "0.25, 0.75, 0.25, 0.75"


def excavated(tmp_path, hole, before, after, increment=1.0, status=0):
    """A block that loses a part in the second step."""
    deck = BLOCK.format(hole=hole) + FIRST.format(load=before) + SECOND.format(load=after, increment=increment)
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "case.inp").write_text(deck)
    return run(tmp_path / "case.inp", tmp_path / "out", "--verbose", status=status)


def displacements(result):
    """The last frame's."""
    with h5py.File(result.path(".vtkhdf")) as file:
        first = int(file["VTKHDF/Steps/PointDataOffsets/displacement"][-1])
        return file["VTKHDF/PointData/displacement"][first:, :2]


def test_pressure_stated_again_reaches_exposed_edges(tmp_path):
    """The floor of the notch is 0.5 long; its sides balance each other."""
    again = excavated(tmp_path / "a", NOTCH, "*PRESSURE\nWALL, 1.\n", "*PRESSURE\nWALL, 2.\n")
    at_once = excavated(tmp_path / "b", NOTCH, "", "*PRESSURE\nWALL, 2.\n")
    assert again.history["FOOT_rf2"][-1] == pytest.approx(1.0, rel=1e-4)
    u = displacements(at_once)
    assert np.abs(displacements(again) - u).max() < 1e-4 * np.abs(u).max()


def test_pressure_begins_at_zero_where_it_is_new(tmp_path):
    """Half-way through the second step the new edges bear half, while the forces of what went have fallen by half."""
    history = excavated(tmp_path, NOTCH, "*PRESSURE\nWALL, 2.\n", "*PRESSURE\nWALL, 2.\n", increment=0.5).history
    last = history["FOOT_rf2"][history["step"] == 2]
    assert last == pytest.approx([1.0, 1.0], rel=1e-4)


def test_pressure_that_is_not_stated_again_stays_where_it_was(tmp_path):
    history = excavated(tmp_path, NOTCH, "*PRESSURE\nWALL, 2.\n", "").history
    assert abs(history["FOOT_rf2"][-1]) < 1e-4


@pytest.mark.parametrize("load, force", [("*PRESSURE\nWALL, 1.\n", 0.0), ("*DLOAD\n{below}, P{face}, 1.\n", 0.25)])
def test_wall_inside_the_body(tmp_path, load, force):
    """A wall that only the excavation exposes: all of it by its nodes, or one face by name."""
    result = excavated(tmp_path, INSIDE, "", load.format(below=4, face=2))
    assert result.history["FOOT_rf2"][-1] == pytest.approx(force, abs=1e-4)


def test_wall_before_it_is_exposed(tmp_path):
    """In the step before the faces still lie against other elements."""
    result = excavated(tmp_path, INSIDE, "*DLOAD\n4, P2, 1.\n", "", status=2)
    assert "pressure acts on the boundary only" in result.messages


def test_monitor_without_nodes(tmp_path):
    result = excavated(tmp_path, "0., 1., 0.75, 1.", "*CLOAD\nTOP, 2, -1.\n", "")
    assert "all nodes of monitor TOP have been removed" in result.log
    for column in ("TOP_u1", "TOP_u2", "TOP_rf1", "TOP_rf2"):
        assert np.isfinite(result.history[column][:2]).all()
        assert np.isnan(result.history[column][-1])
    assert result.history["FOOT_rf2"][-1] == pytest.approx(0, abs=1e-4)


def test_parted_body_balances(tmp_path):
    """A section of a block that was pulled apart: what is left of its forces is round-off, and no false alarm."""
    deck = BLOCK.format(hole="0., 1., 0.5, 0.75").replace("*BOUNDARY\n", "*BOUNDARY\nTOP, 1, 1\n") + FIRST.format(
        load="*BOUNDARY\nTOP, 2, 2, 1e-3\n*SECTION CHECK, NAME=S\n0.5, 0.9, 0., 1.\n"
    )
    (tmp_path / "case.inp").write_text(deck + SECOND.format(load="", increment=1.0))
    result = run(tmp_path / "case.inp", tmp_path / "out")
    assert result.history["S_error"].max() < 1e-4
    assert abs(result.history["FOOT_rf2"][-1]) < 1e-3 * abs(result.history["FOOT_rf2"][1])


def test_initial_velocity_in_the_first_row(tmp_path):
    """Row 0 and frame 0: held nodes are at rest, and the energy is that of the others."""
    deck = (
        BLOCK.format(hole=NOTCH)
        + "*NSET, NSET=ALL, BOX\n0., 1., 0., 1.\n*INITIAL CONDITIONS, TYPE=VELOCITY\nALL, 2, -0.5\n"
    )
    deck += "*STEP\n*DYNAMIC, EXPLICIT\n0., 5e-4\n*OUTPUT, HISTORY, FREQUENCY=1\n*END STEP\n"
    (tmp_path / "case.inp").write_text(deck)
    result = run(tmp_path / "case.inp", tmp_path / "out")
    mass = 0.0026 * (1 - 0.25 / 2)  # the lower row's lower nodes are held
    history = result.history
    assert history["kinetic_energy"][0] == pytest.approx(0.5 * mass * 0.25, rel=1e-9)
    assert history["external_work"][0] == history["kinetic_energy"][0]
    assert history["energy_error"].max() < 1e-9
    with h5py.File(result.path(".vtkhdf")) as file:
        root = file["VTKHDF"]
        n = int(root["NumberOfPoints"][0])
        points, velocity = root["Points"][:n], root["PointData/velocity"][:n]
    held = points[:, 1] == 0
    assert np.all(velocity[held] == 0)
    assert np.all(velocity[~held, 1] == -0.5)

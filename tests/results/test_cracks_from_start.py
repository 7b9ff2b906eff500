"""Cracks that exist from the start (*CRACK): what results say of them; all that is attached to the mesh follows."""

import h5py
import numpy as np
import pytest
from rfem_run import run

DECK = """*HEADING
A block with cracks
*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=ROCK, PATTERN=STAGGERED
0., 0., 4., 4., 8, 8
*NSET, NSET=PIN, NEAREST
0., 0.
*NSET, NSET=MOUTH, NEAREST
2., 4.
*NSET, NSET=SIDE, NEAREST
4., 2.
*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*STRENGTH
4.5, 10., 30.
*FRICTION
1.
*DENSITY
2.6E-3
*SOLID SECTION, ELSET=ROCK, MATERIAL=ROCK
2.
{cracks}*BOUNDARY
BOTTOM, 2, 2
PIN, 1, 1
*STEP
*STATIC
*RELAXATION, TOLERANCE=1E-10
{loads}*MONITOR, NAME=BASE, NSET=BOTTOM
*END STEP
"""
THROUGH = "*CRACK, NAME=THROUGH\n-1., 1.3\n5., 2.6\n"
MOUTH = "*CRACK, NAME=MOUTH\n2., 4.\n2.3, 2.9\n"
CUT = "*CRACK, NAME=CUT, SPLITTING=ELEMENT\n0.6, 0.\n0.9, 1.\n"


def run_deck(tmp_path, cracks, loads="", status=0, **values):
    (tmp_path / "block.inp").write_text(DECK.format(cracks=cracks, loads=loads))
    done = run(tmp_path / "block.inp", tmp_path, **values)
    assert done.status == status, done.messages
    return done


def test_row_0_has_them(tmp_path):
    done = run_deck(tmp_path, THROUGH + MOUTH)
    length = np.hypot(4, 4 * 1.3 / 6) + np.hypot(0.3, 1.1)
    assert done.history["cracks"][0] == 2
    assert done.history["fragments"][0] == 2
    assert done.history["crack_length"][0] == pytest.approx(length, rel=1e-9)
    with h5py.File(done.path("_cracks.vtkhdf")) as file:
        cells = file["VTKHDF/CellData"]
        assert len(cells["mode"]) > 8
        assert not np.any(cells["mode"]) and not np.any(cells["event"])
    with h5py.File(done.path(".vtkhdf")) as file:
        assert not np.any(file["VTKHDF/CellData/split_level"])
    assert "cracks from the start: 2, " in done.log


@pytest.mark.parametrize("cracks", ["", THROUGH, MOUTH, CUT, THROUGH + MOUTH + CUT])
def test_loads_keep_their_sums(cracks, tmp_path):
    """Forces on nodes, pressure on sides, gravity: the base bears the same whatever has been cut."""
    loads = (
        "*CLOAD\nMOUTH, 2, -3.\nTOP, 2, -0.1\n*PRESSURE\nTOP, 0.5\n*DLOAD\nROCK, GRAV, 10., 0., -1.\n"
        "*CLOAD\nSIDE, 1, -0.1\n"
    )
    done = run_deck(tmp_path, cracks, loads)
    nodes_of_top = 9
    expected = 3 + 0.1 * nodes_of_top + 0.5 * 4 * 2 + 2.6e-3 * 10 * 16 * 2
    assert done.history["BASE_rf2"][-1] == pytest.approx(expected, rel=1e-8)


def test_prescribed_motion_of_a_cut_side(tmp_path):
    """A crack that ends at a side whose nodes are moved: the new nodes there move likewise."""
    done = run_deck(tmp_path, "*CRACK, NAME=A\n1.1, 5.\n1.3, 3.1\n", "*BOUNDARY\nTOP, 2, 2, -0.001\n")
    with h5py.File(done.path(".vtkhdf")) as file:
        last = file["VTKHDF/Steps/PointOffsets"][-1]
        x, u = file["VTKHDF/Points"][last:], file["VTKHDF/PointData/displacement"][-len(file["VTKHDF/Points"][last:]) :]
    top = np.abs(x[:, 1] - 4) < 1e-9
    assert top.sum() >= 10
    assert u[top, 1] == pytest.approx(-0.001, abs=1e-15)


PATCH = "*NSET, NSET=PATCH, BOX\n1.5, 2.5, 4., 4.\n"


@pytest.mark.parametrize("line", ["2.6, 4.\n2.4, 2.9\n", "1.6, 4.5\n1.6, 2.9\n", "2.4, 4.\n2.4, 3.\n"])
def test_pressed_part_keeps_its_length(line, tmp_path):
    """A crack that ends beside the end of a pressed part of a side does not move that end."""
    done = run_deck(tmp_path, PATCH + "*CRACK, NAME=A\n" + line, "*PRESSURE\nPATCH, 3.\n")
    assert done.history["BASE_rf2"][-1] == pytest.approx(3 * 1 * 2, rel=1e-7)


def test_supports_stay_in_place(tmp_path):
    """A crack beside a node that a support or a force means: neither fitting nor smoothing moves it."""
    deck = DECK.replace("BOTTOM, 2, 2", "PIN, 2, 2").replace("NSET=BOTTOM", "NSET=PIN").replace("STAGGERED", "DIAGONAL")
    sets = "*NSET, NSET=ALONE, NEAREST\n1.5, 0.\n*NSET, NSET=INSIDE, NEAREST\n2.5, 2.5\n"
    cracks = sets + "*CRACK, NAME=A\n1.55, -1.\n1.62, 1.\n*CRACK, NAME=B\n2.2, 2.55\n2.9, 2.6\n"
    (tmp_path / "block.inp").write_text(
        deck.format(cracks=cracks, loads="*BOUNDARY\nALONE, 2, 2\n*CLOAD\nINSIDE, 2, -1.\n")
    )
    done = run(tmp_path / "block.inp", tmp_path)
    with h5py.File(done.path(".vtkhdf")) as file:
        x = file["VTKHDF/Points"][:]
    for place in ([1.5, 0, 0], [2.5, 2.5, 0]):
        assert np.any(np.all(np.abs(x - place) < 1e-12, axis=1)), place


@pytest.mark.parametrize("line", ["-1., 1.3\n5., 2.6\n", "0., 1.2\n2.4, 1.7\n", "1.1, 4.5\n2.4, -0.5\n"])
def test_prescribed_field_on_a_cut_boundary(line, tmp_path):
    """Nodes of the boundary with displacements linear in their place: those that a crack puts between them follow,
    and the whole body is strained as if there were no crack."""
    strain = np.array([-1e-4, -1.5e-4])
    deck = DECK.split("{cracks}")[0].replace("*FRICTION\n1.", "*FRICTION\n5.")
    plain = deck + "*BOUNDARY\nBOTTOM, 1, 2\n*STEP\n*STATIC\n*MONITOR, NAME=A, NSET=BOTTOM\n*END STEP\n"
    (tmp_path / "plain.inp").write_text(plain)
    with h5py.File(run(tmp_path / "plain.inp", tmp_path).path(".vtkhdf")) as file:
        n = file["VTKHDF/NumberOfPoints"][0]
        x, ids = file["VTKHDF/Points"][:n], file["VTKHDF/PointData/node_id"][:n]
    moved = [
        f"{i}, {k + 1}, {k + 1}, {float(strain[k]) * p[k]!r}"
        for i, p in zip(ids.tolist(), x[:, :2].tolist())
        if min(p) < 1e-9 or max(p) > 4 - 1e-9
        for k in (0, 1)
    ]
    text = deck + "*CRACK, NAME=A\n" + line + "*STEP\n*STATIC\n*RELAXATION, TOLERANCE=1E-10\n*BOUNDARY\n"
    (tmp_path / "block.inp").write_text(text.replace("\n\n", "\n") + "\n".join(moved) + "\n*END STEP\n")
    done = run(tmp_path / "block.inp", tmp_path)
    assert done.status == 0, done.messages
    with h5py.File(done.path(".vtkhdf")) as file:
        last = file["VTKHDF/Steps/PointOffsets"][-1]
        x = file["VTKHDF/Points"][last:, :2]
        u = file["VTKHDF/PointData/displacement"][-len(x) :, :2]
    assert u == pytest.approx(strain * x, abs=1e-9 * np.abs(strain).max() * 4)


@pytest.mark.parametrize("line", ["-1., -1.\n5., 3.2\n", "-3., 2.2\n9., 2.6\n"])
def test_cut_crack_is_clipped(line, tmp_path):
    """SPLITTING=ELEMENT begins where the line enters the body and runs along it to where the line leaves."""
    done = run_deck(tmp_path, "*CRACK, NAME=A, SPLITTING=ELEMENT\n" + line)
    with h5py.File(done.path("_cracks.vtkhdf")) as file:
        x = file["VTKHDF/Points"][:, :2]
    (ax, ay), (bx, by) = np.fromstring(line.replace("\n", ","), sep=",")[:4].reshape(2, 2)
    away = ((bx - ax) * (x[:, 1] - ay) - (by - ay) * (x[:, 0] - ax)) / np.hypot(bx - ax, by - ay)
    assert np.abs(away).max() < 0.5
    assert x[:, 0].max() == pytest.approx(4)
    assert np.min(x) == pytest.approx(0)
    assert done.history["fragments"][0] == 2


def test_friction_of_the_crack(tmp_path):
    """The crack's own friction decides whether it slips; its slope is 0.217."""
    loads = "*PRESSURE\nTOP, 1.\n"
    sticks = run_deck(tmp_path, THROUGH + "*FRICTION\n0.25\n", loads)
    assert sticks.history["contacts_slip"][-1] == 0
    done = run_deck(tmp_path, THROUGH + "*FRICTION\n0.2\n", loads)
    assert "stopped: mechanism" in done.log
    cohesive = run_deck(tmp_path, THROUGH + "*FRICTION, COHESION=0.5\n0.2\n", loads)
    assert cohesive.history["contacts_slip"][-1] == 0


def test_same_mesh_in_any_numbering(tmp_path):
    """ORDERING changes neither the fitted mesh (but for rounding) nor its ids."""
    seen = []
    for ordering in ("HILBERT", "NONE"):
        folder = tmp_path / ordering
        folder.mkdir()
        done = run_deck(folder, f"*JOB, ORDERING={ordering}\n" + THROUGH + MOUTH)
        with h5py.File(done.path(".vtkhdf")) as file:
            seen.append((file["VTKHDF/Points"][:], file["VTKHDF/PointData/node_id"][:], file["VTKHDF/Connectivity"][:]))
    for one, other in zip(*seen):
        assert one.shape == other.shape
        assert np.allclose(one, other, rtol=0, atol=1e-12)

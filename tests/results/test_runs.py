"""Results of real runs, read back by h5py, by VTK and as text, hold what docs/results.md promises.

A beam in tension whose ids are shuffled and have gaps, with every output on, and a block with shear cracks in contact.
"""

import re

import h5py
import numpy as np
import pytest
import read_apdl
from rfem_run import BEAM, PAPER, edited, read_mesh, run

STATE_COLUMNS = (
    "step increment time load_factor event_count iterations residual converged nodes elements cracks crack_length "
    "fragments exhausted exhausted_utilisation contacts_open contacts_slip contacts_stick events_tension events_shear "
    "max_utilisation external_work strain_energy kinetic_energy friction_work softening_work released_energy "
    "damping_work energy_error"
).split()
EVENT_COLUMNS = (
    "event step increment time load_factor node x y mode sigma1 sigma3 utilisation direction_deg element type "
    "new_nodes new_elements released_energy iterations"
).split()
POINT_FIELDS = {
    "displacement": 3,
    "reaction": 3,
    "stress": 6,
    "sigma1": 1,
    "sigma3": 1,
    "utilisation": 1,
    "node_id": 1,
    "node_origin": 1,
}
CELL_FIELDS = {
    "stress": 6,
    "material": 1,
    "element_id": 1,
    "element_origin": 1,
    "split_level": 1,
    "fragment": 1,
    "strength_factor": 1,
}
CRACK_FIELDS = ["opening", "slip", "shear_traction", "normal_traction", "state", "mode", "event"]
START, BEFORE, AFTER, SETTLED, NOT_CONVERGED = range(5)
OUTPUT = "*OUTPUT, FIELD, FREQUENCY=10, EVENTS=1\n*OUTPUT, HISTORY, EVENTS=1\n"
PRINTS = """*NODE PRINT, NSET=LOAD, TOTALS=YES
U, RF
*NODE PRINT, NSET=AT_SUPPORTS, FREQUENCY=10
U
*EL PRINT, ELSET=ROCK, FREQUENCY=10
S, E
"""


class FrameOf:
    """One frame as a reader that knows the layout and nothing of rfem finds it."""

    def __init__(self, file, index):
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        part = int(steps["PartOffsets"][index])
        assert steps["NumberOfParts"][index] == 1
        n_points, n_cells = int(root["NumberOfPoints"][part]), int(root["NumberOfCells"][part])
        first = int(steps["PointOffsets"][index])
        self.value = float(steps["Values"][index])
        self.points = root["Points"][first : first + n_points]
        cell, corner = int(steps["CellOffsets"][index, 0]), int(steps["ConnectivityIdOffsets"][index, 0])
        offsets = root["Offsets"][cell + part : cell + part + n_cells + 1]
        size = int(offsets[1] - offsets[0]) if n_cells else 2
        corners = root["Connectivity"][corner : corner + int(root["NumberOfConnectivityIds"][part])]
        self.cells = corners.reshape(n_cells, size)
        self.point, self.cell = (
            {
                name: root[f"{kind}/{name}"][int(steps[f"{kind}Offsets/{name}"][index]) :][:count]
                for name in root.get(kind, ())
            }
            for kind, count in (("PointData", n_points), ("CellData", n_cells))
        )
        place = int(steps["FieldDataOffsets/frame_kind"][index]) if "FieldDataOffsets" in steps else index
        self.kind = int(root["FieldData/frame_kind"][place])


def frames_of(path):
    with h5py.File(path) as file:
        return [FrameOf(file, i) for i in range(file["VTKHDF/Steps"].attrs["NSteps"])]


class Beam:
    """Mesh and run of the beam, and its frames."""

    def __init__(self, folder):
        ids, self.points, sets = read_mesh(PAPER / "mesh" / "three_point_bending_h8.inp")
        triangles = sets["ROCK"]
        chance = np.random.default_rng(11)
        names = 7 + 3 * chance.permutation(len(ids))
        element_names = 1000 + 2 * chance.permutation(len(triangles))
        order, element_order = chance.permutation(len(ids)), chance.permutation(len(triangles))
        self.node_ids, self.points = names[order], self.points[order]
        self.element_ids, self.corners = element_names[element_order], names[triangles[element_order, 1:] - 1]
        mesh = folder / "shuffled.inp"
        mesh.write_text(
            "*NODE\n"
            + "".join(f"{i}, {x!r}, {y!r}\n" for i, (x, y) in zip(self.node_ids, self.points.tolist()))
            + "*ELEMENT, TYPE=CPS3, ELSET=ROCK\n"
            + "".join(f"{i}, {a}, {b}, {c}\n" for i, (a, b, c) in zip(self.element_ids, self.corners))
        )
        deck = edited(
            BEAM,
            folder,
            ("INPUT=mesh/three_point_bending_h<H>.inp", f"INPUT={mesh}"),
            (OUTPUT, "*OUTPUT, FIELD, EVENTS=1, FORMAT=BOTH\n*OUTPUT, HISTORY, EVENTS=1\n" + PRINTS),
        )
        self.run = run(deck, folder / "results", job="beam")
        self.history, self.events = self.run.history, self.run.events
        self.frames = frames_of(self.run.path(".vtkhdf"))
        self.cracks = frames_of(self.run.path("_cracks.vtkhdf"))


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    return Beam(tmp_path_factory.mktemp("beam"))


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    folder = tmp_path_factory.mktemp("block")
    deck = edited(
        PAPER / "uniaxial_compression.inp",
        folder,
        ("STOP DROP=0.3", "MAX EVENTS=30, STOP DROP=0.3"),
        ("*OUTPUT, FIELD, FREQUENCY=10, EVENTS=5\n", "*OUTPUT, FIELD, EVENTS=1\n"),
    )
    done = run(deck, folder / "results", "--set", "H=5", job="block")
    done.frames, done.cracks = (frames_of(done.path(suffix)) for suffix in (".vtkhdf", "_cracks.vtkhdf"))
    return done


def kinds_of_rows(history):
    """Kind of state of each row of a history that has all of them (EVENTS=1)."""
    time, count = history["time"], history["event_count"]
    kinds = [START]
    for i in range(1, len(time)):
        if count[i] > count[i - 1]:
            kinds.append(AFTER)
        elif i + 1 < len(time) and count[i + 1] > count[i]:
            kinds.append(BEFORE)
        else:
            kinds.append(SETTLED)
    return kinds


def area(points, cells):
    a, b, c = (points[cells[:, k], :2] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


# ------------------------------------------------------------------------------------------------------------- frames
def test_first_frame_lists_the_deck(beam):
    frame = beam.frames[0]
    assert np.array_equal(frame.point["node_id"], beam.node_ids), "the deck's nodes in the deck's order"
    assert np.array_equal(frame.point["node_origin"], beam.node_ids)
    assert np.array_equal(frame.points[:, :2], beam.points) and not frame.points[:, 2].any()
    assert np.array_equal(frame.cell["element_id"], beam.element_ids)
    assert np.array_equal(frame.cell["element_origin"], beam.element_ids)
    listed = frame.point["node_id"][frame.cells]
    for ours, theirs in zip(listed, beam.corners):
        assert set(ours) == set(theirs)
    assert (area(frame.points, frame.cells) > 0).all()
    assert not frame.point["displacement"].any() and not frame.cell["split_level"].any()
    assert set(frame.cell["fragment"]) == {1} and set(frame.cell["material"]) == {1}
    assert np.array_equal(frame.cell["strength_factor"], np.ones(len(frame.cells)))


def test_later_frames_append(beam):
    n, m = len(beam.node_ids), len(beam.element_ids)
    areas = dict(zip(beam.element_ids, area(beam.frames[0].points, beam.frames[0].cells)))
    place = dict(zip(beam.node_ids, beam.points))
    for frame in beam.frames:
        ids, origin = frame.point["node_id"], frame.point["node_origin"]
        assert np.array_equal(ids[:n], beam.node_ids) and np.array_equal(origin[:n], beam.node_ids)
        assert np.array_equal(ids[n:], beam.node_ids.max() + 1 + np.arange(len(ids) - n)), "counted on, in order"
        assert np.array_equal(frame.points[:n, :2], beam.points)
        for i in range(n, len(ids)):
            if origin[i]:
                assert np.array_equal(frame.points[i, :2], place[origin[i]]), "a copy lies on the deck's node"
            else:
                assert np.hypot(*(beam.points - frame.points[i, :2]).T).min() > 1, "a midpoint lies on no deck node"
        cells, source = frame.cell["element_id"], frame.cell["element_origin"]
        assert np.array_equal(cells[:m], beam.element_ids) and np.array_equal(source[:m], beam.element_ids)
        assert np.array_equal(cells[m:], beam.element_ids.max() + 1 + np.arange(len(cells) - m))
        sums = {}
        for element, part in zip(source, area(frame.points, frame.cells)):
            sums[element] = sums.get(element, 0) + part
        assert sums.keys() == areas.keys() and all(np.isclose(sums[k], areas[k], rtol=1e-12) for k in areas)
        count = np.array([np.count_nonzero(source == k) for k in source])
        assert np.array_equal(frame.cell["split_level"] > 0, count > 1), "who has been bisected is of a higher level"
        assert frame.cell["split_level"].max() <= 2
    assert len(beam.frames[-1].points) > n + 5


def test_frames_are_the_history_rows(beam):
    """FREQUENCY=1 and EVENTS=1 for both: a frame for each row, of the same state."""
    kinds = kinds_of_rows(beam.history)
    assert [frame.kind for frame in beam.frames] == kinds
    assert {START, BEFORE, AFTER, SETTLED} == set(kinds)
    assert [len(frame.points) for frame in beam.frames] == beam.history["nodes"].tolist()
    assert [len(frame.cells) for frame in beam.frames] == beam.history["elements"].tolist()
    for i, frame in enumerate(beam.frames):
        same_time = [j for j in range(i) if beam.history["time"][j] == beam.history["time"][i]]
        expected = beam.history["time"][i] * (1 + len(same_time) * 1e-9)
        assert frame.value == pytest.approx(expected, rel=1e-13), "the k-th frame of one time has time x (1 + k 1e-9)"
    assert (np.diff([frame.value for frame in beam.frames]) > 0).all()


@pytest.mark.parametrize("frequency, events", [(1, 0), (5, 0), (5, 2), (1000, 1), (1000, 0)])
def test_frequency(beam, frequency, events, tmp_path):
    """Row 0, every n-th increment, one after each k-th event, and the last state."""
    asked = f"*OUTPUT, FIELD, FREQUENCY={frequency}, EVENTS={events}\n*OUTPUT, HISTORY, EVENTS=1\n"
    done = run(edited(BEAM, tmp_path, (OUTPUT, asked)), tmp_path, "--set", "H=8", job="some")
    history = done.history
    expected = []
    for i, kind in enumerate(kinds_of_rows(history)):
        if kind == AFTER:
            due = events > 0 and history["event_count"][i] % events == 0
        else:
            due = kind == START or history["increment"][i] % frequency == 0
        if due or i == len(history["time"]) - 1:
            expected.append((kind, history["time"][i], history["nodes"][i]))
    found = [(frame.kind, frame.value, len(frame.points)) for frame in frames_of(done.path(".vtkhdf"))]
    assert len(found) == len(expected)
    for one, other in zip(found, expected):
        assert one[0] == other[0] and one[1] == pytest.approx(other[1], rel=1e-7) and one[2] == other[2]


def test_fields_of_the_frames(beam):
    with h5py.File(beam.run.path(".vtkhdf")) as file:
        root = file["VTKHDF"]
        assert list(root.attrs["Version"]) == [2, 0] and root.attrs["Type"] == b"UnstructuredGrid"
        assert root["Points"].dtype == root["Steps/Values"].dtype == np.float64
        for kind, fields in (("PointData", POINT_FIELDS), ("CellData", CELL_FIELDS)):
            assert set(root[kind]) == set(fields)
            for name, components in fields.items():
                assert root[f"{kind}/{name}"].shape[1:] == ((components,) if components > 1 else ())
    for frame, row in zip(beam.frames, range(len(beam.frames))):
        stress, sigma1, sigma3 = (frame.point[name].astype(float) for name in ("stress", "sigma1", "sigma3"))
        mean, half = (stress[:, 0] + stress[:, 1]) / 2, np.hypot((stress[:, 0] - stress[:, 1]) / 2, stress[:, 3])
        size = np.abs(stress).max()
        assert np.allclose(sigma1, -(mean - half), atol=1e-5 * size), "compression positive"
        assert np.allclose(sigma3, -(mean + half), atol=1e-5 * size) and (sigma1 >= sigma3).all()
        assert not stress[:, 2].any() and not stress[:, 4:].any(), "plane stress"
        load = np.isin(frame.point["node_id"], beam.frames[0].point["node_id"][on_load(beam)])
        reaction = frame.point["reaction"].astype(float)
        largest = max(1e-30, np.abs(beam.history["LOAD_rf2"]).max())
        assert reaction[load, 1].sum() == pytest.approx(beam.history["LOAD_rf2"][row], abs=1e-6 * largest)
        assert np.abs(reaction.sum(0)).max() <= 1e-4 * largest, "load and supports are in balance"
        held = np.abs(reaction[:, :2]).max(1) > 1e-9 * largest
        assert held.sum() <= load.sum() + 2, "only supported nodes have reactions"
        assert frame.point["displacement"][load, 1].mean() == pytest.approx(beam.history["LOAD_u2"][row], rel=1e-12)


def on_load(beam):
    return (np.abs(beam.points[:, 0] - 200) <= 10.001) & (np.abs(beam.points[:, 1] - 100) < 1e-6)


def test_utilisation_of_the_frames(beam, block):
    quiet = min_distance(beam.points, [(50, 0), (350, 0)]) <= 15.001
    for frame, largest in zip(beam.frames, beam.history["max_utilisation"]):
        may_fail = np.ones(len(frame.points), bool)
        may_fail[: len(quiet)] = ~quiet
        assert frame.point["utilisation"][may_fail].max() == pytest.approx(largest, rel=1e-5)
    factors = block.frames[0].cell["strength_factor"].astype(float)
    assert 0.01 < factors.std() < 0.03 and abs(factors.mean() - 1) < 0.005, "2 % of scatter"
    by_id = dict(zip(block.frames[0].cell["element_id"], factors))
    last = block.frames[-1].cell
    assert np.array_equal(last["strength_factor"], [by_id[k] for k in last["element_origin"]]), "children inherit"


def min_distance(points, places):
    return np.min([np.hypot(*(points - place).T) for place in places], axis=0)


def test_fragments(block):
    """Fragments are the connected pieces: elements that share a node."""
    frame = block.frames[-1]
    piece = np.arange(len(frame.points))
    while True:
        lowest = piece[frame.cells].min(1)
        new = piece.copy()
        np.minimum.at(new, frame.cells.ravel(), np.repeat(lowest, 3))
        if np.array_equal(new, piece):
            break
        piece = new
    pieces = piece[frame.cells[:, 0]]
    assert len(set(pieces)) == len(set(frame.cell["fragment"])) == block.history["fragments"][-1] > 1
    assert len(set(zip(pieces, frame.cell["fragment"]))) == len(set(pieces))
    assert set(frame.cell["fragment"]) == set(range(1, len(set(pieces)) + 1))


def test_vtk_reads_the_same(beam):
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    for suffix, frames in ((".vtkhdf", beam.frames), ("_cracks.vtkhdf", beam.cracks)):
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(beam.run.path(suffix)))
        reader.UpdateInformation()
        times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        assert list(times) == [frame.value for frame in frames]
        for index, frame in enumerate(frames):
            reader.SetStep(index)
            reader.Update()
            grid = reader.GetOutputDataObject(0)
            assert grid.GetNumberOfPoints() == len(frame.points) and grid.GetNumberOfCells() == len(frame.cells)
            assert grid.GetFieldData().GetArray("frame_kind").GetValue(0) == frame.kind
            if not len(frame.cells):
                continue
            assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), frame.points)
            assert np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()), frame.cells.ravel())
            for data, fields in ((grid.GetPointData(), frame.point), (grid.GetCellData(), frame.cell)):
                assert {data.GetArrayName(i) for i in range(data.GetNumberOfArrays())} == set(fields)
                for name, values in fields.items():
                    assert np.array_equal(vtk_to_numpy(data.GetArray(name)), values), (suffix, index, name)


# ------------------------------------------------------------------------------------------------------------- cracks
def test_cracks_frame_for_frame(beam, block):
    for cracks, frames, history in (
        (beam.cracks, beam.frames, beam.history),
        (block.cracks, block.frames, block.history),
    ):
        assert [frame.value for frame in cracks] == [frame.value for frame in frames]
        assert [frame.kind for frame in cracks] == [frame.kind for frame in frames]
        for crack, row in zip(cracks, range(len(cracks))):
            assert list(crack.cell) == sorted(CRACK_FIELDS) and not crack.point
            if history["event_count"][row] == 0:
                assert len(crack.cells) == 0
                continue
            ends = crack.points[crack.cells]
            length = np.hypot(*(ends[:, 1] - ends[:, 0])[:, :2].T)
            assert length.sum() == pytest.approx(history["crack_length"][row], rel=1e-12)
            assert (crack.cell["opening"] >= 0).all()
            pull = np.abs(crack.cell["normal_traction"]).max()
            assert (crack.cell["normal_traction"] <= 1e-12 * pull).all(), "contact never pulls"
            shear, normal = np.abs(crack.cell["shear_traction"]), -crack.cell["normal_traction"]
            open_ones = crack.cell["state"] == 0
            assert not shear[open_ones].any() and not normal[open_ones].any(), "an open segment bears nothing"
            assert set(crack.cell["state"]) <= {0, 1, 2} and set(crack.cell["mode"]) <= {1, 2}
            assert crack.cell["event"].min() >= 1 and crack.cell["event"].max() <= history["event_count"][row]


def test_cracks_of_the_block_are_in_contact(block):
    last = block.cracks[-1].cell
    assert (last["state"] > 0).any() and (last["normal_traction"] < -1).any(), (
        "a compressed block presses on its cracks"
    )
    assert np.abs(last["slip"]).max() > 0
    modes = dict(zip(block.events["event"], block.events["mode"]))
    for mode, event in zip(last["mode"], last["event"]):
        assert mode == {"tension": 1, "shear": 2}[modes[event]]
    assert set(last["event"]) == set(block.events["event"]), "each event leaves a crack"


def test_cracks_open_in_the_beam(beam):
    last = beam.cracks[-1]
    assert (last.cell["mode"] == 1).all() and last.cell["opening"].max() > 1e-3
    assert set(last.cell["event"]) == set(beam.events["event"])
    mouth = last.points[last.cells][:, :, 1].min(1) == 0
    assert last.cell["opening"][mouth].max() == last.cell["opening"].max(), "widest at the mouth"


# ------------------------------------------------------------------------------------------------------------- tables
def test_history_columns(beam):
    expected = STATE_COLUMNS + [f"LOAD_{c}" for c in ("u1", "u2", "rf1", "rf2")]
    expected += [f"{s}_{c}" for s in ("QUARTER", "MIDSPAN") for c in ("f1", "f2", "m", "error")]
    assert list(beam.history) == expected
    assert list(beam.events) == EVENT_COLUMNS + ["LOAD_rf1", "LOAD_rf2"]


@pytest.mark.parametrize("which", ["beam", "block"])
def test_csv_is_the_h5(which, request):
    done = request.getfixturevalue(which)
    done = getattr(done, "run", done)
    with h5py.File(done.path(".h5")) as file:
        for title, columns in (("history", done.history), ("events", done.events)):
            group = file[f"rfem/{title}"]
            assert set(group) == set(columns)
            for name, values in columns.items():
                stored = group[name][:]
                if values.dtype.kind == "U":
                    stored = np.char.decode(stored)
                assert np.array_equal(stored, values), f"{title}/{name}, to the last digit"
                if values.dtype.kind == "f":
                    assert stored.dtype == np.float64
            for name in ("step", "increment", "event_count", "iterations", "converged", "nodes", "fragments"):
                if title == "history":
                    assert group[name].dtype.kind == "i"


def test_history_rows(beam):
    h = beam.history
    assert (h["step"][0], h["increment"][0], h["time"][0], h["event_count"][0], h["converged"][0]) == (1, 0, 0, 0, 1)
    assert (h["step"] == 1).all() and (np.diff(h["increment"]) >= 0).all() and h["increment"][1] == 1
    assert np.allclose(h["load_factor"], h["time"]), "a step of length 1"
    assert set(h["converged"]) == {1} and (h["residual"] <= 1e-6).all()
    assert (h["LOAD_u2"] == -0.06 * h["load_factor"]).all() or np.allclose(h["LOAD_u2"], -0.06 * h["load_factor"])
    assert np.array_equal(h["event_count"], h["events_tension"] + h["events_shear"])
    assert h["iterations"][1:].sum() > 0 and (h["iterations"] >= 0).all()
    located = [i for i, k in enumerate(kinds_of_rows(h)) if k == BEFORE]
    for i in located:
        on_grid = np.isclose(h["load_factor"][i] * 40, h["increment"][i])
        assert on_grid or 1 <= h["max_utilisation"][i] <= 1.001, "located: 1 <= F <= 1 + OVERSHOOT"
    settled = [i for i, k in enumerate(kinds_of_rows(h)) if k == SETTLED]
    assert (h["max_utilisation"][settled] < 1).all(), "nothing fails any more"


@pytest.mark.parametrize("which", ["beam", "block"])
def test_events_against_frames(which, request):
    done = request.getfixturevalue(which)
    history, events = done.history, done.events
    frames = dict(zip(history["event_count"], done.frames))  # the last frame of each count
    assert events["event"].tolist() == list(range(1, len(events["event"]) + 1))
    assert history["event_count"][-1] == len(events["event"])
    rows = {count: i for i, count in reversed(list(enumerate(history["event_count"])))}  # the first row of each count
    for i, event in enumerate(events["event"]):
        before, after = frames[event - 1], done.frames[rows[event]]
        at = np.flatnonzero(before.point["node_id"] == events["node"][i])[0]
        assert before.points[at, :2].tolist() == [events["x"][i], events["y"][i]]
        assert events["element"][i] in before.cell["element_id"]
        assert len(after.points) - len(before.points) == events["new_nodes"][i]
        assert len(after.cells) - len(before.cells) == events["new_elements"][i]
        for short, name in (("sigma1", "sigma1"), ("sigma3", "sigma3"), ("utilisation", "utilisation")):
            assert events[short][i] == pytest.approx(float(before.point[name][at]), rel=1e-5, abs=1e-4)
        assert after.kind == AFTER and events["time"][i] == history["time"][rows[event]]
        assert events["utilisation"][i] >= 1 and events["sigma1"][i] >= events["sigma3"][i]
        assert -180 < events["direction_deg"][i] <= 180
        assert events["mode"][i] in ("tension", "shear") and events["type"][i] in ("I", "II", "III", "edge")
        row = rows[event] - 1
        for monitor in ("LOAD", "PLATEN"):
            if f"{monitor}_rf2" in events:
                assert events[f"{monitor}_rf2"][i] == history[f"{monitor}_rf2"][row], "the load just before"
        assert events["iterations"][i] == history["iterations"][rows[event]]
    released = history["released_energy"][-1]
    assert events["released_energy"].sum() == pytest.approx(released, rel=1e-9)
    steps = np.diff(history["strain_energy"])[np.diff(history["event_count"]) > 0]
    assert (steps < 0).all(), "at fixed grips no event raises the strain energy"
    if which == "beam":
        assert (events["released_energy"] > 0).all()
    else:  # friction is booked as the traction at the end x slip, which may be more than the event has to give
        assert events["released_energy"].min() > -0.01 * released


def test_later_step_adds_columns_in_every_row(tmp_path):
    """A monitor or section check of any step has its columns in every row; time and step go on."""
    deck = tmp_path / "two.inp"
    deck.write_text(
        "*MESH, SHAPE=RECTANGLE, ELSET=E\n0., 0., 20., 10., 4, 2\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.2\n"
        "*SOLID SECTION, ELSET=E, MATERIAL=M\n*BOUNDARY\nLEFT, 1, 2\n"
        "*STEP\n*STATIC\n0.5, 1.\n*BOUNDARY\nRIGHT, 1, 1, 0.01\n*MONITOR, NAME=A, NSET=RIGHT\n*END STEP\n"
        "*STEP\n*STATIC\n1., 2.\n*BOUNDARY\nRIGHT, 1, 1, 0.03\n*MONITOR, NAME=B, NSET=LEFT\n"
        "*SECTION CHECK, NAME=MID\n10., 0., 1., 0.\n*OUTPUT, HISTORY, FREQUENCY=2\n*END STEP\n"
    )
    done = run(deck, tmp_path / "out")
    h = done.history
    assert list(h) == STATE_COLUMNS + [f"{m}_{c}" for m in "AB" for c in ("u1", "u2", "rf1", "rf2")] + [
        f"MID_{c}" for c in ("f1", "f2", "m", "error")
    ]
    assert h["step"].tolist() == [1, 1, 1, 2] and h["increment"].tolist() == [0, 1, 2, 2]
    assert h["time"].tolist() == [0, 0.5, 1, 3] and h["load_factor"].tolist() == [0, 0.5, 1, 1]
    assert np.allclose(h["A_u1"], [0, 0.005, 0.01, 0.03]) and np.allclose(h["A_rf1"], -h["B_rf1"], rtol=1e-4)
    assert np.allclose(h["MID_f1"], -h["A_rf1"], rtol=1e-4), (
        "force of the other side on the side that the normal points to"
    )
    with h5py.File(done.path(".vtkhdf")) as file:
        assert "utilisation" not in file["VTKHDF/PointData"], "no step looks at the criterion: no such field"
        assert "velocity" not in file["VTKHDF/PointData"]
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 5


def test_step_that_ends_early_writes_its_last_state(tmp_path):
    """MAX EVENTS ends the first step between two frames that are due; the second goes on from there."""
    steps = """*OUTPUT, FIELD, FREQUENCY=1000
*OUTPUT, HISTORY, FREQUENCY=1000
*END STEP
*STEP
*STATIC
1., 1.
*FRACTURE, SPLITTING=NONE
*BOUNDARY
LOAD, 2, 2, 0.
*END STEP
"""
    deck = edited(BEAM, tmp_path, ("STOP DROP=0.8", "MAX EVENTS=2, STOP DROP=0.8"), (OUTPUT + "*END STEP\n", steps))
    done = run(deck, tmp_path / "out", "--set", "H=8", job="early")
    h = done.history
    assert h["step"].tolist() == [1, 1, 2] and h["event_count"].tolist() == [0, 2, 2]
    assert 0.6 < h["load_factor"][1] < 0.7 and h["time"][2] == pytest.approx(h["time"][1] + 1)
    assert [frame.kind for frame in frames_of(done.path(".vtkhdf"))] == [START, SETTLED, SETTLED]
    assert abs(h["LOAD_rf2"][2]) < 1e-3 * abs(h["LOAD_rf2"][1]), "unloaded"


# ------------------------------------------------------------------------------------------------- JOB.dat and JOB.mac
TITLE = re.compile(r"^ (.*) for set (\S+) and time  (\d\.\d{7}E[+-]\d\d)$")
TITLES = {
    "displacements (vx,vy,vz)": 3,
    "forces (fx,fy,fz)": 3,
    "total force (fx,fy,fz)": 3,
    "stresses (elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz)": 6,
    "strains (elem, integ.pnt.,exx,eyy,ezz,exy,exz,eyz)": 6,
}


def read_dat(path):
    """Tables of a .dat file in CalculiX's layout: (title, set, time, rows)."""
    tables = []
    lines = path.read_text().splitlines()
    i = 0
    while i < len(lines):
        if not lines[i]:
            i += 1
            continue
        found = TITLE.match(lines[i])
        assert found and lines[i + 1] == "", f"a header and a blank line: {lines[i]!r}"
        title, name, time = found.groups()
        rows = []
        i += 2
        while i < len(lines) and lines[i]:
            words = lines[i].split()
            width = 10 if "elem" not in title else 14
            width = 0 if title.startswith("total") else width
            assert len(lines[i]) == (width or 6) + 14 * TITLES[title], "columns of fixed width"
            rows.append([float(word) for word in words])
            i += 1
        tables.append((title, name, float(time), np.array(rows)))
    return tables


def test_dat_is_the_frame(beam):
    tables = read_dat(beam.run.path(".dat"))
    assert {table[0] for table in tables} == set(TITLES)
    own_load = [i for i, k in enumerate(kinds_of_rows(beam.history)) if k == SETTLED]
    own_load = [i for i in own_load if np.isclose(40 * beam.history["time"][i], beam.history["increment"][i])]
    times = [time for title, name, time, _ in tables if title.startswith("disp") and name == "LOAD"]
    assert times == pytest.approx([beam.history["time"][i] for i in own_load], rel=1e-7), (
        "each increment at its own load"
    )
    for title, name, time, rows in tables:
        row = next(i for i in own_load if np.isclose(beam.history["time"][i], time, rtol=1e-7))
        frame = beam.frames[row]
        if name == "AT_SUPPORTS" or "elem" in title:
            last = row == own_load[-1]
            assert beam.history["increment"][row] % 10 == 0 or last, "FREQUENCY=10"
        if title.startswith("total"):
            assert rows[0] == pytest.approx([0, beam.history["LOAD_rf2"][row], 0], rel=1e-6, abs=1e-6)
        elif "elem" in title:
            assert np.array_equal(rows[:, 0], frame.cell["element_id"]) and (rows[:, 1] == 1).all(), "deck order"
            if title.startswith("stresses"):
                stress = frame.cell["stress"][:, [0, 1, 2, 3, 5, 4]]
                assert np.allclose(rows[:, 2:], stress, rtol=1e-6, atol=1e-6 * np.abs(stress).max())
                sxx, syy, exx = rows[:, 2], rows[:, 3], None
            else:
                exx = rows[:, 2]
                assert np.allclose(exx, (sxx - 0.25 * syy) / 27400, rtol=1e-4, atol=1e-5 * np.abs(exx).max())
        else:
            index = {k: i for i, k in enumerate(frame.point["node_id"])}
            places = [index[int(k)] for k in rows[:, 0]]
            assert places == sorted(places), "deck order"
            field = frame.point["displacement" if title.startswith("disp") else "reaction"][places]
            assert np.allclose(rows[:, 1:], field, rtol=1e-6, atol=1e-6 * np.abs(field).max())


def test_mac_is_the_frame(beam):
    """A few frames: before, at and after the events."""
    some = [0, 5, *[i for i, frame in enumerate(beam.frames) if frame.kind == AFTER], len(beam.frames) - 1]
    for index in some:
        model, frame, crack = read_apdl.read(beam.run.path(".mac"), index + 1), beam.frames[index], beam.cracks[index]
        ids = frame.point["node_id"]
        assert list(model.nodes) == ids.tolist()
        assert np.array_equal(list(model.nodes.values()), frame.points[:, :2])
        triangles = model.triangles()
        assert list(triangles) == frame.cell["element_id"].tolist()
        assert np.array_equal(list(triangles.values()), ids[frame.cells])
        assert np.array_equal(list(model.displacement.values()), frame.point["displacement"][:, :2])
        stress = np.array(list(model.stress.values()))
        assert np.allclose(stress, frame.cell["stress"], rtol=1e-6, atol=1e-6 * np.abs(stress).max())
        interfaces = model.interfaces("CRACK_TENSION")
        assert len(interfaces) == len(crack.cells) and not model.interfaces("CRACK_SHEAR")
        for (first, second), ends in zip(interfaces, crack.points[crack.cells]):
            for side in (first, second):
                places = {model.nodes[k] for k in side}
                assert places == {tuple(end[:2]) for end in ends.tolist()}, "both sides lie on the segment"
    last = read_apdl.read(beam.run.path(".mac"))
    assert len(last.nodes) == len(beam.frames[-1].points), "without a number the last frame"


# --------------------------------------------------------------------------------------------------------- provenance
def test_provenance(beam):
    with h5py.File(beam.run.path(".h5")) as file:
        rfem = file["rfem"]
        deck = rfem["deck"][()].decode()
        assert deck.startswith("*HEADING\nThree-point bending") and "*STRENGTH, CRITERION=GRIFFITH" in deck
        assert f"{beam.element_ids[-1]}, " in deck, "with included files"
        text = {name: value.decode() for name, value in rfem.attrs.items() if isinstance(value, bytes)}
        assert text["version"] in beam.run.log.splitlines()[0] and text["commit"] in beam.run.log.splitlines()[0]
        assert text["compiler"] and "-O" in text["flags"] and text["host"] and text["deck_name"].endswith(".inp")
        assert re.match(r"\d{4}-\d\d-\d\dT?.*\d\d:\d\d:\d\d", text["start_time"])
        assert rfem.attrs["threads"] == 1 and rfem.attrs["wall_time"] > 0 and rfem.attrs["exit_status"] == 0
        assert (text["digest_displacements"], text["digest_topology"]) == beam.run.digests
        names, values, origins = (rfem[f"settings/{name}"][:].astype(str) for name in ("name", "value", "origin"))
        assert len(names) == len(values) == len(origins) > 50
        settings = dict(zip(names, zip(values, origins)))
        drop = next(value for name, value in settings.items() if name.endswith("STOP DROP"))
        assert float(drop[0]) == 0.8 and re.search(r"\.inp:\d+$", drop[1])
        overshoot = next(value for name, value in settings.items() if name.endswith("OVERSHOOT"))
        assert float(overshoot[0]) == 0.001 and overshoot[1] == "default"


def test_provenance_of_a_failed_run(tmp_path):
    deck = edited(BEAM, tmp_path, ("*FRACTURE,", "*RELAXATION, MAX ITERATIONS=10\n*FRACTURE,"))
    done = run(deck, tmp_path / "out", "--set", "H=8", status=1)
    with h5py.File(done.path(".h5")) as file:
        assert file["rfem"].attrs["exit_status"] == 1

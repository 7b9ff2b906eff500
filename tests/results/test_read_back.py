"""Result files of the program write_samples are read back by h5py, by VTK and as text, and hold what was put in.

Also: a writer that is killed leaves every finished frame readable, and one that finds the disk full says so and
leaves nothing behind.
"""

import csv
import os
import random
import resource
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import read_apdl

HERE = Path(__file__).parent
PROGRAM = os.environ.get("RFEM_WRITE_SAMPLES") or str(
    Path(os.environ.get("RFEM_BUILD_DIR", "build")) / "tests" / "results" / "write_samples"
)
TIMES = [0, np.finfo(np.float32).tiny, 1, 1 + 1e-9, 1 + 2e-9, 2]
POINTS = [8, 8, 8, 1402, 1402, 1402]
CELLS = [6, 6, 6, 1400, 1400, 1400]
SEGMENTS = [0, 0, 0, 1, 1, 3]
KILLS = int(os.environ.get("RFEM_KILLS", "8"))


def known(frame, component, position):
    return frame + 0.1 * component + 1.0e-3 * position + 1.0e-10 / 3.0


def expected(frame, components, n):
    """(n, components) array of known values; components from 1."""
    return np.array([[known(frame, k, i) for k in range(1, components + 1)] for i in range(1, n + 1)])


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    folder = tmp_path_factory.mktemp("samples")
    subprocess.run([PROGRAM, "samples", folder], check=True)
    return folder


def frame_of(file, kind, name, frame):
    """The values of a field in a frame, as a reader of VTKHDF finds them."""
    steps = file["VTKHDF/Steps"]
    count = file["VTKHDF/NumberOfPoints" if kind == "PointData" else "VTKHDF/NumberOfCells"][
        steps["PartOffsets"][frame]
    ]
    start = steps[f"{kind}Offsets/{name}"][frame]
    return file[f"VTKHDF/{kind}/{name}"][start : start + count]


def test_h5py_reads_the_frames(samples):
    with h5py.File(samples / "sample.vtkhdf") as file:
        assert list(file["VTKHDF"].attrs["Version"]) == [2, 0]
        kind = file["VTKHDF"].attrs.get_id("Type")
        assert kind.dtype.itemsize == 16 and kind.shape == () and file["VTKHDF"].attrs["Type"] == b"UnstructuredGrid"
        steps = file["VTKHDF/Steps"]
        assert steps.attrs["NSteps"] == 6
        assert steps["Values"][:].tolist() == TIMES
        assert file["VTKHDF/NumberOfPoints"][:].tolist() == [8, 1402], "a geometry is stored once while it is the same"
        assert file["VTKHDF/Points"].dtype == np.float64 and file["VTKHDF/PointData/displacement"].dtype == np.float64
        assert (
            file["VTKHDF/PointData/stress"].dtype == np.float32 and file["VTKHDF/CellData/element_id"].dtype == np.int32
        )
        for frame in range(6):
            u = frame_of(file, "PointData", "displacement", frame)
            assert np.array_equal(u[:, :2], expected(frame, 2, POINTS[frame])) and not u[:, 2].any()
            stress = frame_of(file, "CellData", "stress", frame)
            assert np.array_equal(stress, expected(frame, 6, CELLS[frame]).astype(np.float32))
            ids = frame_of(file, "CellData", "element_id", frame)
            assert np.array_equal(ids, 100 * np.arange(1, CELLS[frame] + 1)), "ids stay while the geometry does"
        assert len(file["VTKHDF/CellData/element_id"]) == CELLS[0] + CELLS[3], "and are not stored again"


def vtk_frames(path):
    """Times and for each frame points, cells (type, points), arrays by name, frame kind, as VTK's reader gives them."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    frames = []
    for step in range(reader.GetNumberOfSteps()):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        assert grid.IsA("vtkUnstructuredGrid")
        arrays = {
            f"{where}/{data.GetArrayName(i)}": vtk_to_numpy(data.GetArray(i)).copy()
            for where, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData()))
            for i in range(data.GetNumberOfArrays())
        }
        kind = grid.GetFieldData().GetArray("frame_kind").GetValue(0)
        cells = [
            (grid.GetCellType(i), [grid.GetCell(i).GetPointId(j) for j in range(grid.GetCell(i).GetNumberOfPoints())])
            for i in range(grid.GetNumberOfCells())
        ]
        points = [grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())]
        frames.append((points, cells, arrays, kind))
    return times, frames


def test_vtk_reads_the_frames(samples):
    times, frames = vtk_frames(samples / "sample.vtkhdf")
    assert list(times) == TIMES
    for frame, (points, cells, arrays, kind) in enumerate(frames):
        assert len(points) == POINTS[frame] and len(cells) == CELLS[frame] and kind == frame % 5
        assert points[3] == (0.1, 1 / 3, 0)
        assert cells[0] == (5, [0, 2, 3]) and cells[-1] == (
            5,
            [POINTS[frame] - 4, POINTS[frame] - 1, POINTS[frame] - 3],
        )
        assert set(arrays) == {
            "point/displacement",
            "point/stress",
            "point/sigma1",
            "point/node_id",
            "cell/stress",
            "cell/strength_factor",
            "cell/element_id",
        }
        assert np.array_equal(arrays["point/displacement"][:, :2], expected(frame, 2, POINTS[frame]))
        assert np.array_equal(arrays["point/stress"], expected(frame, 6, POINTS[frame]).astype(np.float32))
        assert np.array_equal(
            arrays["cell/strength_factor"], known(frame, 8, np.arange(1, CELLS[frame] + 1)).astype(np.float32)
        )
        assert np.array_equal(arrays["point/node_id"], 10 * np.arange(1, POINTS[frame] + 1))


def test_vtk_reads_cracks_that_begin_with_none(samples):
    times, frames = vtk_frames(samples / "sample_cracks.vtkhdf")
    assert list(times) == list(range(6))
    for frame, (points, cells, arrays, _) in enumerate(frames):
        n = SEGMENTS[frame]
        assert len(points) == 2 * n and cells == [(3, [2 * i, 2 * i + 1]) for i in range(n)]
        assert set(arrays) == {"point/displacement", "cell/opening", "cell/mode"}
        assert np.array_equal(arrays["cell/opening"], known(frame, 1, np.arange(1, n + 1)))


def test_tables_are_the_same_in_both_files(samples):
    with h5py.File(samples / "sample.h5") as file, open(samples / "sample_history.csv", newline="") as text:
        rows = list(csv.DictReader(text))
        history = file["rfem/history"]
        assert list(rows[0]) == ["step", "time", 'P, "left"'] and set(history) == set(rows[0])
        assert len(rows) == 600
        for name in history:
            assert np.array_equal([float(row[name]) for row in rows], history[name][:]), "to the last digit"
        assert history["step"].dtype.kind == "i" and [row["step"] for row in rows[:2]] == ["1", "2"]
        assert np.array_equal(history["time"][:], np.arange(1, 601) / 3)
        assert max(len(row["time"]) for row in rows) <= 18 and rows[2]["time"] == "1"
        events = file["rfem/events"]
        assert events["mode"][:].tolist() == [b"tension", b"shear"] and events["type"][:].tolist() == [b"edge", b"III"]
    assert (samples / "sample_events.csv").read_text() == "event,mode,type\n1,tension,edge\n2,shear,III\n"


def test_provenance(samples):
    with h5py.File(samples / "sample.h5") as file:
        rfem = file["rfem"]
        assert rfem["deck"][()].decode() == "*HEADING, Grüße\n" * 20000
        assert rfem["setting_names"][:].tolist() == [b"TOLERANCE", b"JOB"]
        assert rfem["numbers"][:].tolist() == [0.1, 1e300] and rfem["counts"][:].tolist() == [1, -2, 3]
        assert rfem.attrs["threads"] == 2 and rfem.attrs["wall_time"] == 12.5 and rfem.attrs["exit_status"] == 0
        assert rfem.attrs["version"] == b"0.1.1-replaced" and rfem.attrs["empty"] == b" "


def test_dat_is_laid_out_as_ccx_does(samples):
    """The reference's lines were compared with those of ccx 2.20 for the same values."""
    assert (samples / "sample.dat").read_text() == (HERE / "dat_reference.dat").read_text()


@pytest.mark.parametrize("asked, frame", [(1, 1), (2, 2), (3, 3), (0, 3), (99, 3)])
def test_apdl_shows_each_frame(samples, asked, frame):
    model = read_apdl.read(samples / "sample.mac", asked)
    squares = 2 if frame < 3 else 4
    assert model.title == f"frame {frame}, time {0.5 * frame:g}"
    assert list(model.nodes) == [10 * i for i in range(1, 2 * squares + 3)]
    assert model.nodes[20] == (0, 1 / 3) and model.nodes[30] == (0.1, 0)
    triangles = model.triangles()
    assert list(triangles) == [100 * i for i in range(1, 2 * squares + 1)]
    assert triangles[100] == [10, 30, 40] and triangles[200] == [10, 40, 20]
    assert [model.elements[k][:2] for k in (100, 200, 300)] == [(2, 2), (1, 1), (1, 2)]
    assert model.types[1] == ("PLANE182", ["", "", "2"]) and model.types[2] == ("PLANE182", ["", "", "0"])
    assert np.array_equal(list(model.displacement.values()), expected(frame, 2, len(model.nodes)))
    assert np.array_equal(list(model.stress.values()), -expected(frame, 6, len(triangles)))
    if frame < 3:
        assert not model.components
    else:
        assert model.interfaces("CRACK_TENSION") == [([10, 20], [30, 40]), ([70, 80], [90, 100])]
        assert model.interfaces("CRACK_EXISTING") == [([30, 40], [50, 40])]
        assert model.interfaces("CRACK_SHEAR") == [([50, 60], [70, 80])]


def test_killed_writer_leaves_every_finished_frame(tmp_path):
    path = tmp_path / "killed.vtkhdf"
    chance = random.Random(20)
    for _ in range(KILLS):
        writer = subprocess.Popen([PROGRAM, "endless", path], stdout=subprocess.PIPE, text=True)
        writer.stdout.readline()
        time.sleep(0.3 * chance.random())
        writer.kill()
        told = int((["1"] + writer.stdout.read().split())[-1])
        writer.wait()
        with h5py.File(path, "r", swmr=True) as file:
            # number and list of frames change in one flush, which is some writes: a kill between them leaves one
            # of them a frame ahead (`./run recover` sets that right); what was finished is there by both
            values = file["VTKHDF/Steps/Values"][:].tolist()
            frames = min(int(file["VTKHDF/Steps"].attrs["NSteps"]), len(values))
            assert frames in (told, told + 1)
            assert values[:frames] == list(range(frames))
            for frame in range(frames):
                u = frame_of(file, "PointData", "displacement", frame)
                n = 2 * (500 + 7 * (frame - frame % 3)) + 2
                position = 1 + np.arange(2 * n).reshape(n, 2)
                assert np.allclose(u[:, :2], known(frame, 1, position), rtol=0, atol=1e-12)
                stress = frame_of(file, "CellData", "stress", frame)
                assert np.allclose(stress.ravel(), known(frame, 2, 1 + np.arange(stress.size)), rtol=1e-6)


def test_file_size_limit_is_an_error_and_leaves_nothing(tmp_path):
    """A limit on the size of files fails writes as a full disk does, and needs no special rights."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    for kind in ("vtkhdf", "h5", "csv", "dat", "mac"):
        done = subprocess.run(
            [PROGRAM, "fill", kind, tmp_path / f"f.{kind}", "1000000"],
            preexec_fn=limit,
            timeout=300,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 3 and done.stderr == "", done.stderr
        first, *rest = done.stdout.splitlines()
        assert first.startswith(str(tmp_path)) and first.endswith(": File too large"), done.stdout
        assert rest in ([], ["1 HDF5 objects left open"]), "HDF5 keeps the file it can nowhere write, to no harm"
        assert not list(tmp_path.iterdir()), "no half file"


@pytest.fixture
def small_disk(tmp_path):
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", tmp_path], capture_output=True)
    if made.returncode:
        pytest.skip("mounting a small disk needs root")
    yield tmp_path
    subprocess.run(["umount", tmp_path], check=True)


def test_full_disk_is_an_error_and_leaves_nothing(small_disk):
    for kind in ("vtkhdf", "h5", "csv", "dat", "mac"):
        done = subprocess.run(
            [PROGRAM, "fill", kind, small_disk / f"f.{kind}", "1000000"], timeout=300, capture_output=True, text=True
        )
        assert done.returncode == 3 and done.stderr == "", done.stderr
        assert done.stdout.endswith(": No space left on device\n") and len(done.stdout.splitlines()) == 1
        assert not list(small_disk.iterdir()), "no half file"


def test_full_disk_keeps_the_finished_frames_if_closed(small_disk):
    path = small_disk / "kept.vtkhdf"
    done = subprocess.run([PROGRAM, "keep", path, "1000000"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 3 and "No space left on device" in done.stdout and done.stderr == ""
    frames = int(done.stdout.split("\n")[0].split()[-1])
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == frames and frames > 3
        assert file["VTKHDF/Steps/Values"][:].tolist() == list(range(frames))


@pytest.mark.parametrize(
    "path, reason", [("missing/f", "No such file or directory"), (".", "Is a directory"), ("file/f", "Not a directory")]
)
def test_places_that_cannot_be_written(tmp_path, path, reason):
    (tmp_path / "file").write_text("")
    for kind in ("vtkhdf", "h5", "csv", "dat", "mac"):
        done = subprocess.run([PROGRAM, "fill", kind, tmp_path / path, "3"], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (3, "")
        assert done.stdout == f"{tmp_path / path}: cannot create this file: {reason}\n"

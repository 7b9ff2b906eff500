"""Result files that are cut off, damaged or missing: every tool ends in seconds, with a status and a reason."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import h5py
import pytest
import rfem_recover
from rfem_results import open_results
from rfem_run import BEAM, PROGRAM, SOURCE, edited, run

EDITS = [("FIELD, FREQUENCY=10", "FIELD, FREQUENCY=1")]
FILES = ("j.h5", "j.vtkhdf", "j_cracks.vtkhdf")
CUTS = ("0", "100", "1000", "half", "all but one")
# all tools in one process, one after the other: what each says and how it ends
DRIVER = """
import contextlib, io, json, sys
import rfem_collect, rfem_compare, rfem_plot, rfem_recover
told = {}
for name, tool, arguments in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = sys.modules[tool].main(arguments)
        except SystemExit as left:
            status = left.code
    told[name] = status, out.getvalue(), err.getvalue()
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that has ended, with 40 frames."""
    folder = tmp_path_factory.mktemp("whole")
    return run(edited(BEAM, folder / "deck", *EDITS), folder / "out", "--set", "H=8", job="j").folder


@pytest.fixture
def copy(whole, tmp_path):
    shutil.copytree(whole, tmp_path / "copy")
    return tmp_path / "copy"


def cut(path, size):
    now = path.stat().st_size
    os.truncate(path, {"half": now // 2, "all but one": now - 1}.get(size) or int(size if size.isdigit() else 0))


def tools(calls):
    """Run tools in a process that a hang does not outlive."""
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, json.dumps(calls)],
        capture_output=True, text=True, timeout=60, check=False,
        env={**os.environ, "PYTHONPATH": str(SOURCE / "postproc")},
    )  # fmt: skip
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("size", CUTS)
@pytest.mark.parametrize("name", FILES)
def test_every_tool_ends_at_a_file_that_is_cut_off(name, size, whole, copy, tmp_path):
    cut(copy / name, size)
    job = str(copy / "j")
    told = tools(
        [
            ("plot", "rfem_plot", [job, "--frame", "-1", "--field", "opening", "--output", str(tmp_path / "pictures")]),
            ("curve", "rfem_plot", [job, "--history", "time", "cracks", "--output", str(tmp_path / "pictures")]),
            ("collect", "rfem_collect", [str(copy)]),
            ("compare", "rfem_compare", [str(whole / "j"), job]),
            ("recover", "rfem_recover", [job]),
            ("again", "rfem_recover", [job]),
        ]
    )
    for tool, (status, out, err) in told.items():
        assert status in (0, 1, 2), (tool, out, err)
        assert "Traceback" not in out + err
        concerned = name == "j.h5" or tool in ("plot", "recover")
        if concerned and tool != "again" and (tool, status) != ("recover", 0):
            assert name in err, (tool, err)
    assert told["curve"][0] == 0, "JOB_history.csv has the rows"
    assert told["plot"][0] == (0 if name == "j.h5" else 2)
    status, out, err = told["recover"]
    if size in ("0", "50", "100"):
        assert status == 1 and (copy / name).stat().st_size == int(size), "what is lost stays as it is"
    assert status == 1 if f"error: {copy / name}" in err else f"repaired {name}: " in out, (out, err)
    assert told["again"][0] == status and "repaired" not in told["again"][1], "what is repaired stays as it is"
    assert not list(copy.glob("*.recover"))


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """What a run leaves that was killed after some frames."""
    folder = tmp_path_factory.mktemp("killed")
    deck = edited(BEAM, folder / "deck", *EDITS)
    process = subprocess.Popen(
        [PROGRAM, deck, "--set", "H=4", "--job", "j", "--output", folder / "out", "--quiet"],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    for _ in range(1000):
        history = folder / "out" / "j_history.csv"
        if history.exists() and history.read_text().count("\n") > 12 or process.poll() is not None:
            break
        time.sleep(0.01)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    return folder / "out"


@pytest.mark.parametrize("size", ("1000", "half"))
@pytest.mark.parametrize("name", FILES)
def test_files_of_a_killed_run_that_are_cut_off(name, size, killed, tmp_path):
    """They bear the mark of a file that is being written: HDF5 reads again what does not fit together."""
    shutil.copytree(killed, tmp_path / "copy")
    cut(tmp_path / "copy" / name, size)
    job = str(tmp_path / "copy" / "j")
    told = tools(
        [
            ("plot", "rfem_plot", [job, "--frame", "-1", "--field", "utilisation", "--output", str(tmp_path)]),
            ("collect", "rfem_collect", [str(tmp_path / "copy")]),
            ("compare", "rfem_compare", [job, job]),
            ("recover", "rfem_recover", [job]),
            ("again", "rfem_recover", [job]),
        ]
    )
    status, out, err = told["recover"]
    assert status in (0, 1) and (status == 1) == (name in err), (out, err)
    assert told["again"][0] == status and "repaired" not in told["again"][1]
    if status == 0:
        with open_results(job) as found:
            for frame in found.frames:
                assert frame.points.any() and len(frame.point_data["stress"]) == len(frame.points)


@pytest.mark.parametrize("missing", [50_000, 10_000, 1])
def test_frames_of_a_file_that_was_cut_off_are_saved(missing, whole, copy):
    """All that the repaired files have is what the whole run wrote."""
    path = copy / "j.vtkhdf"
    os.truncate(path, path.stat().st_size - missing)
    report = rfem_recover.recover(copy / "j")
    assert not report.lost and "j.vtkhdf: " in report.repaired[0], report
    with open_results(copy / "j") as found, open_results(whole / "j") as expected:
        count = len(expected.frames)
        assert 0 < len(found.frames) <= count == len(found.cracks) and not found.unfinished
        if len(found.frames) < count:
            assert f"of {count} cannot be read" in report.repaired[0]
        by_time = {value: number for number, value in enumerate(expected.frames.values)}
        for number, value in enumerate(found.frames.values):
            assert found.cracks.values[number] == value, "the cracks go with the frames as before"
            for files in ("frames", "cracks"):
                one, other = getattr(found, files)[number], getattr(expected, files)[by_time[value]]
                assert one.kind == other.kind and (one.points == other.points).all()
                assert one.cells.shape == other.cells.shape and (one.cells == other.cells).all()
                for data in ("point_data", "cell_data"):
                    for field, values in getattr(other, data).items():
                        assert (getattr(one, data)[field] == values).all(), field


def test_the_other_file_stays_whole(whole, copy):
    """The file of the cracks is cut off: no frame of the mesh is thrown away for that."""
    path = copy / "j_cracks.vtkhdf"
    os.truncate(path, path.stat().st_size - 1)
    report = rfem_recover.recover(copy / "j")
    assert "j.vtkhdf" in report.sound and "j_cracks.vtkhdf: " in report.repaired[0], report
    assert (copy / "j.vtkhdf").read_bytes() == (whole / "j.vtkhdf").read_bytes()


def test_rows_of_a_table_that_was_cut_off_are_saved(whole, copy):
    path = copy / "j.h5"
    os.truncate(path, path.stat().st_size - 1)
    report = rfem_recover.recover(copy / "j")
    assert not report.lost and "j.h5: " in report.repaired[0]
    with h5py.File(path) as file, h5py.File(whole / "j.h5") as expected:
        assert b"the file was cut off" in file["rfem"].attrs["recovered"]
        for name, column in file["rfem/history"].items():
            assert len(column) and (column[:] == expected[f"rfem/history/{name}"][: len(column)]).all()


def test_frames_that_are_damaged_are_named(copy, capsys):
    """The stresses of two frames are overwritten: the file opens, these frames cannot be read."""
    path = copy / "j.vtkhdf"
    with h5py.File(path) as file:
        steps = file["VTKHDF/Steps"]
        stress = file["VTKHDF/PointData/stress"]
        first = [int(row) for row in steps["PointDataOffsets/stress"][:]]
        chunks = [stress.id.get_chunk_info_by_coord((row - row % stress.chunks[0], 0)) for row in (first[3], first[5])]
    before = path.read_bytes()
    with path.open("r+b") as file:
        for chunk in chunks:
            file.seek(chunk.byte_offset + chunk.size // 2)
            file.write(os.urandom(64))
    damaged = path.read_bytes()
    assert damaged != before
    assert rfem_recover.main([str(copy / "j")]) == 1
    printed = capsys.readouterr()
    assert "frames 3, 5 of " in printed.err and "PointData/stress" in printed.err, printed.err
    assert "sound    j_cracks.vtkhdf" in printed.out and "sound    j.vtkhdf" not in printed.out
    assert path.read_bytes() == damaged, "it stays as it is"
    told = tools([("plot", "rfem_plot", [str(path), "--frame", "3", "--field", "stress_xx", "--output", str(copy)])])
    assert told["plot"][0] == 2 and "stress of frame 3 cannot be read, the file is damaged" in told["plot"][2]


@pytest.mark.parametrize("ending", ["_cracks.vtkhdf", ".vtkhdf", ".h5", "_history.csv", "_events.csv"])
def test_a_file_that_is_missing_is_named(ending, copy, capsys):
    (copy / f"j{ending}").unlink()
    assert rfem_recover.main([str(copy / "j")]) == 1
    assert f"j{ending} is missing" in capsys.readouterr().err


def test_several_jobs_and_folders(whole, copy, capsys):
    shutil.copytree(whole, copy / "more")
    for path in (copy / "more").iterdir():
        shutil.copy(path, path.with_name("k" + path.name[1:]))
    assert rfem_recover.main([str(copy / "j"), str(copy / "more")]) == 0
    out = capsys.readouterr().out
    assert out.count("sound    j.h5") == 2 and out.count("sound    k.h5") == 1
    assert rfem_recover.main([str(copy / "nothing"), str(copy / "j")]) == 2
    assert "sound    j.h5" in capsys.readouterr().out, "an error does not keep the others waiting"


@pytest.mark.parametrize("tool", ["plot", "compare", "collect", "recover"])
def test_a_missing_package_is_one_line(tool, tmp_path):
    (tmp_path / "h5py.py").write_text("raise ModuleNotFoundError(\"No module named 'h5py'\", name='h5py')\n")
    done = subprocess.run(
        [sys.executable, SOURCE / "postproc" / f"rfem_{tool}.py", "x"],
        env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"rfem_{tool}: error: Python has no module h5py; install what is needed with ")
    assert "RFEM_PYTHON" in done.stderr and "postproc/requirements.txt" in done.stderr

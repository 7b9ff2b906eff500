"""kill -9 at random times: finished frames and rows can be read, and rfem_recover.py makes ordinary files of them.

RFEM_KILLS is the number of trials (default 8).
"""

import os
import random
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
import rfem_recover
from rfem_results import ResultsError, open_results
from rfem_run import BEAM, PROGRAM, edited, run

TRIALS = int(os.environ.get("RFEM_KILLS", 8))
EDITS = [("FIELD, FREQUENCY=10", "FIELD, FREQUENCY=1"), ("*END STEP", "*NODE PRINT, NSET=LOAD\nU, RF\n*END STEP")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run that nobody kills, its deck, and how long it takes."""
    folder = tmp_path_factory.mktemp("whole")
    deck = edited(BEAM, folder / "deck", *EDITS)
    start = time.monotonic()
    done = run(deck, folder / "out", "--set", "H=8", job="beam")
    return done, deck, time.monotonic() - start


def killed(deck, folder, wait):
    """Start the run, kill it after a while; whether it was still going."""
    process = subprocess.Popen(
        [PROGRAM, deck, "--set", "H=8", "--job", "beam", "--output", folder, "--quiet"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    time.sleep(wait)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


def frames_of(folder):
    """Frames that can be read before a repair: of the mesh, of the cracks; 0 where there are none."""
    with open_results(folder / "beam") as results:
        counts = []
        for name in ("frames", "cracks"):
            try:
                counts.append(len(getattr(results, name) or ()))
            except ResultsError:
                counts.append(0)
        return counts


def same_frames(folder, whole, count):
    """The first frames of a killed run are those of the whole one, to the last bit."""
    with open_results(folder / "beam") as found, open_results(whole.folder / "beam") as expected:
        assert len(found.frames) == count and not found.unfinished
        for number in {0, count // 2, count - 1}:
            one, other = found.frames[number], expected.frames[number]
            assert one.time == other.time and one.kind == other.kind
            assert np.array_equal(one.points, other.points) and np.array_equal(one.cells, other.cells)
            for field in other.point_data:
                assert np.array_equal(one.point_data[field], other.point_data[field]), field
            for field in other.cell_data:
                assert np.array_equal(one.cell_data[field], other.cell_data[field]), field


def same_rows(folder, whole, closed):
    """Rows of CSV and HDF5 are the first rows of the whole run's, and every line has an end. `closed`: JOB.h5 was."""
    for table in ("_history.csv", "_events.csv"):
        text = (folder / f"beam{table}").read_text()
        assert text.endswith("\n") or not text
        assert whole.path(table).read_text().startswith(text)
    with h5py.File(folder / "beam.h5") as found, h5py.File(whole.path(".h5")) as expected:
        if not closed:
            assert "exit_status" not in found["rfem"].attrs and b"did not end" in found["rfem"].attrs["recovered"]
        assert np.array_equal(found["rfem/settings/value"][:], expected["rfem/settings/value"][:])
        for title in ("history", "events"):
            lengths = {column.shape[0] for column in found[f"rfem/{title}"].values()}
            assert len(lengths) <= 1, "all columns are of one length"
            for name, column in found[f"rfem/{title}"].items():
                assert np.array_equal(column[:], expected[f"rfem/{title}/{name}"][: len(column)]), name


@pytest.mark.parametrize("trial", range(TRIALS))
def test_kill(whole, trial, tmp_path):
    done, deck, seconds = whole
    wait = random.Random(trial).uniform(0.0, 1.0) * seconds
    folder = tmp_path / "out"
    while not killed(deck, folder, wait):
        wait *= 0.7  # it had ended: the machine was busier when it was timed
    if not (folder / "beam.h5").exists():
        return  # nothing was written yet
    counts = frames_of(folder)
    report = rfem_recover.recover(folder / "beam")
    print(f"killed after {wait:.2f} of {seconds:.2f} s: {counts[0]} and {counts[1]} frames; {report}")
    for name in ("beam.vtkhdf", "beam_cracks.vtkhdf"):
        lost = (folder / name).exists() and not counts["_cracks" in name]
        assert any(f"{name} " in line or f"{name}:" in line for line in report.lost) == lost, report
    if not any("beam.h5" in line for line in report.lost):
        same_rows(folder, done, "beam.h5" in report.sound)
    if all(counts):
        same_frames(folder, done, min(counts))
    assert sorted(path.name for path in folder.iterdir() if path.name.endswith(".recover")) == []
    again = rfem_recover.recover(folder / "beam")
    assert not again.repaired and again.lost == report.lost, "what is repaired stays as it is"


def test_vtk_reads_a_repaired_file(whole, tmp_path):
    """VTK is what ParaView reads with; it refuses the file that the killed run left."""
    vtk = pytest.importorskip("vtkmodules.vtkIOHDF")
    done, deck, seconds = whole
    folder = tmp_path / "out"
    for wait in (0.7, 0.5, 0.8, 0.6, 0.9, 0.4):
        shutil.rmtree(folder, ignore_errors=True)
        if killed(deck, folder, wait * seconds) and (folder / "beam.h5").exists() and all(frames_of(folder)):
            break
    else:
        pytest.skip("this machine is too busy to kill a run in time")
    rfem_recover.recover(folder / "beam")
    for name in ("beam.vtkhdf", "beam_cracks.vtkhdf"):
        with h5py.File(folder / name) as file:
            count = file["VTKHDF/Steps"].attrs["NSteps"]
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(folder / name))
        reader.Update()
        assert reader.GetNumberOfSteps() == count > 0
        reader.SetStep(int(count) - 1)
        reader.Update()
        if "cracks" not in name:
            assert reader.GetOutput().GetNumberOfCells() == 1579 or count > 28


def test_sound_results_stay(whole, tmp_path, capsys):
    done = whole[0]
    folder = tmp_path / "copy"
    shutil.copytree(done.folder, folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert rfem_recover.main([str(folder / "beam")]) == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert "repaired" not in capsys.readouterr().out


def test_a_torn_line_is_cut_off(whole, tmp_path, capsys):
    folder = tmp_path / "copy"
    shutil.copytree(whole[0].folder, folder)
    path = folder / "beam_history.csv"
    text = path.read_text()
    path.write_text(text + "1,41,0.9")
    assert rfem_recover.main([str(path)]) == 0
    assert path.read_text() == text
    assert "repaired beam_history.csv: a torn last line of 8 bytes is cut off" in capsys.readouterr().out


def test_a_run_that_goes_on_is_left_alone(whole, tmp_path, capsys):
    folder = tmp_path / "copy"
    shutil.copytree(whole[0].folder, folder)
    with subprocess.Popen(["sleep", "60"], stdin=open(folder / "beam.h5")) as process:  # noqa: SIM115
        try:
            assert rfem_recover.main([str(folder / "beam")]) == 2
            assert f"beam.h5 is open in process {process.pid}" in capsys.readouterr().err
        finally:
            process.kill()


def test_no_results(tmp_path, capsys):
    assert rfem_recover.main([str(tmp_path / "nothing")]) == 2
    assert "no results of nothing" in capsys.readouterr().err

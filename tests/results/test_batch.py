"""The scripts of docs/batch in a plain shell that plays the scheduler, and the table of what they leave."""

import csv
import os
import signal
import subprocess
import sys
import time

import pytest
import rfem_collect
from rfem_run import BEAM, PROGRAM, SOURCE

BATCH = SOURCE / "docs" / "batch"
SWEEP = "job,H,SIGMA_T\nt30,8,3.0\nt45,8,4.5\nwrong,8,-1\nt60,8,6.0\nnever,8,7\n"


def environment(folder, **more):
    return {
        **os.environ,
        "RFEM": PROGRAM,
        "RFEM_RECOVER": f"{sys.executable} {SOURCE}/postproc/rfem_recover.py",
        "TMPDIR": str(folder),
        "OMP_NUM_THREADS": "1",
        **more,
    }


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """An array of four jobs of a table of five, started by the SLURM and the PBS script in turn; one deck is wrong."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "sweep.csv").write_text(SWEEP)
    (folder / "scratch").mkdir()
    for row in (1, 2, 3, 4):
        shell, variables = (
            (
                "sweep.slurm",
                {"SLURM_ARRAY_TASK_ID": str(row), "SLURM_CPUS_PER_TASK": "1", "SLURM_SUBMIT_DIR": str(SOURCE)},
            )
            if row % 2
            else ("sweep.pbs", {"PBS_ARRAY_INDEX": str(row), "NCPUS": "1", "PBS_O_WORKDIR": str(SOURCE)})
        )
        variables |= {"DECK": str(BEAM), "SWEEP": str(folder / "sweep.csv"), "RESULTS": str(folder / "results")}
        done = subprocess.run(
            [BATCH / shell], env=environment(folder / "scratch", **variables), cwd=folder, timeout=300, check=False
        )
        assert done.returncode == (2 if row == 3 else 0)
    return folder


def test_what_each_job_leaves(sweep):
    results = sweep / "results"
    assert not os.listdir(sweep / "scratch"), "the scratch folder is gone"
    for job in ("t30", "t45", "t60"):
        assert (results / f"{job}.exit").read_text() == "0\n"
        assert f"job {job}" in (results / f"{job}.log").read_text()
        assert (results / f"{job}.vtkhdf").exists()
    assert sorted(path.name for path in results.glob("wrong*")) == [
        "wrong.err", "wrong.exit", "wrong.log", "wrong.pieces",
    ]  # fmt: skip
    assert "rfem: error:" in (results / "wrong.err").read_text()


def test_the_table(sweep, capsys):
    table = sweep / "table.csv"
    figure = sweep / "figure.png"
    arguments = [sweep / "results", "--sweep", sweep / "sweep.csv", "--output", table]
    arguments += ["--plot", "SIGMA_T", "LOAD_peak", "--by", "H", "--figure", figure]
    assert rfem_collect.main([str(argument) for argument in arguments]) == 1, "some are not done"
    said = capsys.readouterr().err
    assert "5 jobs, 3 done" in said and "failed: wrong (exit status 2)" in said and "missing: never" in said
    with table.open(newline="") as file:
        rows = {row["job"]: row for row in csv.DictReader(file)}
    assert list(rows) == ["t30", "t45", "wrong", "t60", "never"], "in the order of the sweep, none dropped"
    assert [row["state"] for row in rows.values()] == ["done", "done", "failed", "done", "missing"]
    assert [float(row["SIGMA_T"]) for row in rows.values()] == [3.0, 4.5, -1.0, 6.0, 7.0]
    assert {row["U_TOTAL"] for row in rows.values() if row["state"] == "done"} == {"-0.06"}, (
        "parameters of the deck too"
    )
    peaks = [float(rows[job]["LOAD_peak"]) for job in ("t30", "t45", "t60")]
    assert peaks[1] == pytest.approx(107.132, rel=1e-3)
    assert peaks[0] == pytest.approx(peaks[1] * 3.0 / 4.5, rel=2e-3), "elastic up to the first crack"
    assert rows["t45"]["events"] == "5" and rows["t45"]["first_event_mode"] == "tension"
    assert figure.read_bytes().startswith(b"\x89PNG")


def stub(folder, name):
    """A command of the scheduler that writes down how it was called."""
    path = folder / name
    path.write_text(f'#!/bin/sh\necho "$@" >>"{folder}/{name}.calls"\n')
    path.chmod(0o755)
    return folder / f"{name}.calls"


def one_piece(command, folder, variables, seconds):
    """Run a row's script as the scheduler does: SIGTERM some time after results begin to come."""
    script = subprocess.Popen(command, env=environment(folder, **variables), cwd=folder)
    for _ in range(600):
        if list(folder.glob("rfem_*/*_history.csv")) or script.poll() is not None:
            break
        time.sleep(0.05)
    try:
        return script.wait(timeout=seconds)
    except subprocess.TimeoutExpired:
        script.send_signal(signal.SIGTERM)
        return script.wait(timeout=60)


SCHEDULERS = {
    "slurm": ("scontrol", {"SLURM_ARRAY_TASK_ID": "2", "SLURM_JOB_ID": "4711"}, "SUBMIT_DIR", "requeue 4711"),
    "pbs": ("qsub", {"PBS_ARRAY_INDEX": "2", "NCPUS": "1"}, "O_WORKDIR", "-J 2-3:2 -V docs/batch/sweep.pbs"),
}


@pytest.mark.parametrize("scheduler", SCHEDULERS)
def test_a_run_in_pieces(scheduler, tmp_path):
    """Time is up again and again; the script asks for another piece, until the run is done, with the same bits."""
    command, variables, where, call = SCHEDULERS[scheduler]
    calls = stub(tmp_path, command)
    deck = SOURCE / "input" / "verification" / "shear_box" / "shear_box.inp"
    (tmp_path / "sweep.csv").write_text("job\nother\nlong\n")
    results = tmp_path / "results"
    variables = {
        **variables,
        f"{scheduler.upper()}_{where}": str(SOURCE),
        "PATH": f"{tmp_path}:{os.environ['PATH']}",
        "DECK": str(deck),
        "SWEEP": str(tmp_path / "sweep.csv"),
        "RESULTS": str(results),
    }
    for piece in range(1, 40):
        status = one_piece([BATCH / f"sweep.{scheduler}"], tmp_path, variables, 0.4)
        assert (results / "long.exit").read_text() == f"{status}\n"
        assert (results / "long.pieces").read_text() == f"{piece}\n"
        assert not list(tmp_path.glob("rfem_long_*")), "the scratch folder is gone"
        if status == 0:
            break
        assert status == 4, (results / "long.err").read_text()
        assert calls.read_text() == f"{call}\n" * piece
        (row,) = rfem_collect.collect([results])
        assert row["state"] == "unfinished" and row["exit_status"] == 4
    assert piece > 1 and status == 0
    whole = subprocess.run(
        [PROGRAM, deck, "--job", "long", "--output", tmp_path / "whole"], check=True, capture_output=True, text=True
    )
    log = (results / "long.log").read_text()
    assert log.splitlines()[-1] == whole.stdout.splitlines()[-1] and log.count("going on at") == piece - 1
    for table in ("long_history.csv", "long_events.csv"):
        assert (results / table).read_bytes() == (tmp_path / "whole" / table).read_bytes()
    (row,) = rfem_collect.collect([results])
    assert row["state"] == "done"
    assert one_piece([BATCH / f"sweep.{scheduler}"], tmp_path, {**variables, "RFEM_AGAIN": ""}, 0.2) in (0, 4)
    assert (results / "long.pieces").read_text() == "1\n", "a row that had ended starts anew"


def test_a_checkpoint_on_the_way(tmp_path):
    """SIGUSR1 to the script: the program writes a checkpoint and goes on."""
    deck = SOURCE / "input" / "verification" / "shear_box" / "shear_box.inp"
    (tmp_path / "sweep.csv").write_text("job\nlong\n")
    script = subprocess.Popen(
        [BATCH / "run_row.sh", deck, tmp_path / "sweep.csv", "1", tmp_path / "results"],
        env=environment(tmp_path), cwd=tmp_path,
    )  # fmt: skip
    for _ in range(600):
        if list(tmp_path.glob("rfem_long_*/long_history.csv")) or script.poll() is not None:
            break
        time.sleep(0.02)
    script.send_signal(signal.SIGUSR1)
    assert script.wait(timeout=60) == 0
    assert (tmp_path / "results" / "long.rst.h5").exists()


def test_rows_that_are_not_there(tmp_path):
    (tmp_path / "sweep.csv").write_text("job,H\na,8\n")
    for content, row in (("job,H\na,8\n", "2"), ("name,H\na,8\n", "1"), ("job,H\na\n", "1")):
        (tmp_path / "sweep.csv").write_text(content)
        done = subprocess.run(
            [BATCH / "run_row.sh", BEAM, tmp_path / "sweep.csv", row, tmp_path / "results"],
            env=environment(tmp_path), capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 2 and "sweep.csv" in done.stderr
    assert not (tmp_path / "results").exists()


def test_the_shipped_sweep(tmp_path):
    """Every row of docs/batch/sweep.csv has the parameters of its deck."""
    for row in rfem_collect.read_sweep(BATCH / "sweep.csv"):
        settings = [f"--set={name}={value}" for name, value in row.items() if name != "job"]
        settings = [word for setting in settings for word in setting.split("=", 1)]
        done = subprocess.run([PROGRAM, BEAM, "--check", *settings], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_wrong_usage(tmp_path, capsys):
    assert rfem_collect.main([str(tmp_path)]) == 2
    assert "no results of rfem" in capsys.readouterr().err
    assert rfem_collect.main([str(tmp_path / "nothing")]) == 2
    assert rfem_collect.main([str(tmp_path), "--by", "H"]) == 2
    wrong = tmp_path / "wrong.csv"
    for content, words in (
        ("H,job\n1,a\n", "first column"),
        ("job,H\na\n", ":2:"),
        ("job,H\na,1\na,2\n", "a is there twice"),
    ):
        wrong.write_text(content)
        with pytest.raises(rfem_collect.ResultsError, match=words):
            rfem_collect.read_sweep(wrong)


def test_columns_that_cannot_be_drawn():
    rows = [{"job": "a", "state": "done", "H": 8, "mode": "tension"}, {"job": "b", "state": "missing", "H": 4}]
    with pytest.raises(rfem_collect.ResultsError, match="no column Hh; did you mean H"):
        rfem_collect.sweep_figure(rows, "Hh", "H")
    with pytest.raises(rfem_collect.ResultsError, match="mode has no numbers"):
        rfem_collect.sweep_figure(rows, "H", "mode")


def test_the_commands_beside_the_program(sweep):
    """rfem-collect and the like find their Python files from wherever they are called."""
    folder = os.path.dirname(PROGRAM)
    if not os.path.exists(os.path.join(folder, "rfem-collect")):
        pytest.skip("this program stands alone")
    for name in ("plot", "compare", "collect", "recover"):
        command = [os.path.join(folder, f"rfem-{name}"), "--help"]
        done = subprocess.run(
            command,
            env=environment(sweep, RFEM_PYTHON=sys.executable),
            cwd=sweep,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0 and f"rfem_{name}.py" in done.stdout, done.stderr

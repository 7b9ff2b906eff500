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


def histories(folder, where):
    """Bytes of the longest history there."""
    return max((path.stat().st_size for path in folder.glob(f"{where}*_history.csv")), default=0)


def one_piece(command, folder, variables, seconds):
    """Run a row's script as the scheduler does: SIGTERM some time after new results begin to come."""
    before = histories(folder, "results/")
    script = subprocess.Popen(command, env=environment(folder, **variables), cwd=folder)
    for _ in range(600):
        if histories(folder, "rfem_*/") > before or script.poll() is not None:
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
        status = one_piece([BATCH / f"sweep.{scheduler}"], tmp_path, variables, 0.2 + 0.1 * piece)
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
    assert log.splitlines()[-1] == whole.stdout.splitlines()[-1] and 0 < log.count("going on at") < piece
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


def call_row(folder, *arguments, **variables):
    """run_row.sh with these arguments; deck, table and results are those of `folder` where none are given."""
    arguments = arguments or (BEAM, folder / "sweep.csv", "1", folder / "results")
    return subprocess.run(
        [BATCH / "run_row.sh", *arguments],
        env=environment(folder, **variables), cwd=folder, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip


WRONG_TABLES = {
    "": "is empty",
    "name,H\na,8\n": ":1: the first column of a sweep is job",
    "H,job\n1,a\n": ":1: the first column of a sweep is job",
    "job,H\na\n": ":2: 1 values for 2 columns",
    "job,H\na,8,9\n": ":2: 3 values for 2 columns",
    "job,H\na,\n": ":2: '' is no value for H",
    "job,H\na,1 2\n": ":2: '1 2' is no value for H",
    'job,H\na,"1"\n': ":2: '\"1\"' is no value for H",
    "job,H\na b,8\n": ":2: 'a b' is no job name: letters, digits, _ . + -",
    'job,H\n\n"q",8\n': ":3: '\"q\"' is no job name",
    "job,H\n'q',8\n": ":2: ''q'' is no job name",
    "job,H\na,8\n\n../esc,8\n": ":4: '../esc' is no job name",
    "job,H\nx/y,8\n": ":2: 'x/y' is no job name",
    "job,H\n.hidden,8\n": ":2: '.hidden' is no job name",
    "job,H\n-a,8\n": ":2: '-a' is no job name",
    "job,H\n,8\n": ":2: '' is no job name",
    "job,H\nd,8\n\ne,8\nd,9\n": ":5: the job d is there twice (line 2)",
    "job,H,H\na,8,9\n": ":1: the column H is there twice",
    "job,H 1\na,8\n": ":1: 'H 1' is no name of a parameter",
    "job,\na,8\n": ":1: '' is no name of a parameter",
}


@pytest.mark.parametrize("content", WRONG_TABLES)
def test_a_wrong_table_is_refused_before_anything_is_run(content, tmp_path, capsys):
    """run_row.sh and rfem_collect.py say the same, with table and line."""
    (tmp_path / "sweep.csv").write_text(content)
    done = call_row(tmp_path)
    message = f"{tmp_path / 'sweep.csv'}{WRONG_TABLES[content] if content else ' is empty'}"
    assert done.returncode == 2 and done.stderr.startswith("run_row.sh: error: ") and message in done.stderr
    assert done.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.csv"]
    (tmp_path / "a.exit").write_text("0\n")
    assert rfem_collect.main([str(tmp_path), "--sweep", str(tmp_path / "sweep.csv")]) == 2
    said = capsys.readouterr().err
    assert said.startswith("rfem_collect: error: ") and message in said


def test_tables_of_other_programs(tmp_path):
    """A byte order mark, CR LF, blanks around values, empty lines: what spreadsheets write."""
    (tmp_path / "sweep.csv").write_bytes(b"\xef\xbb\xbfjob , H\r\n\r\na , 8\r\n b.1+x_-, 4 \r\n")
    program = player(tmp_path, "exit 0")
    assert call_row(tmp_path, BEAM, tmp_path / "sweep.csv", "2", tmp_path / "results", RFEM=program).returncode == 0
    assert "--job b.1+x_- --set H=4 --output" in (tmp_path / "calls").read_text()
    assert rfem_collect.read_sweep(tmp_path / "sweep.csv") == [{"job": "a", "H": 8}, {"job": "b.1+x_-", "H": 4}]


def test_wrong_calls_of_the_script(tmp_path):
    (tmp_path / "sweep.csv").write_text("job,H\na,8\n")
    table, results = tmp_path / "sweep.csv", tmp_path / "results"
    for arguments, words in (
        ((BEAM,), "four arguments are needed, not 1: run_row.sh DECK SWEEP.csv ROW RESULTS"),
        ((BEAM, table, "1", results, "more"), "four arguments are needed, not 5"),
        ((BEAM, table, "0", results), "'0' is no row: rows count from 1"),
        ((BEAM, table, "1p", results), "'1p' is no row"),
        ((BEAM, table, "", results), "'' is no row"),
        ((BEAM, table, "2", results), f"{table} has no row 2, but 1"),
        ((BEAM, tmp_path / "nothing.csv", "1", results), "nothing.csv: there is no such table"),
        ((BEAM, table, "1", ""), "the folder of the results, is empty"),
    ):
        done = call_row(tmp_path, *arguments)
        assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1, done.stderr
    assert not results.exists()


def test_a_program_that_is_not_there(tmp_path, capsys):
    """Status 127, or 126 for a file that is no program: the job has failed, and the reason is in its JOB.err."""
    (tmp_path / "sweep.csv").write_text("job\nd\n")
    for program, status in (("/nope", 127), (str(tmp_path / "sweep.csv"), 126)):
        done = call_row(tmp_path, RFEM=program)
        assert (
            done.returncode == status and f"the program {program} cannot be started; RFEM names another" in done.stderr
        )
        assert f"the program {program} cannot be started" in (tmp_path / "results" / "d.err").read_text()
        (row,) = rfem_collect.collect([tmp_path / "results"])
        assert row["state"] == "failed" and row["exit_status"] == status


def test_messages_name_files_at_home(tmp_path):
    """The scratch folder is gone when somebody reads them."""
    program = player(tmp_path, f'{CHECKPOINT}; echo "note: go on with: rfem --restart $job.rst.h5" >&2; exit 4')
    run = row(tmp_path, RFEM=program)
    assert run.communicate(timeout=60) and run.returncode == 4
    said = (tmp_path / "results" / "long.err").read_text()
    assert said == f"note: go on with: rfem --restart {tmp_path}/results/long.rst.h5\n"


@pytest.mark.parametrize("wait", range(5, 60, 6))
def test_a_signal_while_the_script_begins(wait, tmp_path):
    """Time is up before the script has read its table: the row is not lost, it is queued again."""
    again = stub(tmp_path, "again")
    program = player(tmp_path, f"trap 'exit 4' TERM; {CHECKPOINT}; sleep 1 & wait; exit 4")
    run = row(tmp_path, RFEM=program, RFEM_AGAIN=str(tmp_path / "again"))
    time.sleep(wait / 1000)
    os.kill(run.pid, signal.SIGTERM)
    run.communicate(timeout=60)
    if run.returncode == -signal.SIGTERM:
        pytest.skip("this machine is too busy: bash had not read a line")
    assert run.returncode == 4 and again.read_text() == "\n"
    assert (tmp_path / "results" / "long.exit").read_text() == "4\n"


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


def test_units_on_the_axes(sweep):
    """Those that the deck's heading states, on what is not a parameter."""
    where = [sweep / "results"]
    rows, units = rfem_collect.collect(where), rfem_collect.sweep_units(where)
    for names, labels in (
        (("SIGMA_T", "LOAD_peak"), ("SIGMA_T", "LOAD_peak (N)")),
        (("LOAD_u2", "released_energy"), ("LOAD_u2 (mm)", "released_energy (N mm)")),
        (("first_event_x", "crack_length"), ("first_event_x (mm)", "crack_length (mm)")),
        (("wall_time", "events"), ("wall_time (s)", "events")),
    ):
        (axes,) = rfem_collect.sweep_figure(rows, *names, units=units).axes
        assert (axes.get_xlabel(), axes.get_ylabel()) == labels
    (axes,) = rfem_collect.sweep_figure(rows, "SIGMA_T", "LOAD_peak").axes
    assert axes.get_ylabel() == "LOAD_peak", "none are stated"


def test_the_figure_lies_beside_the_table(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tables").mkdir()
    arguments = [str(sweep / "results"), "--plot", "SIGMA_T", "LOAD_peak"]
    assert rfem_collect.main([*arguments, "--output", "tables/x.csv"]) == 1
    assert sorted(path.name for path in (tmp_path / "tables").iterdir()) == ["LOAD_peak_over_SIGMA_T.png", "x.csv"]
    assert rfem_collect.main(arguments) == 1
    assert (tmp_path / "LOAD_peak_over_SIGMA_T.png").exists()


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


# --- what comes in the way of the script -----------------------------------------------------------------

BOX = SOURCE / "input" / "verification" / "shear_box" / "shear_box.inp"
# in place of the program: what it is told to do when it is called for the N-th time
PLAYER = """#!/bin/bash
echo "$@" >>{folder}/calls
n=$(wc -l <{folder}/calls)
exec {folder}/play_$n "$@"
"""


def player(folder, *scripts):
    """A program that does at its N-th call what the N-th of these shell scripts says; `$job` is where its files go."""
    (folder / "player").write_text(PLAYER.format(folder=folder))
    (folder / "player").chmod(0o755)
    for n, script in enumerate(scripts, 1):
        path = folder / f"play_{n}"
        path.write_text(
            '#!/bin/bash\n[ "$1" = --restart ] && job=${2%.rst*} || job="${@: -2:1}/long"\n' + script + "\n"
        )
        path.chmod(0o755)
    return str(folder / "player")


def row(folder, **variables):
    """The row `long` of a table with one row, started by hand."""
    (folder / "long.csv").write_text("job\nlong\n")
    return subprocess.Popen(
        [BATCH / "run_row.sh", BOX, folder / "long.csv", "1", folder / "results"],
        env=environment(folder, **variables), cwd=folder, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def calls(folder):
    return [line.split()[0] for line in (folder / "calls").read_text().splitlines()]


CHECKPOINT = 'for n in rst.h5 rst.1.h5 h5; do echo "$n" >"$job.$n"; done'


def test_no_room_for_the_results(tmp_path):
    """Exit status 3 with a checkpoint: the row goes on from it; without one it starts anew."""
    program = player(tmp_path, f"{CHECKPOINT}; exit 3", "echo going on at step 1; exit 0", "exit 3", "exit 0")
    for status in (3, 0, 3, 0):
        run = row(tmp_path, RFEM=program)
        run.communicate(timeout=60)
        assert run.returncode == status
    assert calls(tmp_path) == [str(BOX), "--restart", str(BOX), str(BOX)]


def test_the_checkpoint_before(tmp_path):
    """Where JOB.rst.h5 is refused or missing the row goes on from JOB.rst.1.h5; where both are, neither is lost."""
    refused = "echo rfem: error: damaged >&2; exit 3"
    again = "echo going on at step 1; exit 4"
    scripts = [f"{CHECKPOINT}; exit 4", refused, again, again, refused, refused]
    program = player(tmp_path, *scripts)
    for status in (4, 4):
        run = row(tmp_path, RFEM=program)
        assert run.communicate(timeout=60) and run.returncode == status
    (tmp_path / "results" / "long.rst.h5").unlink()
    run = row(tmp_path, RFEM=program)
    assert run.communicate(timeout=60) and run.returncode == 4
    (tmp_path / "results" / "long.rst.h5").write_text("again")
    run = row(tmp_path, RFEM=program)
    assert "long.rst.1.h5 is refused: rfem: error: damaged" in run.communicate(timeout=60)[1]
    assert run.returncode == 3
    names = [line.split()[1].rsplit("/", 1)[1] for line in (tmp_path / "calls").read_text().splitlines()[1:]]
    assert names == ["long.rst.h5", "long.rst.1.h5", "long.rst.1.h5", "long.rst.h5", "long.rst.1.h5"]
    assert (tmp_path / "results" / "long.rst.h5").read_text() == "again"


@pytest.mark.parametrize("wait", range(0, 60, 4))
def test_status_of_a_program_that_ends_with_the_signal(wait, tmp_path):
    """The signal ends the script's wait, and before it waits again the program has ended: its status is not lost."""
    again = stub(tmp_path, "again")
    program = player(tmp_path, f"trap '' USR1; touch {tmp_path}/runs; sleep 0.03; {CHECKPOINT}; exit 4")
    run = row(tmp_path, RFEM=program, RFEM_AGAIN=str(tmp_path / "again"))
    wait_for(tmp_path / "runs")
    time.sleep(wait / 1000)
    os.kill(run.pid, signal.SIGUSR1)
    run.communicate(timeout=60)
    assert run.returncode == 4 and again.exists()
    assert (tmp_path / "results" / "long.exit").read_text() == "4\n"


def test_a_signal_before_the_program_runs(tmp_path):
    """Time is up while files are copied to the scratch folder: nothing is run, the row is queued again."""
    again = stub(tmp_path, "again")
    program = player(tmp_path, f"{CHECKPOINT}; exit 4", "exit 0")
    run = row(tmp_path, RFEM=program)
    assert run.communicate(timeout=60) and run.returncode == 4
    (tmp_path / "bin").mkdir()
    slow = tmp_path / "bin" / "cp"
    slow.write_text(f'#!/bin/sh\ntouch {tmp_path}/copies\nsleep 0.3\nPATH="${{PATH#*:}}" exec cp "$@"\n')
    slow.chmod(0o755)
    path = f"{tmp_path}/bin:{os.environ['PATH']}"
    run = row(tmp_path, RFEM=program, RFEM_AGAIN=str(tmp_path / "again"), PATH=path)
    wait_for(tmp_path / "copies")
    os.kill(run.pid, signal.SIGTERM)
    run.communicate(timeout=60)
    assert run.returncode == 4 and again.read_text() == "\n" and len(calls(tmp_path)) == 1
    run = row(tmp_path, RFEM=program)
    assert run.communicate(timeout=60) and run.returncode == 0
    assert calls(tmp_path)[1] == "--restart"


def wait_until(happens):
    for _ in range(3000):
        if happens():
            return
        time.sleep(0.01)
    raise AssertionError("it does not happen")


def wait_for(path):
    wait_until(path.exists)


def children(process):
    with open(f"/proc/{process}/task/{process}/children") as file:
        return file.read().split()


def state(process):
    """Z: it has ended and nobody has looked; None: it is gone."""
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return None


# a command that does its work N - 1 times and then kills all that runs with it, half done
DEADLY = """#!/bin/bash
echo >>{folder}/counts
if [ "$(wc -l <{folder}/counts)" -ge {n} ]; then
   {half}
   kill -9 0
fi
PATH="${{PATH#*:}}" exec {command} "$@"
"""


@pytest.mark.parametrize("command, n", [("cp", 1), ("mv", 1), ("mv", 3), ("mv", 6), ("mv", 7), ("mv", 9)])
def test_killed_while_the_results_are_brought_home(command, n, tmp_path):
    """Whatever has come home by then, the row goes on and ends with the bits of the uninterrupted run."""
    results = tmp_path / "results"
    half = 'for f in "$(dirname "${@: -2:1}/x")"/*; do mkdir -p "${@: -1}"; head -c 900 "$f" >"${@: -1}/${f##*/}"; done'
    deadly = DEADLY.format(folder=tmp_path, n=n, command=command, half=half if command == "cp" else ":")
    whole = subprocess.run(
        [PROGRAM, BOX, "--job", "long", "--output", tmp_path / "whole"], check=True, capture_output=True, text=True
    )
    piece(tmp_path, 4)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / command).write_text(deadly)
    (tmp_path / "bin" / command).chmod(0o755)
    if command == "cp":  # the first copies take the files to the scratch folder
        copies = len([end for end in results.glob("long*") if end.suffix not in (".exit", ".pieces")])
        (tmp_path / "counts").write_text("\n" * copies)
        text = (tmp_path / "bin" / "cp").read_text().replace("-ge 1", f"-gt {copies}")
        (tmp_path / "bin" / "cp").write_text(text)
    piece(tmp_path, -signal.SIGKILL, PATH=f"{tmp_path}/bin:{os.environ['PATH']}")
    assert (results / "long.rst.h5").exists()
    for number in range(40):
        if piece(tmp_path, (0, 4), seconds=0.1 * number) == 0:
            break
    log = (results / "long.log").read_text()
    assert log.splitlines()[-1] == whole.stdout.splitlines()[-1]
    for table in ("long_history.csv", "long_events.csv"):
        assert (results / table).read_bytes() == (tmp_path / "whole" / table).read_bytes()
    assert not list(results.glob(".*")), "nothing stays of what was half done"


def piece(folder, expected, seconds=0.1, **variables):
    """A piece of the row: its time is up a while after new results begin to come."""
    for old in folder.glob("rfem_long_*"):
        old.rename(folder / f"gone_{time.monotonic_ns()}")
    before = histories(folder, "results/")
    run = row(folder, **variables)
    wait_until(lambda: histories(folder, "rfem_*/") > before or run.poll() is not None)
    time.sleep(seconds)
    if run.poll() is None:
        os.kill(run.pid, signal.SIGTERM)
    run.communicate(timeout=60)
    assert run.returncode in (expected if isinstance(expected, tuple) else (expected,))
    return run.returncode

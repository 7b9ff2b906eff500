"""A run that is cut anywhere and gone on with gives what the uninterrupted one gives: digests, tables, fields.

`rfem_cut N ..` is rfem, left when it asks for the N-th time whether it is to be left (after each iteration and stage).
"""

import os
import re
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

import h5py
import pytest
from kept_results import assert_same, tables
from rfem_run import PROGRAM, SOURCE, call, edited

CUT = str(Path(PROGRAM).with_name("rfem_cut"))
VERIFICATION = SOURCE / "input" / "verification"
GOOD = SOURCE / "tests" / "deck" / "good"

# deck, changes, what it is about
CASES = {
    "plate": (SOURCE / "input" / "tutorial" / "first_deck" / "first_deck.inp", [], "21 events in tension"),
    "block": (VERIFICATION / "compression" / "compression.inp", [], "30 events, most in shear; contact"),
    "softening": (GOOD / "softening.inp", [], "cohesion"),
    "shear_box": (VERIFICATION / "shear_box" / "shear_box.inp", [], "contact"),
    "bar": (VERIFICATION / "bar_wave" / "bar_wave.inp", [], "dynamic"),
    "broken_bar": (GOOD / "dynamic.inp", [], "dynamic with events"),
    "excavation": (VERIFICATION / "excavation" / "excavation.inp", [], "removal, stress in place"),
    "removed": (GOOD / "model_change.inp", [], "removal, then loads on single nodes"),
    "stopping": (VERIFICATION / "stopping" / "stopping.inp", [], "steps that stop"),
    "choices": (GOOD / "fracture_choices.inp", [], "several events at once"),
    "damping": (GOOD / "relaxation.inp", [], "KINETIC, LOCAL, VISCOUS"),
    "cracks": (GOOD / "cracks_anywhere.inp", [], "cracks from the start"),
    "pressure": (GOOD / "loads.inp", [], "loads that follow"),
    "grown": (GOOD / "grown.inp", [], "new numbers as the mesh grows, then removal, loads on single nodes and faces"),
}


def cut(n, *arguments, threads=1):
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "OMP_WAIT_POLICY": "passive"}
    done = subprocess.run(
        [CUT, str(n), *map(str, arguments)],
        env=environment, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=120,
    )  # fmt: skip
    done.asked = int(re.search(r"^asked (\d+)$", done.stdout, re.M)[1])
    found = re.search(r"^digest displacements=([0-9A-F]{16}) topology=([0-9A-F]{16})$", done.stdout, re.M)
    done.digests = found and found.groups()
    return done


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Each case without interruption, run when first wanted."""
    runs = {}

    def get(name):
        if name not in runs:
            deck, changes, _ = CASES[name]
            folder = tmp_path_factory.mktemp(name)
            deck = edited(deck, folder, *changes) if changes else deck
            done = cut(0, deck, "--output", folder / "whole", "--job", "j", "--quiet")
            runs[name] = (deck, done, folder / "whole")
        return runs[name]

    return get


@pytest.mark.parametrize("part", [0.05, 0.5, 0.93])
@pytest.mark.parametrize("name", CASES)
def test_cut_once(name, part, whole, tmp_path):
    deck, uncut, results = whole(name)
    assert uncut.returncode == 0, uncut.stderr
    n = max(1, int(part * uncut.asked))
    first = cut(n, deck, "--output", tmp_path, "--job", "j", "--quiet")
    assert first.returncode == 4 and first.asked == n, first.stderr
    assert f"go on with: rfem --restart {tmp_path}/j.rst.h5" in first.stdout and first.digests is None
    rest = cut(0, "--restart", tmp_path / "j.rst.h5", "--quiet", threads=2)
    assert rest.returncode == 0, rest.stderr
    assert rest.digests == uncut.digests
    assert_same(tmp_path, results)


@pytest.mark.parametrize("name", ["plate", "softening", "broken_bar", "stopping", "excavation"])
def test_cut_often(name, whole, tmp_path):
    """A run in many pieces, each with another number of threads."""
    deck, uncut, results = whole(name)
    n = uncut.asked // 7 + 1
    done = cut(n, deck, "--output", tmp_path, "--job", "j", "--quiet")
    pieces = 1
    while done.returncode == 4:
        done = cut(n, "--restart", tmp_path / "j.rst.h5", "--quiet", threads=1 + pieces % 2)
        pieces += 1
    assert done.returncode == 0 and pieces == 7, done.stderr
    assert done.digests == uncut.digests
    assert_same(tmp_path, results)


def test_cut_behind_new_numbers(whole, tmp_path):
    """The mesh was numbered anew before the cut; what the next step names is found, by other threads too."""
    deck, uncut, results = whole("grown")
    assert uncut.stdout.count("numbered anew") == 1
    text = uncut.stdout.split("numbered anew")[1]
    assert "elements removed" in text
    first = cut(int(0.6 * uncut.asked), deck, "--output", tmp_path, "--job", "j", "--quiet", threads=2)
    assert "numbered anew" in first.stdout and "elements removed" not in first.stdout
    rest = cut(0, "--restart", tmp_path / "j.rst.h5", "--quiet")
    assert "numbered anew" not in rest.stdout and "elements removed" in rest.stdout
    assert rest.digests == uncut.digests
    assert_same(tmp_path, results)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_cut_at_the_beginning(n, whole, tmp_path):
    """After row 0, when the first step has begun, and after the first iteration of the first relaxation."""
    deck, uncut, results = whole("plate")
    assert cut(n, deck, "--output", tmp_path, "--job", "j", "--quiet").returncode == 4
    rest = cut(0, "--restart", tmp_path / "j.rst.h5", "--quiet")
    assert rest.digests == uncut.digests
    assert_same(tmp_path, results)


CHECKPOINTS = ("*BOUNDARY\nLEFT, 1, 1", "*RESTART, WRITE{}\n*BOUNDARY\nLEFT, 1, 1")
SMALL = SOURCE / "tests" / "deck" / "good" / "output.inp"


def test_checkpoints_of_the_deck(tmp_path):
    """The last two checkpoints of a run that has ended; from the first of them it ends again, with the same bits."""
    deck = edited(SMALL, tmp_path, (CHECKPOINTS[0], CHECKPOINTS[1].format("")))
    (tmp_path / "whole").mkdir()
    plain = cut(0, SMALL, "--output", tmp_path / "plain", "--job", "j", "--quiet")
    done = cut(0, deck, "--output", tmp_path / "whole", "--job", "j", "--quiet")
    assert done.returncode == 0 and done.digests == plain.digests
    assert tables(tmp_path / "plain") == tables(tmp_path / "whole")
    shutil.copytree(tmp_path / "whole", tmp_path / "moved")
    profile = r"^time: .*relaxation \S+ s \(of it contact after the step \S+ s\), .*, checkpoints \S+ s$"
    assert re.search(profile, done.stdout, re.M)
    assert ", checkpoints " not in plain.stdout
    for name in ("j.rst.h5", "j.rst.1.h5"):
        again = cut(0, "--restart", tmp_path / "moved" / name, "--quiet")
        assert again.returncode == 0 and again.digests == done.digests, again.stderr
        assert ("\ngoing on at" in again.stdout) == (name == "j.rst.1.h5")
        assert_same(tmp_path / "moved", tmp_path / "whole")


@pytest.mark.parametrize(
    "name, change, words",
    [
        ("bar", [], "all steps are done"),
        ("plate", [], "its last step was stopped by STOP DROP"),
        ("plate", [("*FRACTURE", "*FRACTURE, MAX EVENTS=2")], "its last step was stopped by MAX EVENTS or STOP DROP"),
    ],
)
def test_a_finished_run(name, change, words, tmp_path):
    """There is nothing to go on with: it is said, with what had ended the run, and no file is touched."""
    deck = edited(CASES[name][0], tmp_path, ("*HEADING", "*RESTART, WRITE\n*HEADING"), *change)
    out = tmp_path / "out"
    done = cut(0, deck, "--output", out, "--job", "j", "--quiet")
    assert done.returncode == 0
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in out.iterdir()}
    again = cut(0, "--restart", out / "j.rst.h5", "--quiet")
    assert again.returncode == 0 and again.digests == done.digests and not again.stderr
    assert re.search(
        rf"^nothing left to do: this run had ended at step \d+, .*{words}.*; its results stay", again.stdout, re.M
    )
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in out.iterdir()} == before


def test_a_finished_run_whose_files_are_not(tmp_path):
    """Killed between its last checkpoint and its end: nothing is left to compute; the files are closed."""
    deck = edited(SMALL, tmp_path, (CHECKPOINTS[0], CHECKPOINTS[1].format("")))
    done = cut(0, deck, "--output", tmp_path / "whole", "--job", "j", "--quiet")
    shutil.copytree(tmp_path / "whole", tmp_path / "killed")
    with h5py.File(tmp_path / "killed" / "j.h5", "r+") as file:
        for name in ("exit_status", "wall_time", "digest_displacements", "digest_topology"):
            del file["rfem"].attrs[name]
    again = cut(0, "--restart", tmp_path / "killed" / "j.rst.h5", "--quiet")
    assert again.returncode == 0 and again.digests == done.digests and "\ngoing on at" in again.stdout
    assert_same(tmp_path / "killed", tmp_path / "whole")


def test_killed(tmp_path):
    """kill -9: the last checkpoint is a whole one, and what was written after it is written again."""
    deck = edited(CASES["plate"][0], tmp_path, ("*HEADING", "*RESTART, WRITE\n*HEADING"))
    start = time.monotonic()
    whole = cut(0, deck, "--output", tmp_path / "whole", "--job", "j", "--quiet")
    seconds = time.monotonic() - start
    for part in (0.3, 0.6, 0.9):
        folder = tmp_path / f"at{part}"
        run = subprocess.Popen([PROGRAM, deck, "--output", folder, "--job", "j", "--quiet"], stdout=subprocess.DEVNULL)
        time.sleep(part * seconds)
        run.kill()
        run.wait()
        if not (folder / "j.rst.h5").exists():
            continue
        rest = cut(0, "--restart", folder / "j.rst.h5", "--quiet")
        assert rest.returncode == 0 and rest.digests == whole.digests, rest.stderr
        assert_same(folder, tmp_path / "whole")


def interrupted(deck, folder, number, seconds, ignored=None):
    """A run that gets a signal so long after its results have begun to come; it may be told to ignore one."""

    def prepare():
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        if ignored:
            signal.signal(ignored, signal.SIG_IGN)

    run = subprocess.Popen(
        [PROGRAM, deck, "--output", folder, "--job", "j", "--quiet"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"},
        preexec_fn=prepare,
    )  # fmt: skip
    while not (folder / "j_history.csv").exists() and run.poll() is None:
        time.sleep(0.01)
    time.sleep(seconds)
    run.send_signal(number)
    out, messages = run.communicate(timeout=120)
    return run.returncode, out, messages


@pytest.mark.parametrize(
    "number, seconds",
    [
        (signal.SIGTERM, 0.0),
        (signal.SIGTERM, 0.31),
        (signal.SIGINT, 0.13),
        (signal.SIGHUP, 0.1),
        (signal.SIGXCPU, 0.05),
    ],
)
def test_signals(number, seconds, whole, tmp_path):
    deck, uncut, results = whole("shear_box")
    status, out, messages = interrupted(deck, tmp_path, number, seconds)
    assert status == 4, messages
    assert f"rfem: note: stopped by {number.name} at step " in messages
    rest = call("--restart", tmp_path / "j.rst.h5", "--quiet")
    assert rest.returncode == 0 and "\ngoing on at step " in rest.stdout
    assert rest.stdout.splitlines()[-1] == "digest displacements={} topology={}".format(*uncut.digests)
    assert_same(tmp_path, results)


def test_nohup(whole, tmp_path):
    """A hang-up that the run was told to ignore does nothing."""
    deck, uncut, results = whole("shear_box")
    status, out, messages = interrupted(deck, tmp_path, signal.SIGHUP, 0.1, ignored=signal.SIGHUP)
    assert status == 0 and not messages
    assert_same(tmp_path, results)


def test_limit_of_processor_time(tmp_path):
    """ulimit -t: the soft limit stops the run in order."""
    (tmp_path / "j.inp").write_text(LARGE.replace("*STATIC\n", "*STATIC\n0.01, 1.\n"))

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (2, 100))

    done = call(tmp_path / "j.inp", "--output", tmp_path, "--quiet", preexec_fn=limit)
    assert done.returncode == 4, done.stderr
    assert "rfem: note: stopped by SIGXCPU at step 1" in done.stderr and (tmp_path / "j.rst.h5").exists()


def test_a_checkpoint_is_asked_for(whole, tmp_path):
    deck, uncut, results = whole("shear_box")
    status, out, messages = interrupted(deck, tmp_path, signal.SIGUSR1, 0.2)
    assert status == 0 and not messages
    assert_same(tmp_path, results)
    rest = cut(0, "--restart", tmp_path / "j.rst.h5", "--quiet", threads=2)
    assert rest.digests == uncut.digests
    assert_same(tmp_path, results)


LARGE = """*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=ALL
0, 0, 1, 1, 200, 200
*MATERIAL, NAME=M
*ELASTIC
1000, 0.2
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*STEP
*STATIC
*BOUNDARY
BOTTOM, 1, 2
TOP, 2, 2, 0.1
*END STEP
"""


def is_caught(process, number):
    """Whether a process has a handler for a signal."""
    with open(f"/proc/{process}/status") as file:
        return int(re.search(r"^SigCgt:\s*(\w+)", file.read(), re.M)[1], 16) >> (number - 1) & 1


def test_the_second_interrupt_ends_it_at_once(tmp_path):
    """After the first one this run has an iteration and a checkpoint of 80,000 elements before it."""
    (tmp_path / "j.inp").write_text(LARGE)
    run = subprocess.Popen(
        [PROGRAM, tmp_path / "j.inp", "--output", tmp_path, "--quiet"],
        stdout=subprocess.DEVNULL, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    while not (tmp_path / "j_history.csv").exists() and run.poll() is None:
        time.sleep(0.01)
    assert is_caught(run.pid, signal.SIGINT)
    run.send_signal(signal.SIGINT)
    while is_caught(run.pid, signal.SIGINT):
        pass
    run.send_signal(signal.SIGINT)
    assert run.wait(timeout=60) == -signal.SIGINT
    assert not (tmp_path / "j.rst.h5").exists()


def test_the_wall_clock_limit(whole, tmp_path):
    """WALLTIME counts from the start of the program, for each piece anew."""
    deck = VERIFICATION / "shear_box" / "shear_box.inp"
    limited = edited(deck, tmp_path, ("*HEADING", "*RESTART, WRITE, FREQUENCY=1000, WALLTIME=0.4\n*HEADING"))
    done = call(limited, "--output", tmp_path, "--job", "j", "--quiet")
    pieces = 1
    while done.returncode == 4:
        assert "stopped by the wall-clock limit" in done.stderr
        done = call("--restart", tmp_path / "j.rst.h5", "--quiet")
        pieces += 1
        assert pieces < 100
    assert done.returncode == 0 and pieces > 1
    assert done.stdout.splitlines()[-1] == "digest displacements={} topology={}".format(*whole("shear_box")[1].digests)
    assert tables(tmp_path) == tables(whole("shear_box")[2])


def edit_a_digit(folder):
    path = folder / "j_history.csv"
    head, row = path.read_text().split("\n", 1)
    path.write_text(head + "\n" + row.replace("1", "2", 1))


def edit_three_bytes(folder):
    """+1, -2, +1: sums in which neighbours have neighbouring weights do not change."""
    path = folder / "j_history.csv"
    head, row = path.read_bytes().split(b"\n", 1)
    edited = re.sub(rb"[0-8][2-9][0-8]", lambda at: bytes(c + d for c, d in zip(at[0], (1, -2, 1))), row, count=1)
    assert edited != row
    path.write_bytes(head + b"\n" + edited)


def test_what_cannot_be_gone_on_with(tmp_path):
    """Damaged, cut short, no checkpoint at all, without its results: the reason, status 3, and nothing is changed."""
    assert cut(200, SMALL, "--output", tmp_path / "good", "--job", "j", "--quiet").returncode == 4

    def refused(change, *words, path="j.rst.h5"):
        folder = tmp_path / "bad"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(tmp_path / "good", folder)
        change(folder)
        before = tables(folder)
        done = call("--restart", folder / path)
        assert done.returncode == 3 and done.stderr.startswith("rfem: error: "), done.stderr
        assert "are kept" not in done.stderr, "nothing was run"
        for word in words:
            assert word in done.stderr, done.stderr
        assert tables(folder) == before

    def rewrite(change):
        def apply(folder):
            content = bytearray((folder / "j.rst.h5").read_bytes())
            (folder / "j.rst.h5").write_bytes(change(content))

        return apply

    refused(rewrite(lambda content: content[: len(content) // 2]), "j.rst.h5")
    refused(rewrite(lambda content: b"rubbish"), "j.rst.h5")
    refused(lambda folder: None, "j.h5", path="j.h5")
    refused(lambda folder: (folder / "j_history.csv").unlink(), "j_history.csv")
    with h5py.File(tmp_path / "good" / "j.rst.h5") as file:  # a byte of a datum: there is empty space too
        at = file["last/ux"].id.get_chunk_info(0).byte_offset + 8
    refused(rewrite(lambda content: content[:at] + bytes([content[at] ^ 64]) + content[at + 1 :]), "damaged")
    refused(rewrite(lambda content: content + b"x"), "j.rst.h5")
    for edit in (edit_a_digit, edit_three_bytes):
        refused(edit, "j_history.csv: the ", " bytes that the checkpoint knows were changed since")
    for name in ("j_history.csv", "j.vtkhdf", "j_cracks.vtkhdf", "j.h5"):
        refused(lambda folder, name=name: os.truncate(folder / name, (folder / name).stat().st_size // 2), name)

"""Going on with the files of a run: its own alone, unchanged where they are refused; what they say afterwards."""

import os
import shutil
import signal
import subprocess
import time

import h5py
import pytest
import sealed
from rfem_run import PROGRAM, SOURCE, call, edited
from test_restart import assert_same, cut

BOX = SOURCE / "input" / "verification" / "shear_box" / "shear_box.inp"
SMALL = SOURCE / "tests" / "deck" / "good" / "output.inp"
OF_THE_END = ("exit_status", "wall_time", "digest_displacements", "digest_topology")


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def attributes(folder, job="j"):
    with h5py.File(folder / f"{job}.h5") as file:
        return dict(file["rfem"].attrs)


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    """A run of about a second with a checkpoint after each increment."""
    folder = tmp_path_factory.mktemp("deck")
    return edited(BOX, folder, ("*HEADING", "*RESTART, WRITE\n*HEADING"))


@pytest.fixture(scope="module")
def whole(deck, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    done = cut(0, deck, "--output", folder, "--job", "j", "--quiet")
    assert done.returncode == 0
    return done, folder


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interrupted")
    assert cut(200, SMALL, "--output", folder, "--job", "j", "--quiet").returncode == 4
    return folder


def running(deck, folder):
    """A run that has written its first two checkpoints and is held there."""
    run = subprocess.Popen(
        [PROGRAM, deck, "--output", folder, "--job", "j", "--quiet"],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    while not (folder / "j.rst.1.h5").exists() and run.poll() is None:
        time.sleep(0.001)
    os.kill(run.pid, signal.SIGSTOP)
    assert run.poll() is None
    return run


def held(run):
    """Let a run that is alive go on, and tell its exit status."""
    os.kill(run.pid, signal.SIGCONT)
    return run.wait(timeout=120)


def test_a_run_that_is_alive(deck, whole, tmp_path):
    """Neither gone on with nor replaced: no file of it is touched, and it comes to its end as if nothing had been."""
    out = tmp_path / "out"
    (tmp_path / "link").symlink_to(out)
    run = running(deck, out)
    (out / "j.rst.tmp.h5").write_bytes(b"half")
    before = bytes_of(out)
    for again in (
        ["--restart", out / "j.rst.h5"],
        ["--restart", out / "j.rst.1.h5"],
        [deck, "--output", out, "--job", "j"],
        [SMALL, "--output", tmp_path / "link", "--job", "j"],
    ):
        done = call(*again)
        assert done.returncode == 3, done.stderr
        assert "j_history.csv: is being written by another run, which has to end first" in done.stderr
        assert ("--job" in done.stderr) == ("--job" in again)
        assert bytes_of(out) == before
    assert held(run) == 0
    assert_same(out, whole[1])


def test_a_run_that_goes_on_is_alive_too(deck, whole, tmp_path):
    """Also a run that goes on from a checkpoint is not replaced; another name in the same folder is free."""
    out = tmp_path / "out"
    assert cut(400, deck, "--output", out, "--job", "j", "--quiet").returncode == 4
    first = (out / "j.rst.h5").stat().st_ino
    run = subprocess.Popen([PROGRAM, "--restart", out / "j.rst.h5", "--quiet"], stdout=subprocess.DEVNULL)
    while (out / "j.rst.h5").stat().st_ino == first and run.poll() is None:
        time.sleep(0.001)
    os.kill(run.pid, signal.SIGSTOP)
    before = bytes_of(out)
    done = call(deck, "--output", out, "--job", "j")
    after = bytes_of(out)
    other = call(SMALL, "--output", out, "--job", "k")
    assert held(run) == 0
    assert done.returncode == 3 and "is being written by another run" in done.stderr, done.stderr
    assert after == before
    assert other.returncode == 0
    for path in out.glob("k*"):
        path.unlink()
    assert_same(out, whole[1])


def test_a_run_that_is_dead_is_replaced(deck, tmp_path):
    """Killed, its lock is gone: all its files make way, also a history that may not be written or has a second name."""
    out, other = tmp_path / "out", tmp_path / "other"
    run = running(deck, out)
    run.kill()
    run.wait()
    history = (out / "j_history.csv").read_bytes()
    os.link(out / "j_history.csv", tmp_path / "kept.csv")
    (out / "j_history.csv").chmod(0o400)
    for folder in (out, other):
        assert call(SMALL, "--output", folder, "--job", "j", "--quiet").returncode == 0
    assert bytes_of(out).keys() == bytes_of(other).keys()
    assert_same(out, other)
    assert (tmp_path / "kept.csv").read_bytes() == history


def test_files_of_a_killed_run_stay_as_they_are(deck, whole, tmp_path):
    """A file that cannot be gone on with is found before the others lose the marks of a killed run."""
    run = running(deck, tmp_path / "out")
    run.kill()
    run.wait()
    for name in ("j_cracks.vtkhdf", "j_events.csv", "j.vtkhdf", "j.h5", "j_history.csv"):
        path = tmp_path / "out" / name
        content = path.read_bytes()
        path.write_bytes(content[: len(content) // 3])
        before = bytes_of(tmp_path / "out")
        done = call("--restart", tmp_path / "out" / "j.rst.h5")
        assert done.returncode == 3 and name in done.stderr, done.stderr
        assert bytes_of(tmp_path / "out") == before
        path.write_bytes(content)
    rest = cut(0, "--restart", tmp_path / "out" / "j.rst.h5", "--quiet")
    assert rest.returncode == 0 and rest.digests == whole[0].digests
    assert_same(tmp_path / "out", whole[1])


def test_another_run_of_the_same_name(interrupted, tmp_path):
    """The checkpoint of one run beside the results of another: refused, though they are long enough."""
    shutil.copytree(interrupted, tmp_path / "out")
    other = tmp_path / "other"
    assert cut(0, SMALL, "--output", other, "--job", "j", "--quiet").returncode == 0
    shutil.copy(interrupted / "j.rst.h5", other)
    before = bytes_of(other)
    done = call("--restart", other / "j.rst.h5")
    assert done.returncode == 3 and "j.h5: is of another run" in done.stderr, done.stderr
    assert bytes_of(other) == before
    assert call("--restart", tmp_path / "out" / "j.rst.h5").returncode == 0


def test_what_is_said_of_the_end(deck, interrupted, whole, tmp_path):
    """Of the end of a piece JOB.h5 tells as long as the run does not go on; digests are those of a result."""
    said = attributes(interrupted)
    assert said["exit_status"] == 4 and said["wall_time"] > 0
    assert not [name for name in said if name.startswith("digest")]
    # a second piece that is killed: nothing is said of an end
    out = tmp_path / "out"
    assert cut(400, deck, "--output", out, "--job", "j", "--quiet").returncode == 4
    assert attributes(out)["exit_status"] == 4
    first = (out / "j.rst.h5").stat().st_ino
    run = subprocess.Popen([PROGRAM, "--restart", out / "j.rst.h5", "--quiet"], stdout=subprocess.DEVNULL)
    while (out / "j.rst.h5").stat().st_ino == first and run.poll() is None:
        time.sleep(0.001)
    run.kill()
    assert run.wait() == -signal.SIGKILL
    copy = tmp_path / "copy"
    shutil.copytree(out, copy)
    subprocess.run(["h5clear", "-s", "--increment=0", copy / "j.h5"], check=False)
    with h5py.File(copy / "j.h5", "r") as file:
        said = dict(file["rfem"].attrs)
    assert said["restarts"] == 1 and not [name for name in OF_THE_END if name in said]
    # the last one says it
    rest = cut(0, "--restart", out / "j.rst.h5", "--quiet")
    said = attributes(out)
    assert said["exit_status"] == 0 and said["restarts"] == 2
    assert (said["digest_displacements"].decode(), said["digest_topology"].decode()) == rest.digests
    assert said["run_id"] != attributes(whole[1])["run_id"]


def test_half_checkpoints_are_cleared_away(interrupted, tmp_path):
    """What a run left that was killed while it wrote one: gone when the run goes on, or when another takes its name."""
    for again in (["--restart", "j.rst.h5"], [SMALL, "--job", "j"]):
        out = tmp_path / "out"
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(interrupted, out)
        for name in ("j.rst.tmp.h5", "j.rst.1.tmp.h5"):
            (out / name).write_bytes(b"half")
        assert call(*again, cwd=out).returncode == 0
        assert not list(out.glob("*.tmp.h5"))


def test_the_previous_one_outlives_a_damaged_one(deck, whole, tmp_path):
    """The run goes on from JOB.rst.1.h5, JOB.rst.h5 is damaged: the next one replaces that, not the good one."""
    out = tmp_path / "out"
    assert cut(800, deck, "--output", out, "--job", "j", "--quiet").returncode == 4
    good = (out / "j.rst.1.h5").read_bytes()
    content = (out / "j.rst.h5").read_bytes()
    (out / "j.rst.h5").write_bytes(content[:1000] + b"damaged" + content[1007:])
    assert call("--restart", out / "j.rst.h5").returncode == 3
    assert cut(1, "--restart", out / "j.rst.1.h5", "--quiet").returncode == 4
    assert (out / "j.rst.1.h5").read_bytes() == good
    assert cut(1, "--restart", out / "j.rst.h5", "--quiet").returncode == 4
    rest = cut(0, "--restart", out / "j.rst.h5", "--quiet")
    assert rest.digests == whole[0].digests
    assert_same(out, whole[1])


def test_a_model_too_large_for_this_machine(interrupted, tmp_path):
    """As with a deck: said before memory is used up, and nothing is written."""
    shutil.copytree(interrupted, tmp_path / "out")
    sealed.edit(tmp_path / "out" / "j.rst.h5", lambda file: file.attrs.modify("elements", 2_000_000_000))
    before = bytes_of(tmp_path / "out")
    done = call("--restart", tmp_path / "out" / "j.rst.h5")
    assert done.returncode == 2, done.stderr
    assert "j.rst.h5: a mesh of 2000000000 elements needs about 1400.0 GB of memory to be run" in done.stderr
    assert bytes_of(tmp_path / "out") == before


def test_another_build(interrupted, tmp_path):
    """Compiler and flags are remarked as the commit is, in the log and in JOB.h5, which tells of the first program."""
    shutil.copytree(interrupted, tmp_path / "out")
    assert "continued_by" not in attributes(tmp_path / "out")

    def rename(file):
        for name in ("compiler", "commit"):
            data = file["provenance"][name]
            data[...] = [ord("x")] * len(data)

    sealed.edit(tmp_path / "out" / "j.rst.h5", rename)
    done = call("--restart", tmp_path / "out" / "j.rst.h5")
    assert done.returncode == 0
    assert "note: the checkpoint was written by commit xxxx" in done.stdout and "; compiler xxxx" in done.stdout
    said = attributes(tmp_path / "out")
    assert said["continued_by"].decode().startswith("from restart 1 on: commit ")


def test_another_version(interrupted, tmp_path):
    """It is refused for being one, whatever else it has or has not."""

    def rename(file):
        file["version"][...] = [ord("9")] * len(file["version"])
        del file["provenance"]["host"]
        file.attrs.modify("format", 99)

    shutil.copytree(interrupted, tmp_path / "out")
    sealed.edit(tmp_path / "out" / "j.rst.h5", rename)
    done = call("--restart", tmp_path / "out" / "j.rst.h5")
    assert done.returncode == 3 and "j.rst.h5: was written by rfem 99999; this is rfem " in done.stderr, done.stderr

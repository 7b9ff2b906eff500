"""A disk that does not take a checkpoint: the run ends with exit status 3, says which file and why, and keeps what it
has written; the checkpoint before that is a whole one, from which the run goes on as if nothing had been.
"""

import os
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest
from kept_results import assert_kept
from rfem_run import PROGRAM, SOURCE, call

BEAM = SOURCE / "input" / "paper" / "three_point_bending.inp"
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1"}


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    """The paper's beam, coarse, with a checkpoint after each increment."""
    path = tmp_path_factory.mktemp("deck") / "j.inp"
    text = BEAM.read_text().replace("INPUT=mesh/", f"INPUT={BEAM.parent}/mesh/").replace("\nH = 2\n", "\nH = 8\n")
    assert "\nH = 8\n" in text
    path.write_text(text.replace("*END STEP", "*RESTART, WRITE\n*END STEP"))
    return path


@pytest.fixture(scope="module")
def whole(deck, tmp_path_factory):
    """The run that nothing disturbs: its folder, and the digests of its log."""
    folder = tmp_path_factory.mktemp("whole")
    done = call(deck, "--output", folder, "--quiet")
    assert done.returncode == 0
    return folder, digests(done.stdout)


def digests(log):
    return re.findall(r"digest .*", log)[-1:]


def goes_on(folder, whole):
    """From the checkpoint in this folder the run comes to the same end."""
    done = call("--restart", folder / "j.rst.h5", "--quiet")
    assert done.returncode == 0, done.stderr
    assert digests(done.stdout) == whole[1] != []
    for name in ("j_history.csv", "j_events.csv"):
        assert (folder / name).read_bytes() == (whole[0] / name).read_bytes()


@pytest.mark.parametrize("kilobytes", [1900, 2600, 3500])
def test_full_disk(kilobytes, deck, whole, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", disk]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("mounting a small disk needs root")
    try:
        done = call(deck, "--output", disk / "out", "--quiet")
        left = sorted(os.listdir(disk / "out"))
        shutil.copytree(disk / "out", tmp_path / "out")
    finally:
        subprocess.run(["umount", disk], check=True)
    assert done.returncode == 3
    assert re.search(rf"^rfem: error: {disk}/out/j\S*: .*No space left on device", done.stderr, re.M), done.stderr
    assert "rfem: note: the results up to there are kept; the last checkpoint is" in done.stderr
    assert not [name for name in left if ".tmp." in name], "no half checkpoint"
    rows, frames = assert_kept(tmp_path / "out", whole[0], "j")
    assert rows > 1 and frames > 0
    goes_on(tmp_path / "out", whole)


def test_limit_on_file_sizes(deck, whole, tmp_path):
    """ulimit -f, as a quota, fails the first checkpoint; the results are smaller."""

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))

    done = call(deck, "--output", tmp_path / "out", "--quiet", preexec_fn=limit)
    assert done.returncode == 3
    assert re.search(r"^rfem: error: \S*j\.rst\.tmp\.h5: .*File too large", done.stderr, re.M), done.stderr
    assert "the results up to there are kept" in done.stderr
    assert not [name for name in os.listdir(tmp_path / "out") if "rst" in name]
    assert assert_kept(tmp_path / "out", whole[0], "j")[0] > 1


def started(deck, folder, **options):
    """A run that has written its first checkpoint."""
    run = subprocess.Popen(
        [PROGRAM, deck, "--output", folder, "--quiet"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        **options,
    )
    while not (folder / "j.rst.h5").exists() and run.poll() is None:
        time.sleep(0.002)
    return run


def test_folder_moved(deck, whole, tmp_path):
    run = started(deck, tmp_path / "out")
    os.rename(tmp_path / "out", tmp_path / "elsewhere")
    messages = run.communicate(timeout=120)[1]
    assert run.returncode == 3, messages
    assert re.search(r"^rfem: error: .*out/j\S*: .*No such file or directory", messages, re.M), messages
    assert_kept(tmp_path / "elsewhere", whole[0], "j")
    goes_on(tmp_path / "elsewhere", whole)


def nobody():
    os.setgid(65534)
    os.setuid(65534)


@pytest.fixture
def as_nobody(deck):
    """A deck, a folder, and options to run the program as somebody for whom permissions count; else skip.

    Not below pytest's own folder: every session of pytest closes that to others.
    """
    place = Path(tempfile.mkdtemp(prefix="rfem_nobody_"))
    place.chmod(0o755)
    shutil.copy(deck, place / "j.inp")
    (place / "out").mkdir()
    options = {}
    if os.geteuid() == 0:
        os.chown(place / "out", 65534, 65534)
        options["preexec_fn"] = nobody
    try:
        check = subprocess.run([PROGRAM, place / "j.inp", "--check"], capture_output=True, check=False, **options)
        reason = check.returncode
    except (PermissionError, subprocess.SubprocessError):
        reason = 1
    if not reason:
        yield place / "j.inp", place / "out", options
    shutil.rmtree(place, ignore_errors=True)
    if reason:
        pytest.skip("the folders of the program and of the project are not open to another user")


def test_folder_becomes_read_only(as_nobody, whole, tmp_path):
    """Files that are open go on; the next checkpoint cannot be made, the last one stays."""
    deck, folder, options = as_nobody
    run = started(deck, folder, **options)
    os.kill(run.pid, signal.SIGSTOP)
    folder.chmod(0o555)
    os.kill(run.pid, signal.SIGCONT)
    messages = run.communicate(timeout=120)[1]
    folder.chmod(0o755)
    assert run.returncode == 3, messages
    assert re.search(r"^rfem: error: .*out/j\S*: .*Permission denied", messages, re.M), messages
    assert (folder / "j.rst.h5").exists()
    shutil.copytree(folder, tmp_path / "mine")
    goes_on(tmp_path / "mine", whole)


def test_a_file_that_may_not_be_written(as_nobody, whole):
    """One file cannot be gone on with, which is seen when others are open: those are closed, and nothing is lost."""
    deck, folder, options = as_nobody
    run = started(deck, folder, **options)
    run.send_signal(signal.SIGTERM)
    messages = run.communicate(timeout=120)[1]
    assert run.returncode == 4, messages
    (folder / "j_cracks.vtkhdf").chmod(0o444)
    done = call("--restart", folder / "j.rst.h5", "--quiet", **options)
    assert done.returncode == 3
    assert re.search(r"^rfem: error: \S*out/j_cracks.vtkhdf: .*Permission denied", done.stderr, re.M), done.stderr
    (folder / "j_cracks.vtkhdf").chmod(0o644)
    rows, frames = assert_kept(folder, whole[0], "j")
    assert rows > 1 and frames > 0
    goes_on(folder, whole)


FAILING_FSYNC = """
#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>
int fsync(int descriptor) {
   struct stat found;
   fstat(descriptor, &found);
   if (S_ISDIR(found.st_mode) != (getenv("FAIL_AT")[0] == 'd')) return 0;
   errno = atoi(getenv("FAIL_AT") + 1);
   return -1;
}
"""


@pytest.fixture(scope="module")
def failing_fsync(tmp_path_factory):
    """A library whose fsync fails: of files (f) or folders (d), with an error of this number."""
    folder = tmp_path_factory.mktemp("fsync")
    (folder / "fsync.c").write_text(FAILING_FSYNC)
    compiler = shutil.which("gcc") or shutil.which("cc")
    made = (
        compiler
        and not subprocess.run(
            [compiler, "-shared", "-fPIC", "-o", folder / "fsync.so", folder / "fsync.c"], check=False
        ).returncode
    )
    if not made:
        pytest.skip("there is no C compiler")
    return folder / "fsync.so"


@pytest.mark.parametrize(
    "fail_at, reason",
    [
        ("f5", r"\S*out/j\S*: .*Input/output error"),
        ("d5", r"\S*j\.rst\.h5: its name cannot be written to the disk: Input/output error"),
        ("d22", ""),
    ],
)
def test_a_disk_that_fails(fail_at, reason, deck, whole, failing_fsync, tmp_path, monkeypatch):
    """Nothing is taken for written that is not on the disk; a folder that cannot be brought there is no fault."""
    monkeypatch.setenv("LD_PRELOAD", str(failing_fsync))
    monkeypatch.setenv("FAIL_AT", fail_at)
    done = call(deck, "--output", tmp_path / "out", "--quiet")
    monkeypatch.delenv("LD_PRELOAD")
    if not reason:
        assert done.returncode == 0
        return
    assert done.returncode == 3
    assert re.search(rf"^rfem: error: {reason}", done.stderr, re.M), done.stderr
    assert_kept(tmp_path / "out", whole[0], "j")

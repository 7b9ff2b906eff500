"""A disk that does not take a checkpoint: the run ends with exit status 3, says which file and why, and keeps what it
has written; the checkpoint before that is a whole one, from which the run goes on as if nothing had been.
"""

import os
import re
import resource
import shutil
import subprocess
import time

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


def test_folder_becomes_read_only(deck, whole, tmp_path):
    """Files that are open go on; the next checkpoint cannot be made, the last one stays."""
    folder = tmp_path / "out"
    folder.mkdir()
    options = {}
    if os.geteuid() == 0:
        for place in (tmp_path, *tmp_path.parents, deck.parent):
            if place.owner() == "root" and "pytest" in str(place):
                place.chmod(0o755)
        os.chown(folder, 65534, 65534)
        options["preexec_fn"] = nobody
    try:
        run = started(deck, folder, **options)
    except (PermissionError, subprocess.SubprocessError):
        pytest.skip("the program's folder is not open to another user")
    folder.chmod(0o555)
    messages = run.communicate(timeout=120)[1]
    folder.chmod(0o755)
    if run.returncode in (2, 0):
        pytest.skip("the project's folder is not open to another user, or the run was over")
    assert run.returncode == 3, messages
    assert re.search(r"^rfem: error: .*out/j\S*: .*Permission denied", messages, re.M), messages
    assert (folder / "j.rst.h5").exists()
    shutil.copytree(folder, tmp_path / "mine")
    goes_on(tmp_path / "mine", whole)

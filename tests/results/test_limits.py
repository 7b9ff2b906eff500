"""Input larger than anything: a clear error, or it works; nothing is stored on disk for these tests."""

import os
import re
import resource
import subprocess
import threading

import pytest
from rfem_run import CRASH, PROGRAM, call

DECK = """*MESH, SHAPE=RECTANGLE, ELSET=PLATE, PATTERN=DIAGONAL
0., 0., 1., 1., {nx}, {ny}
*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*SOLID SECTION, ELSET=PLATE, MATERIAL=ROCK
*BOUNDARY
LEFT, 1, 2
*STEP
*STATIC
*BOUNDARY
RIGHT, 1, 1, 0.001
*END STEP
"""
GIGABYTE = 1_000_000_000


def deck(folder, nx, ny):
    path = folder / "deck.inp"
    path.write_text(DECK.format(nx=nx, ny=ny))
    return path


def with_memory(limit):
    return {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit))}


def without_sanitizer():
    if "sanitize" in call("--version").stdout:
        pytest.skip("the address sanitizer takes terabytes of address space for itself")


def test_ten_million_elements_where_there_is_memory(tmp_path):
    """Declared in four lines: allowed, if the machine can."""
    done = call("--check", deck(tmp_path, 2000, 2500))
    if done.returncode == 2 and "GB are available" in done.stderr:
        pytest.skip("this machine has too little memory")
    assert done.returncode == 0 and "10000000 elements" in done.stdout


def test_more_elements_than_memory(tmp_path):
    without_sanitizer()
    done = call(deck(tmp_path, 2000, 2500), cwd=tmp_path, **with_memory(1_500_000_000))
    assert done.returncode == 2
    assert re.search(
        r"^rfem: error: \S*deck\.inp:1: a mesh of 10000000 elements needs about 2\.5 GB of memory to be read; "
        r"[01]\.\d GB are available$",
        done.stderr,
        re.M,
    ), done.stderr
    assert os.listdir(tmp_path) == ["deck.inp"]


def test_enough_to_read_but_not_to_run(tmp_path):
    without_sanitizer()
    path = deck(tmp_path, 500, 1000)
    limits = with_memory(600_000_000)
    assert call("--check", path, **limits).returncode == 0
    done = call(path, cwd=tmp_path, **limits)
    assert done.returncode == 2 and "needs about 0.7 GB of memory to be run; 0." in done.stderr
    assert os.listdir(tmp_path) == ["deck.inp"]


def test_more_elements_than_numbers(tmp_path):
    done = call("--check", deck(tmp_path, 100_000, 100_000))
    assert done.returncode == 2
    assert "deck.inp:1: a mesh of 20000000000 elements is too large: at most 500000000" in done.stderr


def piped(byte, count, line=b""):
    """The program's answer to so many equal bytes on standard input."""
    process = subprocess.Popen(
        [PROGRAM, "--check"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )

    def feed():
        block = byte * 1_000_000
        try:
            process.stdin.write(line)
            for _ in range(count // len(block)):
                process.stdin.write(block)
            process.stdin.close()
        except BrokenPipeError:
            pass

    feeder = threading.Thread(target=feed)
    feeder.start()
    stderr = process.stderr.read().decode(errors="replace")
    assert process.wait(timeout=300) == 2 and not CRASH.search(stderr)
    feeder.join()
    return stderr


@pytest.mark.parametrize(
    "byte, count, words",
    [
        (b"x", GIGABYTE, "<stdin>:2: the line has 1000000000 characters, at most 2000 are allowed"),
        (b"\0", GIGABYTE, "<stdin>:2: a zero byte: this is no text file"),
        (b"\n", 1_100_000_000, "the deck <stdin> is too large: at most 1073741823 bytes can be read"),
    ],
)
def test_a_gigabyte(byte, count, words):
    stderr = piped(byte, count, line=b"*HEADING\n")
    assert words in stderr and len(stderr) < 5000, stderr[:2000]


def test_a_file_without_end(tmp_path):
    for path in ("/dev/zero", "/dev/urandom"):
        done = call("--check", path)
        assert done.returncode == 2 and f"the deck {path} is too large" in done.stderr
        (tmp_path / "deck.inp").write_text(f"*INCLUDE, INPUT={path}\n")
        done = call("--check", tmp_path / "deck.inp")
        assert done.returncode == 2 and f"the included file {path} is too large" in done.stderr


def test_the_program_itself_as_a_deck():
    done = call("--check", PROGRAM, errors="replace")
    assert done.returncode == 2 and "a zero byte: this is no text file" in done.stderr

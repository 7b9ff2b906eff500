"""A few mutations of every kind, and the fuzzer's own eyes: it must see what it is there to see."""

import os
import random
import stat
from types import SimpleNamespace

import fuzz
import pytest
from mutate import MUTATIONS

RUNS = 200
SEEDS = fuzz.load_seeds()


@pytest.fixture
def checks_only(monkeypatch):
    """A build that stops at an overflow where it happens is asked for its opinion of decks only."""
    from rfem_run import call

    if "-ffpe-trap" in call("--version").stdout:
        monkeypatch.setattr(fuzz, "MODES", ("--check",))


def test_some_mutations(checks_only, tmp_path, capsys):
    options = SimpleNamespace(runs=RUNS, seed="smoke", first=0, seconds=240, most=3, direct=False, output=tmp_path)
    failed = fuzz.campaign(options)
    assert not failed, capsys.readouterr().out


def test_runs_are_reproducible():
    assert len(SEEDS) > 30 and any(len(files) > 1 for files in SEEDS.values())
    for number in range(50):
        assert fuzz.make_case(SEEDS, "1", number) == fuzz.make_case(SEEDS, "1", number)
    assert fuzz.make_case(SEEDS, "1", 0) != fuzz.make_case(SEEDS, "2", 0)


@pytest.mark.parametrize("mutation", sorted(set(MUTATIONS), key=lambda f: f.__name__), ids=lambda f: f.__name__)
def test_every_mutation_changes_something_and_bears_anything(mutation):
    text = SEEDS["input/tutorial/first_deck/first_deck.inp"]["deck.inp"]
    state = random.Random(1)
    assert any(mutation(state, text, [text]) != text for _ in range(20))
    for odd in (b"", b"\n", b"\n\n", b",", b"*", b"\0\xff", b"*PARAMETER\nA = 1e400\n"):
        for _ in range(5):
            assert isinstance(mutation(state, odd, [odd, text]), bytes)


def program(folder, script):
    path = folder / "program"
    path.write_text("#!/bin/sh\n" + script)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


@pytest.mark.parametrize(
    "script, seen",
    [
        ("kill -SEGV $$", "exit status -11"),
        ("exit 7", "exit status 7"),
        ("exit 2", "exit status 2 without a message"),
        ("echo 'rfem: error: x' >&2; touch x.h5; exit 2", "files left behind with exit status 2"),
        ("echo 'rfem: error: x' >&2; echo 'Fortran runtime error: y' >&2; exit 2", "crash: Fortran runtime error "),
        ("echo '==1==ERROR: AddressSanitizer: heap' >&2; exit 1", "crash: Sanitizer "),
        ("echo 'rfem: error: x' >&2; exit 0", "an error and exit status 0"),
        ("printf 'rfem: error: \\033[2J' >&2; exit 2", "control characters in a message"),
        ("exit 0", "exit status 0 without results"),
        ("while :; do :; done", "no end"),
        ("echo 'rfem: error: x' >&2; exit 2", ""),
        ("mkdir out; touch out/x.h5", ""),
    ],
)
def test_what_the_fuzzer_sees(script, seen, tmp_path, monkeypatch):
    monkeypatch.setattr(fuzz, "PROGRAM", program(tmp_path, script))
    monkeypatch.setattr(fuzz, "SECONDS", 1)
    assert fuzz.check(fuzz.Case({"deck.inp": b"x\n"}, "")) == seen


def test_a_failing_case_is_made_small_and_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(fuzz, "PROGRAM", program(tmp_path, "grep -q boom decks/deck.inp && kill -SEGV $$; exit 2"))
    lines = [b"line %d" % i for i in range(40)]
    case = fuzz.Case({"deck.inp": b"\n".join([*lines, b"boom", *lines]), "mesh.inp": b"1\n"}, "--check", "seed.inp")
    assert fuzz.check(case) == "exit status -11"
    folder = fuzz.keep(case, 17, "5", tmp_path / "kept")
    assert (folder / "decks" / "deck.inp").read_bytes() == b"boom"
    assert os.listdir(folder / "decks") == ["deck.inp"], "the file that does not matter is left out"
    assert b"line 39" in (folder / "as_found" / "decks" / "deck.inp").read_bytes()
    assert "seed 5, run 17" in (folder / "report.txt").read_text()

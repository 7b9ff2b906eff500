"""./run property: what fails is told with its smallest prefix, and with the attempts that are enough."""

import stat

import property as sequences
import pytest

# fails at attempt 20 of seed 7 if attempts 3 and 11 were made, in words with numbers that differ; seed 9 crashes at 5
PROGRAM = """#!/usr/bin/env python3
import sys
words = [word for word in sys.argv[1:] if word != "--trace"]
options = dict(zip(words[::2], words[1::2]))
first, runs = int(options["--seed"]), int(options.get("--runs", 1))
ranges = [tuple(map(int, (part.split("-") * 2)[:2])) for part in options.get("--only", "1-40").split(",")]
for seed in range(first, first + runs):
    made = [k for k in range(1, 41) if any(a <= k <= b for a, b in ranges)]
    for k in made:
        if "--trace" in sys.argv:
            print(f"seed {seed}, attempt {k}", file=sys.stderr)
        if seed == 7 and k == 20 and 3 in made and 11 in made:
            event = made.index(k) + 1
            print(f"random_events: seed 7, attempt 20, event {event}: area {len(made)}.5E-3", file=sys.stderr)
            sys.exit(1)
        if seed == 9 and k == 5:
            sys.exit(139)
print(f"{40 * runs} random events in {runs} sequences")
"""


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "random_events"
    path.write_text(PROGRAM)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def test_the_smallest_set_of_attempts(program, capsys):
    assert sequences.run_chunk(program, 6, 3) == ([7], [[40, 1]])
    said = capsys.readouterr().out
    assert "smallest prefix: attempts 1 to 20; of these 3 are enough, with 3 events" in said
    assert f"{program} --seed 7 --only 3,11,20" in said


def test_a_crash(program, capsys):
    failed, _ = sequences.run_chunk(program, 8, 2)
    assert failed == [9]
    said = capsys.readouterr().out
    assert "smallest prefix: attempts 1 to 5; of these 1 are enough" in said
    assert f"{program} --seed 9 --only 5" in said


def test_nothing_fails(program, capsys):
    assert sequences.run_chunk(program, 1, 6) == ([], [[240, 6]])
    assert not capsys.readouterr().out


def test_ranges():
    assert sequences.as_ranges([1, 2, 3, 7, 9, 10]) == "1-3,7,9-10"
    assert sequences.as_ranges([]) == "0"

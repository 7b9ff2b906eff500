"""Some mutated checkpoints and results, and the mutations themselves."""

import random
from types import SimpleNamespace

import fuzz_restart
import pytest
import sealed

RUNS = 60
WHAT = {"bytes", "sealed bytes", "structure", "forged", "results", "exchanged", "missing"}


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    return fuzz_restart.make_seeds(tmp_path_factory.mktemp("seeds"))


def test_some_mutations(tmp_path, capsys):
    options = SimpleNamespace(runs=RUNS, seed="smoke", first=0, seconds=240, most=3, direct=False, output=tmp_path)
    assert not fuzz_restart.campaign(options), capsys.readouterr().out


def test_the_checksum_is_the_programs(seeds):
    for files in seeds.values():
        content = files[fuzz_restart.CHECKPOINT]
        assert sealed.sealed(fuzz_restart.body_of(content)) == content


def test_runs_are_reproducible(seeds):
    seen = set()
    for number in range(60):
        runs = [fuzz_restart.mutated(random.Random(f"1:{number}"), seeds) for _ in range(2)]
        assert runs[0][:2] == runs[1][:2] and runs[0][2].keys() == runs[1][2].keys()
        seen.add(runs[0][1])
    assert seen == WHAT

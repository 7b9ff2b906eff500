"""A few trials of kill.py: kill -9 at random moments, up to three times a run. ./run kill does 30."""

import kill
import pytest

TRIALS = 4


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    return kill.Trials(tmp_path_factory.mktemp("kill"))


@pytest.mark.parametrize("number", range(TRIALS))
def test_kill(number, trials):
    trials.trial(number, seed="test")

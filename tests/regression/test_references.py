"""The paper's decks against the references beside them (input/paper/reference); update.py alone rewrites those."""

import pytest
from cases import CASES, compute, difference, measure, reference


@pytest.mark.parametrize("name", CASES)
def test_reference(name, tmp_path):
    stored = reference(name)
    assert stored["reason_of_last_change"] and stored["origin"]["date"], "a reference says where it comes from"
    assert stored["deck"] == CASES[name].deck and stored["arguments"] == CASES[name].arguments
    found = measure(name, compute(name, tmp_path))
    assert set(found) == set(stored["quantities"]), "update.py must be run"
    wrong = []
    for key, quantity in stored["quantities"].items():
        assert quantity["reason"], "a tolerance has a reason"
        far, allowed = difference(quantity, found[key], found["peak_load"])
        if not far <= allowed:
            wrong.append(f"{key}: {found[key]}, reference {quantity['value']}: {far:.3g}, allowed {allowed:g}")
    assert not wrong, "\n".join(wrong)

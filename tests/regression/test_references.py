"""The paper's decks against the references beside them (input/paper/reference), which ./run regression rewrites."""

import json

import pytest
import regression
from cases import CASES, REFERENCES, compute, kept, reference
from rfem_compare import compare_with_reference


@pytest.mark.parametrize("name", CASES)
def test_reference(name, tmp_path):
    stored = reference(name)
    assert stored["reason_of_last_change"] and stored["origin"]["date"], "a reference says where it comes from"
    assert stored["deck"] == CASES[name].deck and stored["arguments"] == CASES[name].arguments
    found = kept(name, compute(name, tmp_path))
    assert set(found) == set(stored["quantities"]), "the reference must be updated"
    done = compare_with_reference(stored, found)
    assert done.quantities == len(found)
    assert not done.differences, "\n".join(map(str, done.differences))


def test_every_reference_has_its_case():
    assert sorted(path.stem for path in REFERENCES.glob("*.json")) == sorted(CASES)


@pytest.mark.parametrize("why", [[], ["--why", ""], ["--why", "better now"], ["--why", "a b c d e"]])
def test_no_update_without_a_reason(why, capsys):
    before = (REFERENCES / "beam_h8.json").read_text()
    with pytest.raises(SystemExit) as end:
        regression.main(["--update", "beam_h8", *why])
    assert end.value.code == 2
    assert "--why" in capsys.readouterr().err
    assert (REFERENCES / "beam_h8.json").read_text() == before


def test_a_reason_without_an_update_is_refused():
    with pytest.raises(SystemExit) as end:
        regression.main(["--why", "a reason for nothing at all"])
    assert end.value.code == 2


def test_update(tmp_path, monkeypatch, capsys):
    """The new value, the old tolerances, the reason; and what differed is shown."""
    old = json.loads((REFERENCES / "beam_h8.json").read_text())
    old["quantities"]["peak_load"] |= {"value": 100.0, "tolerance": 0.123, "reason": "kept"}
    (tmp_path / "beam_h8.json").write_text(json.dumps(old))
    monkeypatch.setattr(regression, "REFERENCES", tmp_path)
    monkeypatch.setattr("cases.REFERENCES", tmp_path)
    assert regression.main(["beam_h8"]) == 0, "7 % is within the tolerance that the reference has"
    assert regression.main(["--update", "beam_h8", "--why", "the test puts a wrong value right"]) == 0
    new = json.loads((tmp_path / "beam_h8.json").read_text())
    assert new["reason_of_last_change"] == "the test puts a wrong value right"
    peak = new["quantities"]["peak_load"]
    assert peak["value"] == pytest.approx(107.132, rel=1e-3) and peak["tolerance"] == 0.123 and peak["reason"] == "kept"
    assert "peak_load: 100.0 becomes 107." in capsys.readouterr().out
    new["quantities"]["crack_length"]["value"] *= 2
    (tmp_path / "beam_h8.json").write_text(json.dumps(new))
    assert regression.main(["beam_h8"]) == 1
    assert "differs: crack_length" in capsys.readouterr().out

"""Comparing two result sets: what is seen, what is allowed, what is said."""

import csv
import json
import shutil

import pytest

import rfem_compare
from rfem_results import HISTORY_COLUMNS, open_results


@pytest.fixture
def copy(beam_directory, tmp_path):
    """A copy of the synthetic beam's tables as text, and a function that changes a value of them."""
    for name in ("beam_history.csv", "beam_events.csv"):
        shutil.copy(beam_directory / name, tmp_path / name)

    def change(table, column, row, change):
        path = tmp_path / f"beam_{table}.csv"
        with path.open(newline="") as file:
            rows = list(csv.reader(file))
        place = rows[0].index(column)
        row = row if row >= 0 else len(rows) - 1 + row
        rows[1 + row][place] = repr(change(float(rows[1 + row][place])))
        with path.open("w", newline="") as file:
            csv.writer(file).writerows(rows)

    return tmp_path / "beam", change


def compare(one, two, tolerance=None, capsys=None):
    status = rfem_compare.main([str(one), str(two), *(["--tolerance", str(tolerance)] if tolerance else [])])
    out, err = capsys.readouterr()
    return status, out, err


def test_a_run_is_equal_to_itself(beam_directory, capsys):
    status, out, err = compare(beam_directory / "beam", beam_directory / "beam", capsys=capsys)
    assert (status, err) == (0, "") and out.startswith("equal within the tolerances")


def test_another_mesh_and_more_events(copy, beam_directory, capsys):
    job, change = copy
    change("history", "nodes", 0, lambda value: value + 1)
    change("history", "event_count", -1, lambda value: value + 3)
    status, out, _ = compare(beam_directory / "beam", job, capsys=capsys)
    assert status == 1 and "differs: nodes: " in out and "differs: events: " in out
    assert "differs: history column nodes, row 0" in out and out.splitlines()[-1].startswith("different: ")


def test_a_column_before_the_first_event(copy, beam_directory, capsys):
    job, change = copy
    with open_results(beam_directory / "beam") as results:
        monitor = results.monitors[0]
        assert results.history["event_count"][1] == 0
    change("history", f"{monitor}_rf2", 1, lambda value: value * (1 + 1e-8) + 0.0)
    assert compare(beam_directory / "beam", job, capsys=capsys)[0] == 0
    change("history", f"{monitor}_u2", 1, lambda value: value * 1.01 + 1e-3)
    status, out, _ = compare(beam_directory / "beam", job, capsys=capsys)
    assert status == 1
    (line,) = [line for line in out.splitlines() if f"history column {monitor}_u2" in line]
    assert (
        ", row 1 (step 1, increment" in line
        and "before.monitor_u" in line
        and "allowed 1e-06 relative" in line
    )


def test_an_integral_after_it(copy, beam_directory, tmp_path, capsys):
    job, change = copy
    change("history", "crack_length", -1, lambda value: value * 1.05)
    assert compare(beam_directory / "beam", job, capsys=capsys)[0] == 0
    change("history", "crack_length", -1, lambda value: value * 1.2)
    status, out, _ = compare(beam_directory / "beam", job, capsys=capsys)
    assert (
        status == 1 and "differs: crack_length: " in out and "(after.crack_length: follows the number" in out
    )
    own = tmp_path / "own.json"
    own.write_text(json.dumps({"after": {"crack_length": {"tolerance": 0.5, "reason": "a test"}}}))
    assert compare(beam_directory / "beam", job, own, capsys)[0] == 0
    own.write_text(json.dumps({"after": {"crack_length": "ignore"}}))
    assert compare(beam_directory / "beam", job, own, capsys)[0] == 0


def test_every_column_has_a_family():
    """A new column of the history is compared; one whose family is not told is compared tightly."""
    assert not [name for name in HISTORY_COLUMNS if rfem_compare.family_of(name) == "other"]
    assert rfem_compare.family_of("something_new") == "other"
    assert set(rfem_compare.FAMILY.values()) | set(rfem_compare.SUFFIX_FAMILY.values()) <= set(
        rfem_compare.BEFORE
    )


def test_nan_differs(copy, beam_directory, capsys):
    job, change = copy
    change("history", "external_work", -1, lambda _: float("nan"))
    assert compare(beam_directory / "beam", job, capsys=capsys)[0] == 1


def test_the_printed_tolerances_are_a_tolerance_file(beam_directory, tmp_path, capsys):
    assert rfem_compare.main(["--tolerances"]) == 0
    path = tmp_path / "usual.json"
    path.write_text(capsys.readouterr().out)
    assert rfem_compare.read_tolerances(path) == rfem_compare.usual_tolerances()
    assert compare(beam_directory / "beam", beam_directory / "beam", path, capsys)[0] == 0


@pytest.mark.parametrize(
    "content, words",
    [
        ("{", "is no JSON"),
        ("[]", "must hold an object"),
        ('{"befor": {}}', "neither 'before' nor 'after'"),
        ('{"after": 1}', "must hold names"),
        ('{"after": {"crack_lenght": "ignore"}}', "did you mean crack_length?"),
        ('{"after": {"events": 3}}', "'ignore' or have tolerance"),
        ('{"after": {"events": {"tolerance": -1}}}', "must be a number from 0"),
        ('{"after": {"events": {"tolerance": NaN}}}', "must be a number from 0"),
        ('{"after": {"events": {"tolerance": 1, "kind": "about"}}}', "kind of events must be one of"),
    ],
)
def test_wrong_tolerance_files(content, words, beam_directory, tmp_path, capsys):
    path = tmp_path / "wrong.json"
    path.write_text(content)
    status, out, err = compare(beam_directory / "beam", beam_directory / "beam", path, capsys)
    assert status == 2 and not out and err.startswith("rfem_compare: error: ") and words in err


def test_wrong_usage(beam_directory, tmp_path, capsys):
    assert rfem_compare.main([str(beam_directory / "beam")]) == 2
    assert rfem_compare.main([str(beam_directory / "beam"), str(tmp_path / "nothing")]) == 2
    with pytest.raises(SystemExit) as end:
        rfem_compare.main(["--nothing"])
    assert end.value.code == 2
    reference = tmp_path / "reference.json"
    reference.write_text('{"quantities": {"events": {"value": 1, "tolerance": 0, "kind": "absolute"}}}')
    assert rfem_compare.main([str(reference), str(beam_directory / "beam")]) == 2
    assert "is no reference" in capsys.readouterr().err.splitlines()[-1]


def test_a_reference_must_give_reasons(tmp_path):
    path = tmp_path / "reference.json"
    content = {
        "origin": {"date": "today"},
        "reason_of_last_change": "it is the first",
        "quantities": {"events": {"value": 1, "tolerance": 0, "kind": "absolute"}},
    }
    path.write_text(json.dumps(content))
    with pytest.raises(
        rfem_compare.ResultsError, match="events needs a value, a tolerance, a kind and a reason"
    ):
        rfem_compare.read_reference(path)
    content["quantities"]["events"]["reason"] = "counted"
    path.write_text(json.dumps(content))
    found = rfem_compare.compare_with_reference(rfem_compare.read_reference(path), {"events": 1})
    assert not found.differences
    found = rfem_compare.compare_with_reference(rfem_compare.read_reference(path), {"events": 2})
    assert "events: 1 and 2, 1 apart, allowed 0 absolute (after.events: counted)" in str(found.differences[0])

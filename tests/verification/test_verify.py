"""The library and the runner of the verification suite: what passes, what fails, what is known to fail."""

import json
import math
import os
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))
import rfem_verify
import verify_report
import verify_suite
from rfem_verify import Case, VerifyError, observed_order


@pytest.fixture
def case(tmp_path):
    return Case(tmp_path / "demo", tmp_path)


def passed(case):
    return [row["passed"] for row in case.rows]


def test_values_pass_up_to_the_tolerance(case):
    case.value("inside", 101.9, 100, tolerance=0.02, kind="exact", unit="MPa")
    case.value("outside", 102.1, 100, tolerance=0.02, kind="exact")
    case.value("absolute", 1e-3, 0, tolerance=1e-2, kind="exact", absolute=True, unit="mm")
    assert passed(case) == [True, False, True]
    assert case.rows[0]["error"] == "1.9 %" and case.rows[0]["tolerance"] == "2 %"
    assert case.rows[2]["error"] == "0.001 mm"
    with pytest.raises(VerifyError, match="not 0"):
        case.value("relative to nothing", 1e-3, 0, tolerance=1e-2, kind="exact")


def test_bounds(case):
    case.at_most("small", 1.0, 1.0, kind="exact")
    case.at_most("large", 1.1, 1.0, kind="exact")
    case.at_least("steep", 0.9, 0.8, kind="exact")
    case.within("between", 5.0, 4.0, 6.0, kind="trend")
    case.within("beyond", 7.0, 4.0, 6.0, kind="trend")
    case.equal("word", "shear", "shear")
    case.equal("other word", "shear", "tension")
    assert passed(case) == [True, False, True, True, False, True, False]


@pytest.mark.parametrize("nothing", [math.nan, math.inf])
def test_what_is_no_number_never_passes(case, nothing):
    case.value("value", nothing, 1.0, tolerance=0.5, kind="exact")
    case.value("absolute", nothing, 1.0, tolerance=0.5, kind="exact", absolute=True)
    case.at_most("at most", nothing, 1.0, kind="exact")
    case.within("within", nothing, 0.0, 1.0, kind="exact")
    case.order("order", [4, 2, 1], [1.0, nothing, 0.1], at_least=-10)
    assert not any(passed(case))


def test_nan_is_not_at_least(case):
    case.at_least("at least", math.nan, -1e300, kind="exact")
    assert passed(case) == [False]


def test_one_name_one_row(case):
    case.at_most("small", 1.0, 1.0, kind="exact")
    with pytest.raises(VerifyError, match="two rows"):
        case.at_most("small", 1.0, 1.0, kind="exact")
    with pytest.raises(VerifyError, match="kind 'guess'"):
        case.at_most("guessed", 1.0, 1.0, kind="guess")


def test_order_of_errors(case):
    assert observed_order([8, 4, 2], [64, 16, 4]) == pytest.approx(2)
    assert math.isnan(observed_order([8, 4, 2], [64, 16, 0]))
    case.order("stress", [8, 4, 2], [0.8, 0.4, 0.2], at_least=1.0 - 1e-9, unit="MPa")
    case.order("force", [8, 4, 2], [0.8, 0.4, 0.2], at_least=1.1)
    assert passed(case) == [True, False]
    assert "0.4 at h = 4" in case.notes[0]
    assert (case.work / case.figures[0]["file"]).stat().st_size <= rfem_verify.FIGURE_BYTES


def test_large_figures_become_small(case):
    figure, axes = plt.subplots(figsize=(9, 9))
    axes.imshow([[(i * i + j * j * j) % 251 for i in range(400)] for j in range(400)], cmap="turbo")
    case.figure("noise", figure, "noise")
    assert (case.work / "demo_noise.png").stat().st_size <= rfem_verify.FIGURE_BYTES


def make_case(folder, text):
    folder.mkdir(parents=True)
    (folder / "check.py").write_text(text)
    (folder / "README.md").write_text("# A case\n\nWhat is [computed](a.inp).\n\nMore.\n")
    return folder


HEAD = 'TITLE = "Demo"\nSECTION = "contact"\n'
GOOD = HEAD + 'def check(case):\n    case.at_most("a", 1, 2, kind="exact")\n    case.at_most("b", 3, 2, kind="exact")\n'


def test_a_check_that_breaks_is_a_failing_row(tmp_path):
    text = HEAD + 'def check(case):\n    case.at_most("a", 1, 2, kind="exact")\n    raise ValueError("no such frame")\n'
    record = verify_suite.run_case("demo", tmp_path, False, make_case(tmp_path / "in" / "demo", text).parent)
    assert [row["passed"] for row in record["rows"]] == [True, False]
    assert record["rows"][1]["quantity"] == "check ran" and "no such frame" in record["rows"][1]["computed"]
    assert record["section"] == "contact" and "no such frame" in record["message"]


@pytest.mark.parametrize("how", ["import os\n    os.abort()", "while True: pass"])
def test_a_check_that_dies_or_hangs_is_a_failing_row(tmp_path, how):
    cases = make_case(tmp_path / "in" / "demo", HEAD + f"def check(case):\n    {how}\n").parent
    record = verify_suite.run_case("demo", tmp_path, False, cases, limit=5)
    assert [row["passed"] for row in record["rows"]] == [False]
    assert record["section"] == "contact"
    assert json.loads((tmp_path / "demo" / "rows.json").read_text())["rows"] == record["rows"]


def test_a_check_without_rows_fails(tmp_path):
    record = verify_suite.run_case(
        "demo", tmp_path, False, make_case(tmp_path / "in" / "demo", HEAD + "def check(case): pass\n").parent
    )
    assert not record["rows"][0]["passed"]


def test_long_cases_are_skipped_by_quick(tmp_path):
    cases = make_case(tmp_path / "in" / "demo", "QUICK = False\n" + GOOD).parent
    assert verify_suite.run_case("demo", tmp_path, True, cases)["rows"] == []
    assert len(verify_suite.run_case("demo", tmp_path, False, cases)["rows"]) == 2


def test_known_failures(tmp_path, capsys):
    cases = make_case(tmp_path / "in" / "demo", GOOD).parent
    records = [verify_suite.run_case("demo", tmp_path, False, cases)]
    path = tmp_path / "known"
    path.write_text("# comment\ndemo | B | it is three\ndemo | a | gone\ndemo | c | no such row\n")
    messages = verify_suite.mark_known(records, verify_suite.read_known(path))
    assert messages == [
        "demo | a: passes; take it out of known_failures",
        "demo | c: stands in known_failures, but there is no such row",
    ]
    assert records[0]["rows"][1]["known"] == "it is three"
    assert verify_suite.close(records, messages, 0.1, strict=False) == 0
    assert verify_suite.close(records, messages, 0.1, strict=True) == 1
    assert "verification: 2 rows, 1 passed, 1 failed (1 known), 0.1 min" in capsys.readouterr().out
    verify_suite.mark_known(records, {})
    assert verify_suite.close(records, [], 0.1, strict=False) == 1
    path.write_text("demo | b\n")
    with pytest.raises(SystemExit, match="known:1: expected"):
        verify_suite.read_known(path)


def test_the_list_of_known_failures_can_be_read():
    names = verify_suite.case_names()
    for name, _ in verify_suite.read_known():
        assert name in [verify_suite.plain(known) for known in names]


def test_an_unknown_case_is_told_the_nearest(capsys):
    first = verify_suite.case_names()[0]
    assert verify_suite.main([first + "x"]) == 2
    assert f"the nearest name is {first}" in capsys.readouterr().err


def test_the_page(tmp_path, monkeypatch):
    cases = make_case(tmp_path / "in" / "demo", GOOD).parent
    monkeypatch.setattr(verify_report, "CASES", cases)
    monkeypatch.setattr(verify_report, "PROJECT", tmp_path)
    record = verify_suite.run_case("demo", tmp_path, False, cases)
    verify_suite.mark_known([record], {("demo", "b"): "it is three"})
    facts = {"date": "today", "commit": "abc", "version": "rfem", "machine": "one", "seconds": 60}
    text = verify_report.page([record], facts, (2, 1, 1, 1))
    assert "| a | 1 | ≤ 2 |  |  | exact | pass |" in text
    assert "| b | 3 | ≤ 2 |  |  | exact | **fails** (known) |" in text
    assert "What is [computed](../in/demo/a.inp)." in text and "More." not in text
    assert "- `demo`, b: it is three" in text


def rows_from(folder, **commits):
    for name, commit in commits.items():
        (folder / name).mkdir(exist_ok=True)
        record = {"case": name, "commit": commit.strip("!"), "quick": "!" in commit, "rows": []}
        (folder / name / "rows.json").write_text(json.dumps(record))


def test_report_wants_rows_of_one_commit(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(verify_suite, "state_of_project", lambda: "aaa")
    monkeypatch.setattr(verify_suite, "git", lambda *words: "src/main.f90")
    rows_from(tmp_path, one="aaa", two="bbb!", four="bbb")
    assert verify_suite.report_from_files(["one", "two", "three", "four"], tmp_path) == 1
    said = capsys.readouterr().err
    assert "three: not run yet" in said and "two: only its quick part" in said and "one:" not in said
    assert "four: from commit bbb, not aaa" in said


def test_report_takes_rows_since_which_nothing_has_changed(tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr(verify_suite, "state_of_project", lambda: "aaa")
    monkeypatch.setattr(verify_suite, "git", lambda *words: "" if words[0] == "diff" else "bbb")
    monkeypatch.setattr(verify_suite, "write_report", lambda records, work: written.extend(records))
    rows_from(tmp_path, one="aaa", two="bbb")
    assert verify_suite.report_from_files(["one", "two"], tmp_path) == 0
    assert [record["commit"] for record in written] == ["aaa", "aaa"]
    rows_from(tmp_path, one="aaa", two="bbb+")
    assert verify_suite.report_from_files(["one", "two"], tmp_path) == 1, "changed files: nobody knows what was run"


def test_first_figures_stand_at_the_top():
    figures = [
        {"file": "a.png", "caption": "A", "first": True},
        {"file": "b.png", "caption": "B", "first": False},
    ]
    lines = verify_report.first_figures([{"title": "Beam: 1/2", "figures": figures}])
    assert "![A](verification/a.png)" in lines and "![B](verification/b.png)" not in lines
    assert "*A* ([Beam: 1/2](#beam-12))" in lines


def test_numbers_as_texts():
    assert [rfem_verify.number_text(x) for x in (1e-9, 2e-11, 1.5e10, 3)] == ["1e-9", "2e-11", "1.5e10", "3"]


@pytest.mark.skipif(not rfem_verify.program().exists(), reason="no program")
def test_a_run(case):
    deck = Path(os.environ.get("RFEM_SOURCE_DIR", rfem_verify.PROJECT)) / "input/tutorial/first_deck/first_deck.inp"
    result = case.run(deck, name="one")
    assert len(result.events["event"]) > 0
    assert "digest" in case.log("one") and len(case.digests("one")) == 2
    (case.work / "wrong.inp").write_text("*NODES\n")
    assert case.run("wrong.inp", exit=2) is None
    assert "did you mean" in case.messages("wrong")
    with pytest.raises(VerifyError, match="exit status 2, expected 0"):
        case.run("wrong.inp")

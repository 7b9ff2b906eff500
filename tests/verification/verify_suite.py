"""Runs verification cases, prints the table, writes docs/verification.md (`./run verify`)."""

import argparse
import contextlib
import datetime
import difflib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import verify_report
from rfem_verify import CASES, PROJECT, SECTIONS, failed_row, program

KNOWN = Path(__file__).resolve().parent / "known_failures"
TIME_LIMIT = 1800  # seconds for a case


def case_names(cases=CASES):
    """All cases: folders with a check.py."""
    return sorted(path.parent.name for path in Path(cases).glob("*/check.py"))


def unknown_name(name, names):
    """What to say about a name that is no case."""
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
    return f"verify: no case {name!r}; the nearest name is {near[0] if near else '(none)'}\ncases: {' '.join(names)}"


# ---------------------------------------------------------------------------------------------- known failures
def plain(text):
    """A text for comparison: case and runs of blanks do not count."""
    return " ".join(text.lower().split())


def read_known(path=KNOWN):
    """{(case, quantity): cause} of the lines `NAME | quantity | cause`; # starts a comment."""
    known = {}
    for number, line in enumerate(Path(path).read_text().splitlines() if Path(path).exists() else [], 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        fields = [field.strip() for field in line.split("|", 2)]
        if len(fields) != 3 or not all(fields):
            raise SystemExit(f"{path}:{number}: expected `NAME | quantity | cause`")
        known[plain(fields[0]), plain(fields[1])] = fields[2]
    return known


def mark_known(records, known):
    """Give every row its cause, if it is a known failure; [texts] about entries that are out of date."""
    messages, used = [], set()
    for record in records:
        for row in record["rows"]:
            key = plain(record["case"]), plain(row["quantity"])
            row["known"] = known.get(key, "") if not row["passed"] else ""
            if key in known:
                used.add(key)
                if row["passed"]:
                    messages.append(f"{record['case']} | {row['quantity']}: passes; take it out of known_failures")
    complete = {plain(record["case"]) for record in records if not record["quick"]}
    for case, quantity in known.keys() - used:
        if case in complete:
            messages.append(f"{case} | {quantity}: stands in known_failures, but there is no such row")
    return sorted(messages)


# ---------------------------------------------------------------------------------------------- running
def git(*arguments):
    """What git answers in the project; empty where it does not."""
    with contextlib.suppress(OSError):
        done = subprocess.run(["git", "-C", str(PROJECT), *arguments], capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""
    return ""


# what decides about the rows of every case; those of one case depend on its folder besides
DECIDING = [
    *("CMakeLists.txt", "cmake", "src", "postproc", "input/paper", "tests/property", "tests/support"),
    *("tests/regression", "tests/results", "tests/verification/*.py"),
    *(":!tests/verification/verify_*.py", ":!tests/verification/test_*.py"),
]


def state_of_project():
    """The commit, with a + when files that decide about results are changed."""
    changed = git("status", "--porcelain", "--", "input/verification", *DECIDING)
    return (git("rev-parse", "--short=10", "HEAD") or "unknown") + ("+" if changed else "")


def still_holds(record, commit):
    """Whether the rows are what `commit` gives: made by it, or by one since which nothing that decides has changed."""
    if record["commit"] == commit:
        return True
    if "+" in record["commit"] + commit or not git("rev-parse", "--verify", f"{record['commit']}^{{commit}}"):
        return False
    folder = f"input/verification/{record['case']}"
    return not git("diff", "--name-only", record["commit"], commit, "--", folder, *DECIDING)


def run_case(name, work, quick, cases, limit=TIME_LIMIT, commit="unknown"):
    """Run one case in a process of its own; its record, with failing rows for a crash or a time-out."""
    start = time.monotonic()
    folder = Path(work) / name
    rows = folder / "rows.json"
    rows.unlink(missing_ok=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(Path(__file__).resolve().parent / "rfem_verify.py"), str(cases / name), str(folder)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive", "MPLBACKEND": "Agg"}
    output = folder.with_suffix(".out")
    with output.open("w") as stream:
        process = subprocess.Popen(
            command + ["--quick"] * quick,
            stdin=subprocess.DEVNULL,
            stdout=stream,
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        RUNNING.add(process)
        try:
            process.wait(timeout=limit)
            problem = "" if rows.exists() else f"the check ended with {process.returncode} and left no rows"
        except subprocess.TimeoutExpired:
            stop(process)
            problem = f"not finished after {limit / 60:.0f} min"
        RUNNING.discard(process)
    if problem:
        folder.mkdir(parents=True, exist_ok=True)
        record = {"case": name, "title": name, "section": section_of(cases / name), "quick": quick, "skipped": False}
        record.update(rows=[failed_row(problem)], figures=[], notes=[], message=problem + "\n" + output.read_text())
    else:
        record = json.loads(rows.read_text())
    record.update(seconds=round(time.monotonic() - start, 1), commit=commit)
    rows.write_text(json.dumps(record, indent=1))
    return record


RUNNING = set()  # processes that must not outlive this one


def stop(process):
    """End a process and what it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def section_of(source):
    """The section of a case whose check could not say it itself."""
    found = re.search(r'^SECTION = "(\w+)"', (source / "check.py").read_text(), re.M)
    return found[1] if found and found[1] in SECTIONS else "elastic"


def expected_seconds(name, work):
    """How long a case took last time; unknown ones first."""
    try:
        return json.loads((Path(work) / name / "rows.json").read_text())["seconds"]
    except (OSError, ValueError, KeyError):
        return float("inf")


def run_cases(names, work, quick, jobs, cases):
    """Run cases, `jobs` at a time, the longest first; their records in the order of the names."""
    lock, finished, commit = threading.Lock(), [], state_of_project()

    def one(name):
        record = run_case(name, work, quick, cases, commit=commit)
        with lock:
            finished.append(name)
            failed = sum(not row["passed"] for row in record["rows"])
            state = "skipped (long)" if record["skipped"] else f"{len(record['rows'])} rows, {failed} failed"
            print(f"[{len(finished)}/{len(names)}] {name}: {state}, {record['seconds']:.1f} s", flush=True)
        return record

    order = sorted(names, key=lambda name: -expected_seconds(name, work))
    with ThreadPoolExecutor(jobs) as pool:
        try:
            records = dict(zip(order, pool.map(one, order)))
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in list(RUNNING):
                stop(process)
            raise
    return [records[name] for name in names]


# ---------------------------------------------------------------------------------------------- the table
COLUMNS = ("case", "quantity", "computed", "expected", "error", "tolerance", "kind", "pass")


def table_rows(record):
    """The lines of a record in the table's columns."""
    for row in record["rows"]:
        unit = f" {row['unit']}" if row["unit"] else ""
        verdict = "pass" if row["passed"] else ("KNOWN" if row["known"] else "FAIL")
        computed = row["computed"] + (unit if row["quantity"] != "check ran" else "")
        yield (record["case"], row["quantity"], computed, row["expected"] + unit) + (
            row["error"],
            row["tolerance"],
            row["kind"],
            verdict,
        )


def print_table(records):
    """All rows, grouped by section, in aligned columns."""
    lines = {section: [] for section in SECTIONS}
    for record in records:
        lines[record["section"]] += table_rows(record)
    everything = [COLUMNS, *(line for group in lines.values() for line in group)]
    widths = [max(len(line[k]) for line in everything) for k in range(len(COLUMNS))]

    def show(line):
        print(" | ".join(field.ljust(width) for field, width in zip(line, widths)).rstrip())

    for section, group in lines.items():
        if group:
            print(f"\n{SECTIONS[section]}")
            show(COLUMNS)
            show(["-" * width for width in widths])
            for line in group:
                show(line)


def counts(records):
    """(rows, passed, failed, known) of records."""
    rows = [row for record in records for row in record["rows"]]
    failed = [row for row in rows if not row["passed"]]
    return len(rows), len(rows) - len(failed), len(failed), sum(bool(row["known"]) for row in failed)


def close(records, messages, minutes, strict):
    """Print the failures and the summary line; the exit status."""
    for record in records:
        if record.get("message"):
            print(f"\n{record['case']}: the check did not run to its end:\n{record['message'].rstrip()[-2000:]}")
    for message in messages:
        print(f"note: {message}")
    rows, passed, failed, known = counts(records)
    print(f"\nverification: {rows} rows, {passed} passed, {failed} failed ({known} known), {minutes:.1f} min")
    return 1 if failed > (0 if strict else known) else 0


# ---------------------------------------------------------------------------------------------- the report
def facts(records):
    """What the report says of its origin."""
    version = subprocess.run([str(program()), "--version"], capture_output=True, text=True, check=False).stdout
    return {
        "date": datetime.date.today().isoformat(),
        "commit": records[0]["commit"],
        "version": version.split("\n")[0].strip(),
        "machine": verify_report.machine(),
        "seconds": sum(record["seconds"] for record in records),
    }


def report_from_files(names, work):
    """docs/verification.md from the rows that are there, if they belong together; the exit status."""
    records, problems = [], []
    for name in names:
        path = Path(work) / name / "rows.json"
        if not path.exists():
            problems.append(f"{name}: not run yet")
            continue
        records.append(json.loads(path.read_text()))
        if records[-1]["quick"]:
            problems.append(f"{name}: only its quick part was run")
    commit = state_of_project()
    if len({record["commit"] for record in records}) == 1:
        commit = records[0]["commit"]
    for record in records:
        if not still_holds(record, commit):
            problems.append(f"{record['case']}: from commit {record['commit']}, not {commit}")
    if problems or not records:
        print("verify: no report, the rows do not belong together:", *problems, sep="\n  ", file=sys.stderr)
        return 1
    write_report([{**record, "commit": commit} for record in records], work)
    return 0


def write_report(records, work):
    """docs/verification.md and its figures."""
    known = read_known()
    mark_known(records, known)
    verify_report.write(records, facts(records), counts(records), Path(work))
    print(f"written: {verify_report.PAGE.relative_to(PROJECT)}")


def arguments_of(words):
    parser = argparse.ArgumentParser(prog="./run verify", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="these cases only (default: all)")
    parser.add_argument("--quick", action="store_true", help="the short part of each case; known failures may fail")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), metavar="N", help="cases at a time (all cores)")
    parser.add_argument("--work", type=Path, default=PROJECT / "build" / "verify", help="where the runs go")
    parser.add_argument("--report", action="store_true", help="write docs/verification.md from the rows of past runs")
    parser.add_argument("--list", action="store_true", help="the names of the cases")
    return parser.parse_args(words)


def main(words=None):
    options = arguments_of(words)
    names = case_names()
    for name in options.names:
        if name not in names:
            print(unknown_name(name, names), file=sys.stderr)
            return 2
    if options.list:
        print("\n".join(names))
        return 0
    if options.report:
        return report_from_files(names, options.work)
    if not program().exists():
        print(f"verify: there is no program {program()} (RFEM)", file=sys.stderr)
        return 2
    start = time.monotonic()
    known = read_known()
    chosen = [name for name in names if not options.names or name in options.names]
    records = run_cases(chosen, options.work, options.quick, max(1, options.jobs), CASES)
    messages = mark_known(records, known)
    print_table(records)
    full = not options.quick and not options.names
    status = close(records, messages, (time.monotonic() - start) / 60, strict=full)
    if full:
        write_report(records, options.work)
    return status


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Gather the runs of a sweep into one table, and plot a quantity against a parameter.

rfem_collect.py [WHERE ..] [--sweep FILE] [--output TABLE.csv] [--plot X Y [--by Z] [--figure FILE]]

WHERE is a job or a folder, which is searched with all folders below it (default: the working directory). The
table has a row for every job: its state (done, failed, unfinished, missing), its *PARAMETER values, what came
of it. Jobs that failed, were killed or never ran are listed like the others; what they have not is empty.

--sweep FILE names the jobs there should be: a CSV table whose first column is `job`, the others parameters
(docs/batch/README.md). Without it a job that left no file cannot be known of.
"""

from __future__ import annotations

import argparse
import csv
import io
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Union

from rfem_command import Parser, leave_without

try:
    import h5py
    import numpy as np

    from rfem_fields import Units
    from rfem_io import ResultsError, nearest, open_hdf5, reading, short_text, text_of
    from rfem_results import Results, jobs_in
except ModuleNotFoundError as missing:
    leave_without("rfem_collect", missing)

Value = Union[str, int, float]
LAST_VALUES = (
    "time load_factor converged cracks crack_length fragments exhausted external_work released_energy".split(
        " "
    )
)
DONE, FAILED, UNFINISHED, MISSING = "done", "failed", "unfinished", "missing"


def number(text: str) -> Value:
    """A whole number, a number, or the text as it is."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def parameters(results: Results) -> dict[str, Value]:
    """Values of the deck's *PARAMETER, those of --set included; {} where JOB.h5 cannot be read."""
    try:
        file, _ = open_hdf5(results.path(".h5"))
        with file, reading(results.path(".h5"), "its settings"):
            group = file.get("rfem/settings")
            if not isinstance(group, h5py.Group):
                return {}
            pairs = zip(text_of(group["name"][()]).split("\n"), text_of(group["value"][()]).split("\n"))
            return {
                name.split(" ", 1)[1]: number(value.strip())
                for name, value in pairs
                if name.startswith("*PARAMETER ")
            }
    except ResultsError:
        return {}


def exit_status(results: Results) -> int | None:
    """Exit status: of JOB.h5, else of JOB.exit, which docs/batch/run_row.sh writes; None if unknown."""
    text = results.provenance.get("exit_status", "")
    if not text:
        try:
            text = results.path(".exit").read_text(encoding="utf-8").strip()
        except OSError:
            return None
    return int(text) if text.lstrip("-").isdigit() else None


def state_of(status: int | None) -> str:
    """State of a job by its exit status; 126 and 127 are the shell's: the program could not be started."""
    if status == 0:
        return DONE
    return FAILED if status in (1, 2, 3, 126, 127) else UNFINISHED


def summary(results: Results) -> dict[str, Value]:
    """One row of the table: what came of a job."""
    row: dict[str, Value] = {"job": results.job}
    status = exit_status(results)
    row["state"] = state_of(status)
    if status is not None:
        row["exit_status"] = status
    row |= parameters(results)
    try:
        history, events = results.history, results.events
    except ResultsError:
        return row
    if not len(history):
        return row
    last = {name: history[name][-1].item() for name in history.names}
    row |= {
        "nodes": history["nodes"][0].item(),
        "elements": history["elements"][0].item(),
        "rows": len(history),
    }
    for name in LAST_VALUES:
        if name in last:
            row[name] = last[name]
    row |= {
        "events": last["event_count"],
        "events_tension": last["events_tension"],
        "events_shear": last["events_shear"],
    }
    row["iterations"] = int(np.sum(history["iterations"]))
    if len(events):
        row |= {f"first_event_{name}": events[name][0].item() for name in ("time", "x", "y", "mode")}
    for monitor in results.monitors:
        row |= monitor_summary(monitor, history, events)
    for name in ("wall_time", "threads", "version", "commit", "digest_displacements"):
        if name in results.provenance:
            row[name] = (
                number(results.provenance[name])
                if name in ("wall_time", "threads")
                else results.provenance[name]
            )
    return row


def monitor_summary(monitor: str, history: Mapping, events: Mapping) -> dict[str, Value]:
    """Peak load, when it was, load at the first event and at the end, last displacement of a monitor."""
    names = [f"{monitor}_rf1", f"{monitor}_rf2"]
    loads = [np.hypot(*(np.asarray(table[name], float) for name in names)) for table in (history, events)]
    times = np.concatenate([history["time"], events["time"]])
    load = np.nan_to_num(np.concatenate(loads), nan=0.0)
    top = int(np.argmax(load))
    row = {f"{monitor}_peak": float(load[top]), f"{monitor}_peak_time": float(times[top])}
    if len(loads[1]):
        row[f"{monitor}_first_event"] = float(loads[1][0])
    row[f"{monitor}_last"] = float(loads[0][-1])
    for i in (1, 2):
        row[f"{monitor}_u{i}"] = history[f"{monitor}_u{i}"][-1].item()
    return row


# --- which jobs ------------------------------------------------------------------------------------------


def find_jobs(where: Sequence[str | Path]) -> list[Results]:
    """Result sets of jobs, and of folders with all below; ResultsError where there is nothing."""
    found: dict[tuple[Path, str], Results] = {}
    for place in map(Path, where):
        folders = (
            [place, *sorted(path for path in place.rglob("*") if path.is_dir())] if place.is_dir() else []
        )
        for folder in folders:
            for job in jobs_in(folder):
                found.setdefault((folder.resolve(), job), Results(folder, job))
            for path in sorted(folder.glob("*.exit")):  # it ran and left no results
                found.setdefault((folder.resolve(), path.stem), Results(folder, path.stem))
        if not folders:
            if not place.parent.is_dir() or not list(place.parent.glob(f"{place.name}*")):
                raise ResultsError(f"{place} is neither a folder nor a job")
            found.setdefault((place.parent.resolve(), place.name), Results(place.parent, place.name))
    return list(found.values())


def read_sweep(path: str | Path) -> list[dict[str, Value]]:
    """Jobs of a sweep, with their parameters; ResultsError if the table is wrong.

    The same rules as those of docs/batch/run_row.sh: plain commas, no quotes, blanks only around a value.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ResultsError(f"{path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ResultsError(f"{path} is no text: {short_text(error)}") from error
    lines = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    if not lines:
        raise ResultsError(f"{path} is empty: it needs a line 'job, NAME, ..' and a line for each run")
    table = [(number, [cell.strip(" \t\r") for cell in line.split(",")]) for number, line in lines]
    first, names = table.pop(0)
    if names[0] != "job":
        raise ResultsError(f"{path}:{first}: the first column of a sweep is job, the others are parameters")
    rows, seen = [], {}
    for line, name in [(first, name) for name in names]:
        if not re.fullmatch(r"[A-Za-z0-9_]+", name):
            raise ResultsError(f"{path}:{line}: '{name}' is no name of a parameter (letters, digits and _)")
        if names.count(name) > 1:
            raise ResultsError(f"{path}:{line}: the column {name} is there twice")
    for line, cells in table:
        job = cells[0]
        if len(cells) != len(names):
            raise ResultsError(f"{path}:{line}: {len(cells)} values for {len(names)} columns")
        if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.+-]*", job):
            raise ResultsError(
                f"{path}:{line}: '{job}' is no job name: letters, digits, _ . + -, the first no . + or -"
            )
        if job in seen:
            raise ResultsError(f"{path}:{line}: the job {job} is there twice (line {seen[job]})")
        for name, cell in zip(names, cells):
            if not re.fullmatch(r"[^ \t'\"]+", cell):
                raise ResultsError(f"{path}:{line}: '{cell}' is no value for {name}: one word without quotes")
        seen[job] = line
        rows.append({name: number(cell) for name, cell in zip(names, cells)})
        rows[-1]["job"] = job
    return rows


def collect(where: Sequence[str | Path], sweep: str | Path | None = None) -> list[dict[str, Value]]:
    """The table: a row for each job, those of the sweep first. ResultsError if there is no job."""
    rows = []
    for results in find_jobs(where):
        rows.append(summary(results))
        for reason in results.unreadable:
            sys.stderr.write(
                f"rfem_collect: note: {reason} (the row has what {results.job}_history.csv has)\n"
            )
        results.close()
    if sweep is not None:
        by_job = {row["job"]: row for row in rows}
        planned = []
        for plan in read_sweep(sweep):
            row = by_job.pop(plan["job"], {"job": plan["job"], "state": MISSING})
            own = {name.upper(): value for name, value in plan.items() if name != "job"}
            head = {name: row[name] for name in ("job", "state", "exit_status") if name in row}
            planned.append({**head, **own, **row})
        rows = planned + list(by_job.values())
    if not rows:
        raise ResultsError(f"no results of rfem in {', '.join(map(str, where))}")
    return rows


def columns_of(rows: Sequence[Mapping[str, Value]]) -> list[str]:
    """Names of all columns, in the order of the fullest rows."""
    names: list[str] = []
    for row in sorted(rows, key=len, reverse=True):
        for place, name in enumerate(row):
            if name not in names:  # behind the name it follows in this row
                before = list(row)[place - 1] if place else None
                names.insert(names.index(before) + 1 if before else 0, name)
    return names


def write_table(rows: Sequence[Mapping[str, Value]], path: Path | None) -> None:
    """Write the table as CSV to a file, or to standard output."""
    text = io.StringIO()
    writer = csv.DictWriter(text, columns_of(rows), restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    if path is None:
        sys.stdout.write(text.getvalue())
        return
    try:
        path.write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"{path} cannot be written: {error.strerror or error}") from error


# --- the figure ------------------------------------------------------------------------------------------


def numbers_of(rows: Sequence[Mapping[str, Value]], name: str) -> str:
    """The column's name as the table writes it; ResultsError if there is none, or if it has no numbers."""
    names = columns_of(rows)
    found = next((other for other in names if other.lower() == name.lower()), None)
    if found is None:
        raise ResultsError(
            f"the table has no column {name}{nearest(name, names)} (columns: {', '.join(names)})"
        )
    if not any(isinstance(row.get(found), (int, float)) for row in rows):
        raise ResultsError(f"column {found} has no numbers")
    return found


def sweep_units(where: Sequence[str | Path]) -> Units:
    """Units that the decks' headings state; ResultsError where two decks state different ones."""
    from rfem_curves import common_units

    jobs = find_jobs(where)
    units = common_units(jobs)
    for results in jobs:
        results.close()
    return units


def axis_label(name: str, names: Sequence[str], units: Units) -> str:
    """Label of an axis: the column's name as it stands in the table, with its unit where that is known.

    A parameter's unit is the user's affair. `names`: all columns.
    """
    from rfem_fields import COLUMN_UNITS

    kind = COLUMN_UNITS.get(name.removeprefix("first_event_"), "")
    for ending, unit in MONITOR_UNITS.items():
        if name.endswith(ending) and f"{name.removesuffix(ending)}_peak_time" in names:
            kind = unit
    return f"{name} (s)" if name == "wall_time" else units.label(name, kind)


MONITOR_UNITS = {
    "_peak": "force",
    "_peak_time": "time",
    "_first_event": "force",
    "_last": "force",
    "_u1": "length",
    "_u2": "length",
}


def sweep_figure(  # noqa: ANN201
    rows: Sequence[Mapping[str, Value]], x: str, y: str, by: str | None = None, units: Units | None = None
):
    """A quantity against a parameter, a line for each value of `by`; jobs that are not done are hollow.

    A matplotlib Figure. ResultsError if a column is missing or no job has both values.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from rfem_style import STYLE, number_text

    units = units or Units()
    x, y = numbers_of(rows, x), numbers_of(rows, y)
    by = numbers_of(rows, by) if by else None
    usable = [
        row for row in rows if all(isinstance(row.get(name), (int, float)) for name in (x, y, by) if name)
    ]
    if not usable:
        raise ResultsError(f"no job has both {x} and {y}")
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.8, 3.5), layout="constrained")
        FigureCanvasAgg(figure)
        ax = figure.add_subplot()
        for value in sorted({row[by] for row in usable}) if by else [None]:
            line = sorted((row for row in usable if by is None or row[by] == value), key=lambda row: row[x])
            done = [row for row in line if row["state"] == DONE]
            label = None if by is None else f"{by} = {number_text(value)}"
            drawn = ax.plot(
                [row[x] for row in done], [row[y] for row in done], "-o", markersize=3.5, label=label
            )
            other = [row for row in line if row["state"] != DONE]
            ax.plot(
                [row[x] for row in other], [row[y] for row in other], "o", markersize=4.5,
                markerfacecolor="white", markeredgecolor=drawn[0].get_color(),
            )  # fmt: skip
        left = len(rows) - len([row for row in usable if row["state"] == DONE])
        ax.set_title(
            f"{len(rows)} jobs" + (f", {left} of them not done (hollow, or absent)" if left else ""),
            loc="left",
        )
        names = columns_of(rows)
        ax.set_xlabel(axis_label(x, names, units))
        ax.set_ylabel(axis_label(y, names, units))
        ax.grid(color="#DDDDDD", linewidth=0.5)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        if by:
            ax.legend(fontsize=8)
        return figure


# --- the command -----------------------------------------------------------------------------------------


def make_parser() -> Parser:
    """The command line."""
    parser = Parser(
        prog="rfem_collect.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="exit status: 0 all jobs are done, 1 some are not (the table is written), 2 wrong usage",
    )
    parser.add_argument(
        "where", metavar="WHERE", nargs="*", help="jobs or folders (default: the working directory)"
    )
    parser.add_argument(
        "--sweep", metavar="FILE", help="table of the jobs there should be (CSV: job, parameters)"
    )
    parser.add_argument(
        "--output", metavar="TABLE.csv", help="where the table goes (default: standard output)"
    )
    parser.add_argument("--plot", nargs=2, metavar=("X", "Y"), help="draw column Y against column X")
    parser.add_argument("--by", metavar="Z", help="with --plot: a line for each value of column Z")
    parser.add_argument(
        "--figure",
        metavar="FILE",
        help="where the figure goes (default: Y_over_X.png beside the table); png, pdf, svg",
    )
    return parser


def run(options: argparse.Namespace) -> int:
    """Collect as the options ask; 0 if all jobs are done, else 1."""
    if options.plot is None and (options.by or options.figure):
        raise ResultsError("--by and --figure go with --plot X Y")
    rows = collect(options.where or ["."], options.sweep)
    figure = None
    if options.plot:
        figure = sweep_figure(rows, *options.plot, options.by, sweep_units(options.where or ["."]))
    if options.output or figure is None:
        write_table(rows, Path(options.output) if options.output else None)
    if figure is not None:
        from rfem_style import save

        beside = Path(options.output).parent if options.output else Path()
        path = Path(options.figure or beside / f"{options.plot[1]}_over_{options.plot[0]}.png")
        if path.suffix not in (".png", ".pdf", ".svg"):
            raise ResultsError(f"{path} must end in .png, .pdf or .svg")
        save(figure, path)
        sys.stderr.write(f"wrote {path}\n")
    return say_what_is_not_done(rows)


def say_what_is_not_done(rows: Sequence[Mapping[str, Value]]) -> int:
    """Counts by state and the names of jobs that are not done, on standard error; 1 if there are any."""
    left = [row for row in rows if row["state"] != DONE]
    sys.stderr.write(f"rfem_collect: {len(rows)} jobs, {len(rows) - len(left)} done\n")
    for state in (FAILED, UNFINISHED, MISSING):
        names = [
            f"{row['job']} (exit status {row['exit_status']})" if "exit_status" in row else str(row["job"])
            for row in left
            if row["state"] == state
        ]
        if names:
            sys.stderr.write(f"rfem_collect: {state}: {', '.join(names)}\n")
    return 1 if left else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: 0 all jobs done, 1 some not, 2 wrong usage."""
    options = make_parser().parse_args(arguments)
    try:
        return run(options)
    except ResultsError as error:
        sys.stderr.write(f"rfem_collect: error: {' '.join(str(error).split())}\n")
        return 2
    except ModuleNotFoundError as missing:
        leave_without("rfem_collect", missing)


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Say whether two runs have the same answer.

rfem_compare.py JOB1 JOB2 [--tolerance FILE]

What comes before the first event is reproducible to the tolerance of relaxation: the histories are compared
row by row, tightly. After it crack paths bifurcate on rounding (compilers and processors round differently):
what is compared then are integrals: number and length of cracks, energies, peak loads. JOB1 is the reference:
differences are parts of its values. Instead of JOB1
a stored reference (NAME.json of the regression tests) will do.

--tolerances prints what is allowed, and why, in the form of FILE:

  {"before": {"LOAD_rf2": {"tolerance": 1e-5, "kind": "relative", "reason": "why"}},   columns of the history
   "after": {"crack_length": {"tolerance": 0.2, "kind": "relative", "reason": "why"},
             "fragments": "ignore"}}

A name is a column, or a family of columns as --tolerances prints them. FILE needs to name only what is
to be other than usual. Kinds: relative (to the largest value of the family in JOB1), absolute, of the peak
(relative to the peak load).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rfem_command import Parser, leave_without

try:
    import numpy as np

    from rfem_io import ResultsError, nearest
    from rfem_results import Results, open_results
except ModuleNotFoundError as missing:
    leave_without("rfem_compare", missing)

KINDS = ("relative", "absolute", "of the peak")
IGNORE = "ignore"

# Columns of the history before the first event, by family.
BEFORE = {
    "exact": (0.0, "absolute", "when, and the deck's mesh"),
    "time": (
        1e-6,
        "relative",
        "grid of increments; the first event's load is located where the utilisation is 1.0005",
    ),
    "monitor_u": (1e-6, "relative", "another rounding moves a relaxed state by less than TOLERANCE=1e-6"),
    "monitor_rf": (1e-6, "relative", "another rounding moves a relaxed state by less than TOLERANCE=1e-6"),
    "section_f": (1e-5, "relative", "stresses along a line, each good to about 10 x TOLERANCE"),
    "section_m": (1e-5, "relative", "stresses along a line, each good to about 10 x TOLERANCE"),
    "energy": (2e-6, "relative", "quadratic in what is good to TOLERANCE"),
    "utilisation": (1e-4, "relative", "stresses are good to 100 x TOLERANCE"),
    "contacts": (0.02, "relative", "a pair at the limit of friction may slip or stick"),
    "other": (1e-6, "relative", "a column that has no family yet"),
    "measure": (0.0, IGNORE, "says how well the state is known, not what it is"),
}
FAMILY = {
    **dict.fromkeys(
        "step increment nodes elements cracks fragments events_tension events_shear".split(" "), "exact"
    ),
    **dict.fromkeys("event_count exhausted converged".split(" "), "exact"),
    **dict.fromkeys("time load_factor".split(" "), "time"),
    **dict.fromkeys("crack_length".split(" "), "time"),
    **dict.fromkeys("iterations residual energy_error exhausted_utilisation".split(" "), "measure"),
    **dict.fromkeys("contacts_open contacts_slip contacts_stick".split(" "), "contacts"),
    **dict.fromkeys("external_work strain_energy kinetic_energy friction_work".split(" "), "energy"),
    **dict.fromkeys("softening_work released_energy damping_work".split(" "), "energy"),
    "max_utilisation": "utilisation",
}
SUFFIX_FAMILY = {
    **dict.fromkeys(("_u1", "_u2"), "monitor_u"),
    **dict.fromkeys(("_rf1", "_rf2"), "monitor_rf"),
    **dict.fromkeys(("_f1", "_f2"), "section_f"),
    "_m": "section_m",
    "_error": "measure",
}

# Integrals, and the first event.
AFTER = {
    "nodes": (0, "absolute", "the mesh is the deck's"),
    "elements": (0, "absolute", "the mesh is the deck's"),
    "loads_before_first_event": (
        1e-6,
        "relative",
        "elastic: relaxation takes the same steps; another rounding moves the load by less than "
        "TOLERANCE=1e-6",
    ),
    "first_event_load": (1e-6, "relative", "elastic, located where the utilisation is 1.0005"),
    "first_event_time": (1e-6, "relative", "elastic, located where the utilisation is 1.0005"),
    "first_event_x": (1e-9, "relative", "a node of the deck"),
    "first_event_y": (1e-9, "relative", "a node of the deck"),
    "first_event_direction": (1e-2, "absolute", "degrees; stresses are good to 1e-4 at TOLERANCE=1e-6"),
    "first_event_mode": (0, "absolute", "1 tension, 2 shear"),
    "peak_load": (
        1e-3,
        "relative",
        "the load of the first event here: OVERSHOOT=0.001 if another path were to bear more",
    ),
    "events": (
        2,
        "absolute",
        "another rounding may take another path, which needs a few events more or less",
    ),
    "crack_length": (0.1, "relative", "follows the number of events"),
    "last_load": (0.05, "of the peak", "the load that is left falls with each event"),
    "released_energy": (0.1, "relative", "follows the length of the crack"),
    "external_work": (0.02, "relative", "mostly done before the first event"),
    "tension_share": (0.15, "absolute", "events in tension over all"),
    "fragments": (0, "absolute", "pieces that have come apart"),
    "exit_status": (0, "absolute", "how the runs ended"),
}
LOADS = ("loads_before_first_event", "peak_load", "last_load", "first_event_load")  # of each monitor
MODES = {"tension": 1, "shear": 2}


@dataclass
class Difference:
    """One value that is further from the reference than is allowed."""

    what: str  #: which quantity, or column and row
    expected: object
    found: object
    far: float  #: in the measure of the tolerance
    tolerance: Mapping[str, object]
    where: str  #: name of the tolerance

    def __str__(self) -> str:
        limit = f"{self.tolerance['tolerance']:g} {self.tolerance['kind']}"
        reason = f": {self.tolerance['reason']}" if self.tolerance.get("reason") else ""
        values = f"{self.expected} and {self.found}, {self.far:.3g} apart"
        return f"{self.what}: {values}, allowed {limit} ({self.where}{reason})"


@dataclass
class Comparison:
    """What came of it."""

    differences: list[Difference] = field(default_factory=list)
    columns: int = 0  #: columns compared
    rows: int = 0  #: rows before the first event
    quantities: int = 0
    same_digests: bool = False


def entry(triple: Sequence[object]) -> dict[str, object]:
    """A tolerance as files have it."""
    return dict(zip(("tolerance", "kind", "reason"), triple))


def usual_tolerances() -> dict[str, dict[str, object]]:
    """What is allowed unless a file says otherwise; a name that is ignored has the text 'ignore'."""
    return {
        part: {name: IGNORE if kept[1] == IGNORE else entry(kept) for name, kept in table.items()}
        for part, table in (("before", BEFORE), ("after", AFTER))
    }


def read_tolerances(path: str | Path | None) -> dict[str, dict[str, object]]:
    """The usual tolerances with what a file changes. ResultsError if the file is wrong."""
    tolerances = usual_tolerances()
    if path is None:
        return tolerances
    content = read_json(path)
    for part, table in content.items():
        if part not in tolerances:
            raise ResultsError(f"{path}: '{part}' is neither 'before' nor 'after'")
        if not isinstance(table, dict):
            raise ResultsError(f"{path}: '{part}' must hold names with their tolerances")
        for name, kept in table.items():
            if part == "after" and name not in AFTER:
                raise ResultsError(f"{path}: {name} is nothing that is compared{nearest(name, list(AFTER))}")
            tolerances[part][name] = kept if kept == IGNORE else checked(path, name, kept)
    return tolerances


def read_json(path: str | Path) -> dict:
    """Content of a file that holds one object; ResultsError if it does not."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultsError(f"{path}: {error.strerror or error}") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ResultsError(f"{path} is no JSON: {error}") from error
    if not isinstance(content, dict):
        raise ResultsError(f"{path} must hold an object: {{..}}")
    return content


def checked(path: str | Path, name: str, kept: object) -> dict[str, object]:
    """A tolerance of a file, or ResultsError."""
    if not isinstance(kept, dict) or set(kept) - {"tolerance", "kind", "reason"}:
        raise ResultsError(f"{path}: {name} must be 'ignore' or have tolerance, kind and reason")
    number = kept.get("tolerance")
    if isinstance(number, bool) or not isinstance(number, (int, float)) or not 0 <= number < np.inf:
        raise ResultsError(f"{path}: tolerance of {name} must be a number from 0")
    if kept.get("kind", "relative") not in KINDS:
        raise ResultsError(f"{path}: kind of {name} must be one of: {', '.join(KINDS)}")
    return {"kind": "relative", "reason": "", **kept}


# --- what is measured ------------------------------------------------------------------------------------


def measure(history: Mapping, events: Mapping, monitor: str | None) -> dict[str, object]:
    """What is kept of a run: the names of AFTER. What it has not (no event, no monitor) is left out."""
    intact = np.asarray(history["event_count"]) == 0
    found: dict[str, object] = {
        "nodes": int(history["nodes"][0]),
        "elements": int(history["elements"][0]),
        "events": int(history["event_count"][-1]),
        "crack_length": float(history["crack_length"][-1]),
        "fragments": int(history["fragments"][-1]),
        "released_energy": float(history["released_energy"][-1]),
        "external_work": float(history["external_work"][-1]),
    }
    if len(events["event"]):
        found |= {
            "first_event_time": float(events["time"][0]),
            "first_event_x": float(events["x"][0]),
            "first_event_y": float(events["y"][0]),
            "first_event_direction": float(events["direction_deg"][0] % 180),
            "first_event_mode": MODES[str(events["mode"][0])],
        }
    if found["events"]:
        found["tension_share"] = float(history["events_tension"][-1] / found["events"])
    if monitor:
        load = np.hypot(history[f"{monitor}_rf1"], history[f"{monitor}_rf2"])
        found |= {
            "loads_before_first_event": [float(value) for value in load[intact]],
            "peak_load": float(load.max()),
            "last_load": float(load[-1]),
        }
        if found["events"]:
            found["first_event_load"] = float(load[intact][-1])
    return found


def difference(quantity: Mapping[str, object], value: object, peak: float = 0.0) -> tuple[float, float]:
    """(how far a value is from its reference, what is allowed), in the reference's own measure.

    `quantity` has value, tolerance and kind, as references store them.
    """
    expected, value = (np.array(item, dtype=float) for item in (quantity["value"], value))
    if value.shape != expected.shape:
        return np.inf, quantity["tolerance"]
    far = np.abs(value - expected).max(initial=0.0)
    scale = {"absolute": 1.0, "relative": np.abs(expected).max(initial=0.0), "of the peak": peak}[
        quantity["kind"]
    ]
    return (float(far / scale) if scale > 0 else float(far)), quantity["tolerance"]


# --- comparing -------------------------------------------------------------------------------------------


def compare(one: Results, two: Results, tolerances: Mapping[str, Mapping] | None = None) -> Comparison:
    """Compare two result sets; the first is the reference. ResultsError where one cannot be read."""
    tolerances = tolerances or usual_tolerances()
    done = Comparison()
    digests = [
        (item.provenance.get("digest_displacements"), item.provenance.get("digest_topology"))
        for item in (one, two)
    ]
    done.same_digests = digests[0] == digests[1] and None not in digests[0]
    compare_before(one, two, tolerances["before"], done)
    names = [name for name in one.monitors if name in two.monitors] or [None]
    for number, monitor in enumerate(names):
        expected, found = (measure(item.history, item.events, monitor) for item in (one, two))
        for values, item in ((expected, one), (found, two)):
            values["exit_status"] = int(item.provenance.get("exit_status", -1))
        if number:  # the rest was compared with the first monitor
            expected, found = (
                {key: values[key] for key in LOADS if key in values} for values in (expected, found)
            )
        stored = {
            name: {"value": value, **tolerances["after"][name]}
            for name, value in expected.items()
            if tolerances["after"][name] != IGNORE
        }
        compare_quantities(stored, found, done, f" of {monitor}" if monitor else "")
    return done


def compare_before(one: Results, two: Results, tolerances: Mapping[str, object], done: Comparison) -> None:
    """The histories' rows before the first event, column by column."""
    before = [np.flatnonzero(np.asarray(item.history["event_count"]) == 0) for item in (one, two)]
    done.rows = len(before[0])
    exact = entry(
        (
            0,
            "absolute",
            "another number of rows: another *OUTPUT, another *STATIC, or another load of the first event",
        )
    )
    if len(before[0]) != len(before[1]):
        done.differences.append(
            Difference("rows before the first event", len(before[0]), len(before[1]),
                       abs(len(before[0]) - len(before[1])), exact, "before")
        )  # fmt: skip
        return
    for name in one.history.names:
        family = family_of(name)
        tolerance = tolerances.get(name, tolerances.get(family, IGNORE))
        if tolerance == IGNORE or one.history[name].dtype.kind not in "iuf":
            continue
        if name not in two.history:
            done.differences.append(
                Difference(f"history column {name}", "there", "missing", np.inf, exact, "before")
            )
            continue
        done.columns += 1
        expected, found = (
            np.asarray(item.history[name][rows], float) for item, rows in ((one, before[0]), (two, before[1]))
        )
        kind = tolerance["kind"]
        scale = 1.0 if kind == "absolute" else largest_of_family(one, name, before[0])
        apart = np.abs(found - expected) / (scale if scale > 0 else 1.0)
        apart[~np.isfinite(apart)] = np.inf
        if (apart > tolerance["tolerance"]).any():
            row = int(np.argmax(apart > tolerance["tolerance"]))
            when = f"step {one.history['step'][row]}, increment {one.history['increment'][row]}"
            label = f"before.{name if name in tolerances else family}"
            done.differences.append(
                Difference(f"history column {name}, row {row} ({when})", repr(float(expected[row])),
                           repr(float(found[row])), float(apart[row]), tolerance, label)
            )  # fmt: skip


def family_of(name: str) -> str:
    """Family of a history column."""
    if name in FAMILY:
        return FAMILY[name]
    return next((family for suffix, family in SUFFIX_FAMILY.items() if name.endswith(suffix)), "other")


def largest_of_family(results: Results, name: str, rows: np.ndarray) -> float:
    """Largest value of the columns that are of one kind: all displacements, all energies ..

    So a column that is nothing but round-off (a support's displacement) is measured by the others.
    """
    family = family_of(name)
    names = (
        [name]
        if family in ("time", "other")
        else [other for other in results.history.names if family_of(other) == family]
    )
    return max(
        float(np.abs(np.asarray(results.history[other][rows], float)).max(initial=0.0)) for other in names
    )


def compare_quantities(
    stored: Mapping[str, Mapping], found: Mapping[str, object], done: Comparison, suffix: str = ""
) -> None:
    """Quantities of a reference (value, tolerance, kind, reason each) against those of a run."""
    if "first_event_time" in found and stored.get("events", {}).get("value") == 0:
        exact = entry((0, "absolute", "the reference has no event"))
        done.differences.append(
            Difference("first_event_time", "none", found["first_event_time"], np.inf, exact, "after")
        )
    for name, quantity in stored.items():
        done.quantities += 1
        label = name + suffix if name in LOADS else name
        if name not in found:
            done.differences.append(
                Difference(label, quantity["value"], "none", np.inf, quantity, f"after.{name}")
            )
            continue
        far, allowed = difference(quantity, found[name], float(found.get("peak_load", 0.0)))
        if not far <= allowed:
            expected, value, what = quantity["value"], found[name], label
            if isinstance(expected, list):
                expected, value, what = first_apart(expected, value, what)
            done.differences.append(Difference(what, expected, value, far, quantity, f"after.{name}"))


def first_apart(expected: list, found: list, what: str) -> tuple[object, object, str]:
    """Of two lists: their lengths if these differ, else the values that differ most, with the row."""
    if len(expected) != len(found):
        return len(expected), len(found), f"{what}, number of rows"
    row = int(np.argmax(np.abs(np.array(expected) - np.array(found))))
    return expected[row], found[row], f"{what}, row {row}"


# --- stored references -----------------------------------------------------------------------------------


def compare_with_reference(reference: Mapping, found: Mapping[str, object]) -> Comparison:
    """A run's quantities (`measure`) against a stored reference, which has its own tolerances."""
    done = Comparison()
    compare_quantities(reference["quantities"], found, done)
    done.rows = len(found.get("loads_before_first_event", ()))
    return done


def read_reference(path: str | Path) -> dict:
    """A stored reference; ResultsError if the file is none."""
    content = read_json(path)
    quantities = content.get("quantities")
    if (
        not isinstance(quantities, dict)
        or not content.get("reason_of_last_change")
        or not content.get("origin")
    ):
        raise ResultsError(f"{path} is no reference: it needs quantities, origin and reason_of_last_change")
    for name, kept in quantities.items():
        if not isinstance(kept, dict) or "value" not in kept or not kept.get("reason"):
            raise ResultsError(f"{path}: {name} needs a value, a tolerance, a kind and a reason")
        checked(path, name, {key: value for key, value in kept.items() if key != "value"})
    return content


# --- the command -----------------------------------------------------------------------------------------


def make_parser() -> Parser:
    """The command line."""
    parser = Parser(
        prog="rfem_compare.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="exit status: 0 equal within the tolerances, 1 different, 2 wrong usage or nothing to read",
    )
    parser.add_argument("one", metavar="JOB1", nargs="?", help="the reference: a job, or NAME.json")
    parser.add_argument("two", metavar="JOB2", nargs="?", help="the run that is compared with it")
    parser.add_argument("--tolerance", metavar="FILE", help="tolerances other than the usual ones (JSON)")
    parser.add_argument("--monitor", metavar="NAME", help="with NAME.json: the monitor (default: the first)")
    parser.add_argument("--tolerances", action="store_true", help="print the tolerances that hold, and end")
    return parser


def run(options: argparse.Namespace) -> int:
    """Compare as the options ask; 0 equal, 1 different."""
    tolerances = read_tolerances(options.tolerance)
    if options.tolerances:
        print(json.dumps(tolerances, indent=1))
        return 0
    if options.one is None or options.two is None:
        raise ResultsError("two jobs are needed: rfem_compare.py JOB1 JOB2")
    with open_results(options.two) as two:
        if options.one.endswith(".json"):
            monitor = options.monitor or next(iter(two.monitors), None)
            if options.tolerance:
                raise ResultsError(
                    "a stored reference has its own tolerances: --tolerance does not go with it"
                )
            done = compare_with_reference(
                read_reference(options.one), measure(two.history, two.events, monitor)
            )
        else:
            with open_results(options.one) as one:
                done = compare(one, two, tolerances)
                say_what_is_unreadable(one)
        say_what_is_unreadable(two)
    for item in done.differences:
        print(f"differs: {item}")
    counts = f"{done.rows} rows before the first event, {done.columns} columns, {done.quantities} quantities"
    if done.differences:
        print(f"different: {len(done.differences)} differences ({counts})")
        return 1
    digests = "; digests are equal: the same answer to the last bit" if done.same_digests else ""
    print(f"equal within the tolerances ({counts}){digests}")
    return 0


def say_what_is_unreadable(results: Results) -> None:
    """Files that were passed over, on standard error."""
    for reason in results.unreadable:
        sys.stderr.write(
            f"rfem_compare: note: {reason} ({results.job}_history.csv and _events.csv are compared)\n"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: 0 equal, 1 different, 2 wrong usage."""
    options = make_parser().parse_args(arguments)
    try:
        return run(options)
    except ResultsError as error:
        sys.stderr.write(f"rfem_compare: error: {' '.join(str(error).split())}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())

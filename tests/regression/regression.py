#!/usr/bin/env python3
"""Run the regression cases and compare them with their references; write a reference anew. ./run regression calls this.

    ./run regression [NAME..]                                 run the cases (all), compare, change nothing
    ./run regression --update NAME --why "what changed, and why that is right"

Nothing else writes references. What differs is shown first; tolerances that stand in the reference are kept, new
quantities get those of rfem_compare.py; the reason is stored in the reference.
"""

import argparse
import datetime
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from cases import CASES, REFERENCES, compute, kept, reference
from rfem_compare import AFTER, compare_with_reference, difference, entry
from rfem_run import PROGRAM, call


def origin():
    """Where the numbers come from."""
    version, flags = call("--version").stdout.splitlines()[:2]
    machine = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    processor = re.search(r"model name\s*:\s*(.*)", machine)
    return {
        "date": datetime.date.today().isoformat(),
        "program": version,
        "flags": flags.removeprefix("flags: "),
        "processor": processor[1] if processor else "unknown",
    }


def found_now(name):
    """Run a case: what is kept of it."""
    with tempfile.TemporaryDirectory() as folder:
        return kept(name, compute(name, folder))


def check(names):
    """Compare cases with their references; 1 if some differ."""
    wrong = 0
    for name in names:
        done = compare_with_reference(reference(name), found_now(name))
        for item in done.differences:
            print(f"{name} differs: {item}")
        print(f"{name}: {f'{len(done.differences)} of' if done.differences else 'all'} {done.quantities} quantities "
              f"{'differ' if done.differences else 'as in the reference'}", flush=True)  # fmt: skip
        wrong += bool(done.differences)
    return 1 if wrong else 0


def update(name, why):
    """Write the reference of a case anew, for a reason."""
    path = REFERENCES / f"{name}.json"
    old = reference(name)["quantities"] if path.exists() else {}
    quantities = {}
    for key, value in found_now(name).items():
        quantities[key] = {**entry(AFTER[key]), **old.get(key, {}), "value": value}
        if key in old and value != old[key]["value"]:
            far, allowed = difference(old[key], value, old.get("peak_load", {}).get("value", 0.0))
            change = "changes" if isinstance(value, list) else f"{old[key]['value']} becomes {value}"
            print(f"{name} {key}: {change}, {far:.3g} apart ({old[key]['kind']}, allowed {allowed:g})")
    case = CASES[name]
    content = {
        "deck": case.deck,
        "arguments": case.arguments,
        "edits": case.edits,
        "origin": origin(),
        "reason_of_last_change": why,
        "quantities": quantities,
    }
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(content, indent=1) + "\n")
    print(f"{path} is written")
    subprocess.run(["git", "-C", path.parent, "diff", "--stat", "--", "."], check=False, stderr=subprocess.DEVNULL)
    return 0


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="./run regression", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"cases to compare: {', '.join(CASES)} (default: all)")
    parser.add_argument("--update", metavar="NAME", choices=list(CASES), help="the case whose reference is to change")
    parser.add_argument("--why", help="the reason of the change: it is stored in the reference")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.names if name not in CASES]:
        parser.error(f"{unknown[0]} is no case: {', '.join(CASES)}")
    if not os.access(PROGRAM, os.X_OK):
        parser.error(f"there is no program {PROGRAM}; RFEM says where it is")
    if options.update is None:
        if options.why is not None:
            parser.error("--why goes with --update NAME")
        return check(options.names or list(CASES))
    if options.names:
        parser.error("--update takes one case at a time")
    if len(re.findall(r"\w{2,}", options.why or "")) < 4:
        parser.error('--update needs --why "a reason that somebody else can follow"')
    return update(options.update, options.why.strip())


if __name__ == "__main__":
    sys.exit(main())

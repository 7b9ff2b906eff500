#!/usr/bin/env python3
"""Write the reference of a regression case anew; nothing else writes them.

    RFEM=PATH PYTHONPATH=tests/support python3 tests/regression/update.py NAME --why "what changed, why it is right"

Tolerances that stand in the reference are kept; new quantities get those of cases.py. The difference is shown first.
"""

import argparse
import datetime
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from cases import CASES, REFERENCES, TOLERANCES, compute, difference, measure, reference
from rfem_run import call


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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=[*CASES, "all"])
    parser.add_argument("--why", required=True, help="the reason of the change: it is stored in the reference")
    arguments = parser.parse_args()
    if len(arguments.why.split()) < 3:
        parser.error("--why needs a reason that somebody else can follow")
    for name in CASES if arguments.name == "all" else [arguments.name]:
        with tempfile.TemporaryDirectory() as folder:
            found = measure(name, compute(name, folder))
        path = REFERENCES / f"{name}.json"
        old = reference(name)["quantities"] if path.exists() else {}
        for key, value in found.items():
            if key in old:
                far, allowed = difference(old[key], value, found["peak_load"])
                print(f"{name} {key}: differs by {far:.3g} ({old[key]['kind']}, allowed {allowed:g})")
        quantities = {}
        for key, value in found.items():
            tolerance, kind, reason = TOLERANCES[key]
            kept = {"tolerance": tolerance, "kind": kind, "reason": reason, **old.get(key, {})}
            quantities[key] = {**kept, "value": value}
        case = CASES[name]
        content = {
            "deck": case.deck,
            "arguments": case.arguments,
            "edits": case.edits,
            "origin": origin(),
            "reason_of_last_change": arguments.why,
            "quantities": quantities,
        }
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(content, indent=1) + "\n")
        print(f"{path} is written")
    return subprocess.run(["git", "-C", REFERENCES, "diff", "--stat", "--", "."], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Compare displacements of rfem and CalculiX for one deck, node by node.

    compare_ccx.py DECK --rfem PATH [--ccx PATH] [--tolerance 1e-5]     runs both in a scratch directory
    compare_ccx.py --tables RFEM.dat CCX.dat [--tolerance 1e-5]         compares two tables that exist

Both programs write `*NODE PRINT` tables of U to JOB.dat. Compared is, for every set, the last table: the largest
difference of a component over the largest displacement of CalculiX. Exit status: 0 equal within the tolerance, 1 not,
2 nothing to compare (a program missing, a run that failed, other nodes).
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HEADER = re.compile(r"^\s*displacements \(vx,vy,vz\) for set\s+(\S+) and time\s+(\S+)", re.IGNORECASE)
# CalculiX prints -1.234567E-101 as -1.234567-101: the Fortran form without the letter
BARE_EXPONENT = re.compile(r"(?<=[0-9.])([+-][0-9]{3})$")


class NothingToCompare(Exception):
    """The comparison cannot be made; the text says why."""


def number(text):
    """A Fortran or C real number."""
    return float(BARE_EXPONENT.sub(r"E\1", text.replace("D", "E").replace("d", "e")))


def read_displacements(path):
    """The last displacement table of each set: {set: (time, {node: (u1, u2)})}."""
    tables = {}
    rows = None
    for line in Path(path).read_text().splitlines():
        header = HEADER.match(line)
        fields = line.split()
        if header:
            rows = {}
            tables[header.group(1).upper()] = (number(header.group(2)), rows)
        elif rows is not None and len(fields) == 4 and fields[0].isdigit():
            rows[int(fields[0])] = (number(fields[1]), number(fields[2]))
        elif fields:
            rows = None
    if not tables:
        raise NothingToCompare(f"{path}: no table of displacements (*NODE PRINT with U)")
    return tables


def largest_difference(rfem, ccx):
    """(largest difference of a component, its node, largest displacement in ccx) of two node tables."""
    if rfem.keys() != ccx.keys():
        odd = sorted(rfem.keys() ^ ccx.keys())
        raise NothingToCompare(f"{len(odd)} nodes stand in one table only, the first is {odd[0]}")
    differences = {node: max(abs(rfem[node][k] - ccx[node][k]) for k in (0, 1)) for node in ccx}
    worst = max(differences, key=differences.get)
    return differences[worst], worst, max((u * u + v * v) ** 0.5 for u, v in ccx.values())


def compare(rfem_path, ccx_path, tolerance):
    """Print a line for each set; True if all are within the tolerance."""
    rfem_tables = read_displacements(rfem_path)
    ccx_tables = read_displacements(ccx_path)
    if rfem_tables.keys() != ccx_tables.keys():
        raise NothingToCompare(f"sets differ: rfem {sorted(rfem_tables)}, ccx {sorted(ccx_tables)}")
    good = True
    for name, (time, ccx) in sorted(ccx_tables.items()):
        rfem_time, rfem = rfem_tables[name]
        if abs(rfem_time - time) > 1e-6 * abs(time):
            raise NothingToCompare(f"set {name}: last table at time {rfem_time} in rfem, {time} in ccx")
        difference, node, largest = largest_difference(rfem, ccx)
        relative = difference / largest if largest > 0 else difference
        passed = relative <= tolerance  # False for NaN
        good = good and passed
        print(
            f"set {name}: {len(ccx)} nodes, largest displacement {largest:.6e}, largest difference {difference:.3e}"
            f" (node {node}) = {relative:.2e} of it, tolerance {tolerance:.0e}: {'pass' if passed else 'FAIL'}"
        )
    return good


def run(command, directory):
    """Run a program; its output is shown only if it fails."""
    try:
        done = subprocess.run(
            command, cwd=directory, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
        )
    except OSError as problem:
        raise NothingToCompare(f"{command[0]}: {problem.strerror}") from problem
    if done.returncode != 0:
        raise NothingToCompare(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout[-2000:]}")


def run_both(deck, rfem, ccx, scratch):
    """Run the deck in both programs, CalculiX in a copy of its folder; the paths of the two tables."""
    folder = scratch / "ccx"
    shutil.copytree(deck.parent, folder)
    (folder / f"{deck.stem}.dat").unlink(missing_ok=True)
    run([rfem, str(deck), "--job", deck.stem, "--output", str(scratch / "rfem"), "--quiet"], deck.parent)
    run([ccx, deck.stem], folder)
    return scratch / "rfem" / f"{deck.stem}.dat", folder / f"{deck.stem}.dat"


def program(name):
    """A path given with a slash is taken from here, a bare name from the PATH."""
    return os.path.abspath(name) if os.sep in name else name


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck", nargs="?", type=Path)
    parser.add_argument("--tables", nargs=2, metavar=("RFEM.dat", "CCX.dat"))
    parser.add_argument("--rfem", default="rfem")
    parser.add_argument("--ccx", default="ccx")
    parser.add_argument("--tolerance", type=float, default=1e-5)
    arguments = parser.parse_args()
    if (arguments.deck is None) == (arguments.tables is None):
        parser.error("give a deck, or --tables and two files")
    try:
        if arguments.tables:
            good = compare(*arguments.tables, arguments.tolerance)
        else:
            deck = arguments.deck.resolve()
            if not deck.is_file():
                raise NothingToCompare(f"{deck}: no such deck")
            with tempfile.TemporaryDirectory(prefix="compare_ccx_") as scratch:
                tables = run_both(deck, program(arguments.rfem), program(arguments.ccx), Path(scratch))
                good = compare(*tables, arguments.tolerance)
    except (NothingToCompare, OSError) as problem:
        print(f"compare_ccx: {problem}", file=sys.stderr)
        return 2
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

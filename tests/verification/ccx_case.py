"""The ccx_* cases: one deck in rfem and in CalculiX, displacements compared node by node.

Where there is no ccx on the PATH, the table that CalculiX 2.20 wrote for the deck (calculix.dat beside it) takes its
place, and a note says so. `ccx_case.py CASE..` writes these tables anew.
"""

import shutil
import sys
from pathlib import Path

import compare_ccx
from rfem_verify import CASES, VerifyError

TABLE = "calculix.dat"


def run_ccx(folder, job):
    """Run the deck in CalculiX, in a folder that holds it; the path of its table."""
    compare_ccx.run([shutil.which("ccx"), job], folder)
    return folder / f"{job}.dat"


def check(case, tolerance):
    """A row for the displacements of every set that the deck prints."""
    job = case.name
    case.run(f"{job}.inp")
    table = case.work / TABLE
    if shutil.which("ccx"):
        folder = case.work / "ccx"
        shutil.copytree(case.source, folder, ignore=shutil.ignore_patterns("__pycache__"))
        table = run_ccx(folder, job)
    elif table.exists():
        case.note("No ccx was found: compared with the table that CalculiX 2.20 wrote for this deck.")
    else:
        raise VerifyError(f"there is neither ccx on the PATH nor {TABLE}")
    rfem = compare_ccx.read_displacements(case.work / f"{job}.dat")
    for name, (_, ccx) in sorted(compare_ccx.read_displacements(table).items()):
        difference, node, largest = compare_ccx.largest_difference(rfem[name][1], ccx)
        quantity = "largest difference of a displacement / largest displacement"
        case.at_most(quantity, difference / largest, tolerance, kind="code")
        case.note(f"{len(ccx)} nodes; largest displacement {largest:.6g}, largest difference at node {node}.")


def store(name):
    """Write calculix.dat of a case."""
    import tempfile

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / name
        shutil.copytree(CASES / name, folder)
        text = run_ccx(folder, name).read_text()
    (CASES / name / TABLE).write_text("\n".join(line.rstrip() for line in text.splitlines()) + "\n")


if __name__ == "__main__":
    for word in sys.argv[1:]:
        store(word)

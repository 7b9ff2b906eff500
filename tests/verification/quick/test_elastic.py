"""The elastic tutorial deck against CalculiX, an independent program, where it is installed (Debian: calculix-ccx)."""

import re
import shutil
import subprocess
import sys

import pytest
from rfem_run import PROGRAM, SOURCE, run

PLATE = SOURCE / "input" / "tutorial" / "gmsh_plate"


@pytest.mark.skipif(not shutil.which("ccx"), reason="CalculiX (ccx) is not on the PATH; Debian: calculix-ccx")
def test_plate_against_calculix():
    done = subprocess.run(
        [sys.executable, SOURCE / "tests/verification/compare_ccx.py", PLATE / "gmsh_plate.inp", "--rfem", PROGRAM],
        capture_output=True,
        text=True,
    )
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    relative = float(re.search(r"= (\S+) of it", done.stdout)[1])
    assert relative <= 1e-5


# Sparse direct solves of the same triangles (README.md there).
def test_pull_of_the_plate(tmp_path):
    done = run(PLATE / "gmsh_plate.inp", tmp_path, job="plate")
    totals = re.findall(r"total force .* for set RIGHT .*\n\n\s+(\S+)", done.path(".dat").read_text())
    assert float(totals[-1]) == pytest.approx(238.4575, rel=1e-5)


def test_pull_of_the_plate_as_exported(tmp_path):
    """Plane stress, at the default tolerance; the export's line elements are skipped with a note."""
    done = run(PLATE / "gmsh_plate_as_exported.inp", tmp_path, job="plate")
    assert done.history["GRIP_rf1"][-1] == pytest.approx(223.5517, rel=1e-4)
    assert done.messages.startswith("rfem: note: 110 line elements are left out")

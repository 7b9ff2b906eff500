"""The recipes of docs/developer.md do what they promise: applied as printed to a copy of the project, built, tried."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import pytest
import recipes

SOURCE = Path(os.environ.get("RFEM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
# The copy and its build stay where the test stands: the next run builds only what has changed.
FOLDER = Path("recipes").resolve()
BUILD = FOLDER / "build"

PLATE = """\
*MESH, SHAPE=RECTANGLE, ELSET=PLATE
0., 0., 40., 60., 20, 30
*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*STRENGTH, CRITERION=RANKINE
4.5, 10., 30.
*HETEROGENEITY, DISTRIBUTION=NORMAL
0.02
*SOLID SECTION, ELSET=PLATE, MATERIAL=ROCK
*BOUNDARY
LEFT, 1, 1
BOTTOM, 2, 2
*STEP
*STATIC
0.25, 1.
*FRACTURE, MAX EVENTS=5, CRACK ANGLE=25.
*BOUNDARY
TOP, 2, 2, 0.012
*MONITOR, NAME=GRIP, NSET=TOP
*END STEP
"""


def run(*command, status=0, **more):
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **more)
    assert result.returncode == status, f"{command}: exit status {result.returncode}\n{result.stdout}\n{result.stderr}"
    return result


@pytest.fixture(scope="module")
def built():
    """The folder of the programs, built from the project with all recipes applied."""
    files = recipes.project_files(SOURCE)
    recipes.apply(files, (SOURCE / "docs" / "developer.md").read_text(encoding="utf-8"))
    recipes.write(files, FOLDER / "rfem")
    # -Og without run-time checks: the quickest to build
    flags = "-DCMAKE_BUILD_TYPE=Debug", "-DRFEM_PFUNIT_SUBSET=ON"
    run("cmake", "-S", FOLDER / "rfem", "-B", BUILD, "-G", "Ninja", *flags)
    run("cmake", "--build", BUILD, "--target", "rfem", "rfem_manual", "test_criterion_rankine")
    return BUILD / "bin"


@pytest.fixture(scope="module")
def plate(built, tmp_path_factory):
    """The folder of a plate pulled until it breaks, with the new criterion, parameter and field."""
    folder = tmp_path_factory.mktemp("plate")
    (folder / "plate.inp").write_text(PLATE)
    run(built / "rfem", "plate.inp", "--quiet", cwd=folder)
    return folder


def events(folder, job="plate"):
    with h5py.File(folder / f"{job}.h5") as file:
        return {name: column[:] for name, column in file["rfem/events"].items()}


def test_the_criterion_breaks_the_plate(plate):
    found = events(plate)
    assert len(found["event"]) == 5
    assert set(found["mode"]) == {b"tension"}


def test_the_criterion_bears_any_compression(built, tmp_path):
    (tmp_path / "pressed.inp").write_text(PLATE.replace("0.012", "-0.12"))
    run(built / "rfem", "pressed.inp", "--quiet", cwd=tmp_path)
    assert len(events(tmp_path, "pressed")["event"]) == 0


def test_a_misspelt_criterion_is_told_its_name(built, tmp_path):
    (tmp_path / "plate.inp").write_text(PLATE.replace("RANKINE", "RANKIN"))
    said = run(built / "rfem", "plate.inp", "--check", status=2, cwd=tmp_path).stderr
    assert (
        "plate.inp:6: CRITERION=RANKIN is not known; allowed: GRIFFITH, CUTOFF, RANKINE; did you mean RANKINE?" in said
    )


def test_the_words_are_in_the_manual(built):
    manual = run(built / "rfem_manual").stdout
    assert "| CRITERION | GRIFFITH, CUTOFF, RANKINE | GRIFFITH |" in manual
    assert "RANKINE: tension only" in manual
    assert "| CRACK ANGLE | number at least 0 and below 90 | 30 | degrees |" in manual
    assert "### `*CHILD ANGLE`" in manual
    assert "| angle | number above 0 and at most 60 | 12 | degrees |" in manual


def test_the_words_are_explained(built, tmp_path):
    (tmp_path / "plate.inp").write_text(PLATE.replace("*END STEP", "*CHILD ANGLE\n15.\n*END STEP"))
    explained = run(built / "rfem", "plate.inp", "--explain", cwd=tmp_path).stdout
    lines = [" ".join(line.split()) for line in explained.splitlines()]
    assert "CRACK ANGLE = 25. plate.inp:17" in lines, explained
    assert "STEP 1: *CHILD ANGLE plate.inp:21" in lines, explained
    assert "angle = 15. plate.inp:22" in lines, explained


def test_the_keyword_has_its_effect(built, plate, tmp_path):
    """Triangles of 60 degrees are cut into some of 30: nothing can be split if 45 are asked for."""
    (tmp_path / "stiff.inp").write_text(PLATE.replace("*END STEP", "*CHILD ANGLE\n45.\n*END STEP"))
    run(built / "rfem", "stiff.inp", "--quiet", cwd=tmp_path)
    assert len(events(tmp_path, "stiff")["event"]) == 0
    with h5py.File(tmp_path / "stiff.h5") as file:
        assert file["rfem/history/exhausted"][-1] > 0


def test_the_field_is_in_every_frame(plate):
    with h5py.File(plate / "plate.vtkhdf") as file:
        steps = file["VTKHDF/Steps"]
        cells = file["VTKHDF/NumberOfCells"][:][steps["PartOffsets"][:]]
        offsets = steps["CellDataOffsets/area"][:]
        area = file["VTKHDF/CellData/area"][:]
        assert len(cells) > 2
        assert cells[-1] > cells[0]
        for n, start in zip(cells, offsets):
            assert area[start : start + n].sum() == pytest.approx(2400, rel=1e-5)  # 32-bit reals


def test_the_unit_test_passes(built):
    said = run(BUILD / "tests" / "unit" / "test_criterion_rankine")
    assert "OK" in said.stdout + said.stderr


def test_the_deck_test_passes(built):
    tests = FOLDER / "rfem" / "tests" / "deck"
    run(sys.executable, tests / "run_decks.py", "--rfem", built / "rfem", tests / "bad" / "child_angle.inp")


def test_the_verification_case_passes(built, tmp_path):
    suite = FOLDER / "rfem" / "tests" / "verification" / "verify_suite.py"
    environment = {**os.environ, "RFEM": str(built / "rfem"), "MPLBACKEND": "Agg"}
    said = run(sys.executable, suite, "--work", tmp_path, "rankine_bar", env=environment).stdout
    assert "verification: 2 rows, 2 passed, 0 failed" in said

"""The documentation agrees with the project: code that is quoted, equations that are cited, links, decks, columns."""

import csv
import os
import re
import subprocess
from pathlib import Path

import h5py
import pytest

SOURCE = Path(os.environ.get("RFEM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
PAGES = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *sorted((SOURCE / "docs").glob("*.md"))]
# made by hand from a run, or by other work than the pages
MAY_BE_MISSING = {"docs/three_point_bending.png", "docs/verification.md"}


def text_of(name):
    return (SOURCE / name).read_text(encoding="utf-8")


def fenced(text, start):
    """(path, block) of every fenced block whose first line is ```START=PATH."""
    return re.findall(rf"^```{start}=(\S+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def bare(text):
    """Lines without indentation, without empty ones."""
    return [line.strip() for line in text.splitlines() if line.strip()]


QUOTED = fenced(text_of("docs/timestep.md"), "fortran from")


@pytest.mark.parametrize("quote", range(len(QUOTED)))
def test_quoted_code_is_in_the_file(quote):
    path, block = QUOTED[quote]
    code = "\n".join(["", *bare(text_of(path)), ""])
    for part in re.split(r"^\.\.\.\n", block, flags=re.MULTILINE):
        assert "\n".join(["", *bare(part), ""]) in code, f"docs/timestep.md quotes what {path} does not say:\n{part}"


def test_code_is_quoted():
    assert len(QUOTED) > 10


def test_cited_equations_exist():
    theory = text_of("docs/theory.md")
    defined = [int(n) for n in re.findall(r"^ {4}\S.*\((\d+)\)\s*$", theory, re.MULTILINE)]
    assert defined == list(range(1, len(defined) + 1))
    sections = {int(n) for n in re.findall(r"^## (\d+)\.", theory, re.MULTILINE)}
    cited = 0
    for path in sorted((SOURCE / "src").rglob("*.f90")):
        text = re.sub(r"\n\s*!>?\s*", " ", path.read_text(encoding="utf-8"))
        for what, numbers in re.findall(r"theory: (?:section \d+, )?(eqs?\.|section) ([\d, and to]+)", text):
            for number in map(int, re.findall(r"\d+", numbers)):
                cited += 1
                assert number in (sections if what == "section" else defined), f"{path}: {what} {number}"
    assert cited > 20


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"https?:|mailto:", target):
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        if path.relative_to(SOURCE.resolve()).as_posix() not in MAY_BE_MISSING:
            assert path.exists(), f"{page.name}: {target}"
        if anchor:
            assert anchor in anchors(path), f"{page.name}: {target}"


def decks():
    """Complete decks that the pages show (a recipe's deck, with `file=` in its first line, has a test of its own)."""
    for page in PAGES:
        blocks = re.findall(r"^```([^\n]*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        for info, block in blocks:
            if info in ("", "inp") and "*END STEP" in block.upper():
                yield page.name, block


def test_pages_show_decks():
    assert {page for page, _ in decks()} >= {"README.md", "deck.md"}


@pytest.mark.parametrize(("page", "deck"), list(decks()))
def test_decks_of_the_pages_run(page, deck, tmp_path):
    (tmp_path / "deck.inp").write_text(deck)
    result = subprocess.run(
        [os.environ["RFEM"], "deck.inp", "--quiet"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, f"{page}:\n{deck}\n{result.stderr}"
    assert "rfem: warning" not in result.stderr, result.stderr


DECK = """\
*MESH, SHAPE=RECTANGLE, ELSET=PLATE
0., 0., 40., 60., 20, 30
*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*DENSITY
2.6E-9
*STRENGTH
4.5, 10., 30.
*HETEROGENEITY, DISTRIBUTION=NORMAL
0.02
*SOLID SECTION, ELSET=PLATE, MATERIAL=ROCK
*RESTART, WRITE
*BOUNDARY
LEFT, 1, 1
BOTTOM, 2, 2
*STEP
*STATIC
0.25, 1.
*FRACTURE, MAX EVENTS=3
*BOUNDARY
TOP, 2, 2, 0.012
*MONITOR, NAME=NAME, NSET=TOP
*SECTION CHECK, NAME=NAME
20., 30., 0., 1.
*NODE PRINT, NSET=TOP, TOTALS=YES
U, RF
*EL PRINT, ELSET=PLATE
S, E
*OUTPUT, FIELD, EVENTS=1, FORMAT=BOTH
*END STEP
*STEP
*DYNAMIC, EXPLICIT
, 1E-6
*END STEP
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    (folder / "JOB.inp").write_text(DECK)
    subprocess.run([os.environ["RFEM"], "JOB.inp", "--quiet"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return folder


def section(title):
    """The names in the first column of the tables below a heading (or a bold line) of results.md."""
    page = text_of("docs/results.md")
    start = re.search(rf"^(## {title}$|\*\*{title}\*\*)", page, re.MULTILINE).end()
    text = re.split(r"^(?:## |\*\*\w)", page[start:], maxsplit=1, flags=re.MULTILINE)[0]
    cells = re.findall(r"^\| ([^|]*`[^|]*) \|", text, re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}


def test_the_files_are_those_of_the_page(results):
    named = set(re.findall(r"`(JOB[\w.]*)`", text_of("docs/results.md").split("\n## ")[0]))
    assert {path.name for path in results.iterdir()} == (named - {"JOB"}) | {"JOB.inp"}


@pytest.mark.parametrize(("title", "table"), [("History", "history"), ("Events", "events")])
def test_columns_are_those_of_the_page(results, title, table):
    with open(results / f"JOB_{table}.csv", newline="") as file:
        columns = next(csv.reader(file))
    assert set(columns) == section(title)
    with h5py.File(results / "JOB.h5") as file:
        assert set(file[f"rfem/{table}"]) == set(columns)


@pytest.mark.parametrize(
    ("name", "group", "title"),
    [
        ("JOB.vtkhdf", "PointData", "Points"),
        ("JOB.vtkhdf", "CellData", "Cells"),
        ("JOB_cracks.vtkhdf", "CellData", "Crack segments"),
    ],
)
def test_fields_are_those_of_the_page(results, name, group, title):
    with h5py.File(results / name) as file:
        assert set(file[f"VTKHDF/{group}"]) == section(title)


def test_provenance_is_that_of_the_page(results):
    with h5py.File(results / "JOB.h5") as file:
        found = set(file["rfem"].attrs) | {f"settings/{name}" for name in file["rfem/settings"]} | {"deck"}
        assert found == section("JOB.h5")
        assert file["rfem/deck"][()].decode() == DECK


def test_headers_of_the_tables_are_those_of_the_page(results):
    page = text_of("docs/results.md")
    headers = re.findall(
        r"^ (\S.* for set) NAME and time  T$".replace("NAME and time  T", r"\w+ and time .*"),
        (results / "JOB.dat").read_text(),
        re.MULTILINE,
    )
    assert len(set(headers)) == 5
    for header in headers:
        assert header in page

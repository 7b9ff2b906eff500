"""Writes docs/verification.md: what `./run verify` found, for a reader of the repository."""

import os
import platform
import re
import shutil
from pathlib import Path

from rfem_verify import CASES, KINDS, PROJECT, SECTIONS

PAGE = PROJECT / "docs" / "verification.md"
FIGURES = PROJECT / "docs" / "verification"
HOW_TO_READ = """\
## How to read it

A row is one number that the program computed, beside what it should be and how far off it may be. The tolerances were
written down before the first run and are not eased: what fails stays here as failing, with what is known of the cause.
Nothing is calibrated: strengths go in as they are measured and must come out. An error is relative to the expected
value unless it has a unit. *Kind* says what the expected value rests on:

KINDS

Each case is a folder with its deck, and a README with the formula, its source and the reason for the tolerance;
`./run verify NAME` runs it alone. How to add one: [developer.md](developer.md#46-a-verification-case).
"""
HEAD = "| quantity | computed | expected | error | tolerance | kind | pass |\n|---|---|---|---|---|---|---|"


def machine():
    """Processor and number of cores."""
    try:
        found = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.M)
    except OSError:
        found = None
    return f"{found[1] if found else platform.processor() or platform.machine()}, {os.cpu_count()} cores"


def cell(text):
    """A text as a cell of a table: comparison signs as such, no bar that would end the cell."""
    text = str(text).replace("|", "\\|").replace("<=", "≤").replace(">=", "≥")
    return text.replace("<", "&lt;").replace("*", "\\*").replace("_", "\\_")


def first_paragraph(readme):
    """The first paragraph of a README that is no heading."""
    for block in re.split(r"\n\s*\n", readme.read_text(encoding="utf-8") if readme.exists() else ""):
        text = "\n".join(line for line in block.splitlines() if not line.startswith("#")).strip()
        if text:
            return re.sub(r"\]\((?!https?:|#)", f"](../{readme.parent.relative_to(PROJECT).as_posix()}/", text)
    return ""


def verdict(row):
    """The last column."""
    if row["passed"]:
        return "pass"
    return "**fails** (known)" if row["known"] else "**fails**"


def row_line(row):
    """A row as Markdown."""
    unit = f" {row['unit']}" if row["unit"] else ""
    fields = (row["quantity"], row["computed"] + unit, row["expected"] + unit, row["error"], row["tolerance"])
    return "| " + " | ".join([*map(cell, fields), row["kind"], verdict(row)]) + " |"


def case_block(record):
    """Title, what, table, notes and figures of a case."""
    folder = CASES / record["case"]
    link = f"../{folder.relative_to(PROJECT).as_posix()}"
    lines = [f"### {record['title']}", "", first_paragraph(folder / "README.md"), ""]
    lines += [f"[`{record['case']}`]({link})", "", HEAD, *map(row_line, record["rows"]), ""]
    for row in record["rows"]:
        if row["known"]:
            lines += [f"*{cell(row['quantity'])}* fails: {row['known']}", ""]
    for note in record["notes"]:
        lines += [note, ""]
    for figure in record["figures"]:
        lines += [f"![{figure['caption']}](verification/{figure['file']})", "", f"*{figure['caption']}*", ""]
    return lines


def first_figures(records):
    """The figures that stand at the top of the page."""
    lines = []
    for record in records:
        for figure in record["figures"]:
            if figure.get("first"):
                lines += [f"![{figure['caption']}](verification/{figure['file']})", ""]
                lines += [f"*{figure['caption']}* ([{record['title']}](#{anchor(record['title'])}))", ""]
    return ["## At a glance", "", *lines] if lines else []


def anchor(title):
    """The anchor that GitHub makes of a heading."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def case_table(records):
    """The cases of a section: rows, passed, failed."""
    lines = ["| case | rows | passed | failed | seconds |", "|---|---|---|---|---|"]
    for record in records:
        passed = sum(row["passed"] for row in record["rows"])
        failed = len(record["rows"]) - passed
        title = f"[{cell(record['title'])}](#{anchor(record['title'])})"
        lines.append(f"| {title} | {len(record['rows'])} | {passed} | {failed or ''} | {record['seconds']:.0f} |")
    return lines


def section_table(records):
    """Cases and rows by section."""
    lines = ["| section | cases | rows | passed | failed |", "|---|---|---|---|---|"]
    for section, title in SECTIONS.items():
        here = [record for record in records if record["section"] == section]
        rows = [row for record in here for row in record["rows"]]
        passed = sum(row["passed"] for row in rows)
        if here:
            lines.append(f"| {title} | {len(here)} | {len(rows)} | {passed} | {len(rows) - passed} |")
    return lines


def page(records, facts, counts):
    """The text of the page."""
    rows, passed, failed, known = counts
    lines = [
        "# Verification: what rfem computes, and what it should",
        "",
        f"`./run verify` on {facts['date']}, commit {facts['commit']}, {facts['version']};",
        f"{facts['machine']}; {facts['seconds'] / 60:.0f} min of one core. This page is written by that command.",
        "",
        f"**{rows} rows, {passed} passed, {failed} failed{f' ({known} with a known cause)' if known else ''}.**",
        "",
        *section_table(records),
        "",
        *first_figures(records),
        HOW_TO_READ.replace("KINDS", "\n".join(f"- **{kind}**: {meaning}." for kind, meaning in KINDS.items())),
    ]
    for section, title in SECTIONS.items():
        here = [record for record in records if record["section"] == section]
        if here:
            lines += [f"## {title}", "", *case_table(here), ""]
            for record in here:
                lines += case_block(record)
    lines += ["## Known failures", ""]
    failing = [(record["case"], row) for record in records for row in record["rows"] if not row["passed"]]
    lines += [f"- `{case}`, {cell(row['quantity'])}: {row['known'] or 'cause not known yet'}" for case, row in failing]
    lines += [] if failing else ["None."]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines).rstrip()) + "\n"


def write(records, facts, counts, work):
    """The page, and the figures of these records; figures of before go."""
    if FIGURES.exists():
        for old in FIGURES.glob("*.png"):
            old.unlink()
    for record in records:
        for figure in record["figures"]:
            FIGURES.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(work / record["case"] / figure["file"], FIGURES / figure["file"])
    PAGE.write_text(page(records, facts, counts), encoding="utf-8")

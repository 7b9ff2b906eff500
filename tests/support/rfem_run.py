"""Runs rfem for tests: a deck (as it stands or with a few words replaced), its exit, its log, its tables.

The program is RFEM, the project RFEM_SOURCE_DIR (CMake sets both). All is written below a folder that the test gives.
"""

import csv
import os
import re
import subprocess
from pathlib import Path

import numpy as np

SOURCE = Path(os.environ.get("RFEM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
PROGRAM = os.environ.get("RFEM", str(SOURCE / "build" / "release" / "bin" / "rfem"))
PAPER = SOURCE / "input" / "paper"
BEAM = PAPER / "three_point_bending.inp"
# what a crash looks like: no test takes one for a message
CRASH = re.compile(r"Fortran runtime error|Backtrace for this error|Sanitizer|runtime error:|Error termination")


class Run:
    """A run that has ended: `status`, `log` (standard output), `messages` (standard error) and the results."""

    def __init__(self, done, folder, job):
        self.status, self.log, self.messages = done.returncode, done.stdout, done.stderr
        self.folder, self.job = Path(folder), job

    def path(self, suffix):
        """A result file, such as '.vtkhdf' or '_history.csv'."""
        return self.folder / (self.job + suffix)

    @property
    def history(self):
        """Columns of the history, by name."""
        return table(self.path("_history.csv"))

    @property
    def events(self):
        """Columns of the events, by name."""
        return table(self.path("_events.csv"))

    @property
    def digests(self):
        """Digests of displacements and of topology, from the log."""
        return re.search(r"^digest displacements=([0-9A-F]{16}) topology=([0-9A-F]{16})$", self.log, re.M).groups()


def table(path):
    """A CSV table: name -> array, of integers or reals where all values are, else of texts."""
    with open(path, newline="") as file:
        header, *rows = list(csv.reader(file))
    columns = {}
    for name, values in zip(header, list(zip(*rows)) or [()] * len(header)):
        for kind in (int, float, str):
            try:
                columns[name] = np.array([kind(value) for value in values], dtype=kind)
                break
            except ValueError:
                continue
    return columns


def call(*arguments, cwd=None, threads=1, timeout=600, **options):
    """The program with these arguments; nothing is asked of the outcome but that it is no crash."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "OMP_WAIT_POLICY": "passive"}
    if "input" not in options:
        options.setdefault("stdin", subprocess.DEVNULL)
    done = subprocess.run(
        [PROGRAM, *map(str, arguments)],
        cwd=cwd,
        env=environment,
        timeout=timeout,
        capture_output=True,
        text=True,
        **options,
    )
    assert not CRASH.search(done.stderr), done.stderr
    assert done.returncode >= 0, f"killed by signal {-done.returncode}"
    return done


def run(deck, folder, *arguments, job=None, status=0, **options):
    """Run a deck into a folder; the exit status must be as expected."""
    job = job or Path(deck).stem
    if "--verbose" not in arguments:
        arguments = (*arguments, "--quiet")
    arguments = [argument for argument in arguments if argument != "--verbose"]
    done = call(deck, "--output", folder, "--job", job, *arguments, **options)
    assert done.returncode == status, f"exit status {done.returncode}\n{done.stderr}\n{done.stdout[-2000:]}"
    return Run(done, folder, job)


def edited(deck, folder, *edits, name=None):
    """A copy of a deck in the folder with words replaced: (old, new) pairs; each old stands in it once at least.

    What it includes is still found: INPUT= is made absolute.
    """
    deck = Path(deck)
    text = deck.read_text()
    for old, new in edits:
        assert old in text, f"{deck.name} has no {old!r}: the test must follow the deck"
        text = text.replace(old, new)
    text = text.replace("INPUT=mesh/", f"INPUT={deck.parent}/mesh/")
    path = Path(folder) / (name or deck.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def close(a, b, relative):
    """Largest difference over the largest magnitude is small."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return a.shape == b.shape and np.abs(a - b).max(initial=0) <= relative * np.abs(b).max(initial=0)


def read_mesh(path):
    """Nodes (ids, coordinates), triangles (ids, node ids) by element set of an Abaqus mesh."""
    nodes, sets, where = [], {}, None
    for line in Path(path).read_text().splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            words = [word.strip().upper() for word in line.split(",")]
            where = None
            if words[0] == "*NODE":
                where = nodes
            elif words[0] == "*ELEMENT" and any(word in ("TYPE=CPS3", "TYPE=CPE3") for word in words):
                name = next(word[6:] for word in words if word.startswith("ELSET="))
                where = sets.setdefault(name, [])
        elif where is not None:
            where.append([float(word) for word in line.split(",") if word.strip()])
    nodes = np.array(nodes)
    return nodes[:, 0].astype(int), nodes[:, 1:3], {name: np.array(rows, dtype=int) for name, rows in sets.items()}

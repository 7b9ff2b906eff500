"""The runs whose results are kept as references (input/paper/reference/NAME.json), and what is kept of each.

Before the first event a run is elastic and reproducible to the tolerance of relaxation: compared tightly. After it
crack paths bifurcate on rounding (compilers and processors round differently): compared through integrals.
"""

from dataclasses import dataclass, field
from pathlib import Path

from rfem_compare import measure, read_reference
from rfem_run import PAPER, edited, run

REFERENCES = PAPER / "reference"


@dataclass
class Case:
    deck: str
    monitor: str
    arguments: list = field(default_factory=list)
    edits: list = field(default_factory=list)


CASES = {
    "beam_h8": Case("three_point_bending.inp", "LOAD", ["--set", "H=8"]),
    "beam_h4": Case("three_point_bending.inp", "LOAD", ["--set", "H=4"]),
    # a broken block goes on splitting, each relaxation longer than the one before: the first events tell enough
    "rough_block_h5": Case(
        "uniaxial_compression.inp",
        "PLATEN",
        ["--set", "H=5"],
        [("STOP DROP=0.3", "MAX EVENTS=30, STOP DROP=0.3")],
    ),
    "smooth_block_h5": Case(
        "uniaxial_compression_smooth.inp",
        "PLATEN",
        ["--set", "H=5"],
        [("MAX EVENTS=40", "MAX EVENTS=15")],
    ),
}

# What is kept of each (rfem_compare.py says with which tolerance, and why, unless the reference has its own).
KEPT = (
    "nodes elements loads_before_first_event first_event_load first_event_time first_event_x first_event_y "
    "first_event_direction first_event_mode peak_load events crack_length last_load released_energy external_work "
    "tension_share"
).split(" ")


def compute(name, folder):
    """Run a case."""
    case = CASES[name]
    deck = edited(PAPER / case.deck, folder, *case.edits)
    return run(deck, Path(folder) / "results", *case.arguments, job=name)


def kept(name, done):
    """What is kept of a run."""
    found = measure(done.history, done.events, CASES[name].monitor)
    return {key: found[key] for key in KEPT}


def reference(name):
    """The stored reference of a case."""
    return read_reference(REFERENCES / f"{name}.json")

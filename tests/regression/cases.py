"""The runs whose results are kept as references (input/paper/reference/NAME.json), and what is kept of each.

Before the first event a run is elastic and reproducible to the tolerance of relaxation: compared tightly. After it
crack paths bifurcate on rounding (compilers and processors round differently): compared through integrals.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
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

# What is kept: tolerance, how it is meant, and why it is what it is.
TOLERANCES = {
    "nodes": (0, "absolute", "the mesh is the deck's"),
    "elements": (0, "absolute", "the mesh is the deck's"),
    "loads_before_first_event": (
        1e-6,
        "relative",
        "elastic: relaxation takes the same steps; another rounding moves the load by less than TOLERANCE=1e-6",
    ),
    "first_event_load": (1e-6, "relative", "elastic, located where the utilisation is 1.0005"),
    "first_event_time": (1e-6, "relative", "elastic, located where the utilisation is 1.0005"),
    "first_event_x": (1e-9, "relative", "a node of the deck"),
    "first_event_y": (1e-9, "relative", "a node of the deck"),
    "first_event_direction": (1e-2, "absolute", "degrees; stresses are good to 1e-4 at TOLERANCE=1e-6"),
    "first_event_mode": (0, "absolute", "1 tension, 2 shear"),
    "peak_load": (
        1e-3,
        "relative",
        "the load of the first event here: OVERSHOOT=0.001 if another path were to bear more",
    ),
    "events": (2, "absolute", "another rounding may take another path, which needs a few events more or less"),
    "crack_length": (0.1, "relative", "follows the number of events"),
    "last_load": (0.05, "of the peak", "the load that is left falls with each event"),
    "released_energy": (0.1, "relative", "follows the length of the crack"),
    "external_work": (0.02, "relative", "mostly done before the first event"),
    "tension_share": (0.15, "absolute", "events in tension over all"),
}


def compute(name, folder):
    """Run a case."""
    case = CASES[name]
    deck = edited(PAPER / case.deck, folder, *case.edits)
    return run(deck, Path(folder) / "results", *case.arguments, job=name)


def measure(name, done):
    """What is kept of a run."""
    history, events = done.history, done.events
    load = np.hypot(history[f"{CASES[name].monitor}_rf1"], history[f"{CASES[name].monitor}_rf2"])
    elastic = history["event_count"] == 0
    return {
        "nodes": int(history["nodes"][0]),
        "elements": int(history["elements"][0]),
        "loads_before_first_event": [float(f) for f in load[elastic]],
        "first_event_load": float(load[elastic][-1]),
        "first_event_time": float(events["time"][0]),
        "first_event_x": float(events["x"][0]),
        "first_event_y": float(events["y"][0]),
        "first_event_direction": float(events["direction_deg"][0] % 180),
        "first_event_mode": {"tension": 1, "shear": 2}[events["mode"][0]],
        "peak_load": float(load.max()),
        "events": int(history["event_count"][-1]),
        "crack_length": float(history["crack_length"][-1]),
        "last_load": float(load[-1]),
        "released_energy": float(history["released_energy"][-1]),
        "external_work": float(history["external_work"][-1]),
        "tension_share": float(history["events_tension"][-1] / history["event_count"][-1]),
    }


def reference(name):
    """The stored reference of a case."""
    return json.loads((REFERENCES / f"{name}.json").read_text())


def difference(quantity, value, peak):
    """(how far a value is from its reference, what is allowed), in the reference's own measure."""
    kind, expected = quantity["kind"], np.array(quantity["value"], dtype=float)
    value = np.array(value, dtype=float)
    if value.shape != expected.shape:
        return np.inf, quantity["tolerance"]
    far = np.abs(value - expected).max()
    scale = {"absolute": 1.0, "relative": np.abs(expected).max(), "of the peak": peak}[kind]
    return (far / scale if scale > 0 else far), quantity["tolerance"]

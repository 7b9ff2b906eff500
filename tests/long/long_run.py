#!/usr/bin/env python3
"""Long runs: what drifts, whether memory grows with more than the mesh, and relaxations above their tolerance.

./run long [--quick] [--output DIR] [--figure FILE.png]

Three runs. `at_once`: the rough block of rough_block.inp until 2,000 events, all nodes above their strength at once.
`one_by_one`: a coarser one, a node at a time, crushed until hardly anything is left to split or to bear load. `rows`:
8,000 rows of history and 400 frames of a small body that does not break. While they run their memory is read from
/proc. Each line of the report is a figure, its limit and what it is; exit status 1 if one is beyond its limit and not
among those that are open (OPEN), which are told all the same. --quick: the first 60 events only.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import rfem_results

HERE = Path(__file__).resolve().parent
POLL = 0.05  # seconds between two readings of the memory
MEGABYTE = 2.0**20
# A node that a split makes comes with two elements, half a pair of nodes or more, its row, and a half as much again
# that the arrays grow ahead. Smaller meshes grow by less than what the program needs once.
BYTES_OF_NODE, LEAST_GROWTH = 6000, 1000
# HDF5 keeps the index of what it has written: some 20 bytes for each of the 30 parts of a frame, every 20 rows. The
# values of a row, were they kept, are 500 bytes.
BYTES_OF_ROW = 60
# Figures beyond their limit that nobody has mended yet: they are told, and not hidden by a wider limit.
STEPS = "it comes from rows that say converged = 0: states at the limit of iterations, some in the midst of a flutter"
OPEN = {
    ("one_by_one", "energy error, of the external work"): STEPS,
    ("one_by_one", "its change from the first event to the last"): STEPS,
}


class LongRun:
    """A run of the program, with the memory it had at each number of nodes and of rows."""

    def __init__(self, program, deck, folder, job, settings, edits=()):
        self.job, self.path = job, folder / job
        text = (HERE / deck).read_text()
        for old, new in edits:
            assert old in text, old
            text = text.replace(old, new)
        for stale in folder.glob(f"{job}[._]*"):
            stale.unlink()
        (folder / f"{job}.inp").write_text(text)
        words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
        self.samples = []  # rows, nodes, resident bytes
        with open(folder / f"{job}.log", "w") as log:
            process = subprocess.Popen(
                [program, f"{job}.inp", "--quiet", *words],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
            )
            self._watch(process, folder / f"{job}_history.csv")
        self.status = process.wait()
        self.log = (folder / f"{job}.log").read_text()
        if self.status != 0:
            sys.exit(f"{job}: rfem ended with status {self.status}\n{self.log[-2000:]}")

    def _watch(self, process, history):
        """Read memory and history until the process ends."""
        rows, nodes, place, column = 0, 0, 0, None
        while process.poll() is None:
            if history.exists():
                with open(history, "rb") as file:
                    file.seek(place)
                    new = file.read()
                new = new[: new.rfind(b"\n") + 1]
                place += len(new)
                for line in new.decode().splitlines():
                    if column is None:
                        column = line.split(",").index("nodes")
                        continue
                    rows += 1
                    nodes = int(line.split(",")[column])
            resident = memory_of(process.pid)
            if nodes > 0 and resident > 0:
                self.samples.append((rows, nodes, resident))
            time.sleep(POLL)


def memory_of(pid):
    """Resident memory of a process [bytes]; 0 when it has gone."""
    try:
        found = re.search(r"VmRSS:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    except OSError:
        return 0
    return int(found[1]) * 1024 if found else 0


class Report:
    """Figures with their limits."""

    def __init__(self):
        self.failed = self.open = 0

    def at_most(self, run, what, value, limit):
        bad = not value <= limit
        reason = bad and OPEN.get((run, what))
        self.failed += bad and not reason
        self.open += bool(reason)
        word = "ok" if not bad else "open" if reason else "FAILED"
        print(f"{word:6} {run:10} {what}: {value:.3g} (at most {limit:.3g})", flush=True)
        if reason:
            print(f"       {'':10} {reason}", flush=True)

    def tell(self, run, what, value):
        print(f"       {run:10} {what}: {value:.6g}", flush=True)


def check_body(run, results, report):
    """Area, mass and centre of mass of every frame against the first one; returns events and errors of area."""
    events, errors, centres = [], [], []
    for frame in results.frames:
        corners = frame.points[frame.cells]
        one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = 0.5 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
        assert area.min() > 0, "an area is not positive"
        # masses of the nodes, for unit density and thickness
        mass = np.bincount(frame.cells.ravel(), np.repeat(area / 3, 3), minlength=len(frame.points))
        assert mass.min() > 0, "a node without mass"
        errors.append([area.sum(), mass.sum()])
        centres.append(mass @ frame.points / mass.sum())
        events.append(frame.cell_data["element_id"].size)
    errors = np.abs(np.array(errors) / errors[0] - 1)
    size = np.ptp(results.frames[0].points, axis=0).max()
    report.at_most(run, "drift of the area over all frames", errors[:, 0].max(), 1e-12)
    report.at_most(run, "drift of the mass (sum over the nodes)", errors[:, 1].max(), 1e-12)
    drift = np.abs(np.array(centres) - centres[0]).max() / size
    report.at_most(run, "drift of the centre of mass, of the height", drift, 1e-12)
    report.tell(run, "frames looked at", len(events))
    return np.array(events), errors[:, 0]


def check_balance(run, history, tolerance, report):
    """Momentum of a body at rest: forces of both platens and of both sides of a section balance."""
    settled = (history["converged"] == 1) & (np.hypot(history["PLATEN_rf1"], history["PLATEN_rf2"]) > 0)
    force = np.hypot(history["PLATEN_rf1"], history["PLATEN_rf2"])
    scale = np.maximum(force, 0.02 * force.max())
    # the residual's 2-norm spreads over the degrees of freedom (theory: eq. 38)
    limit = tolerance * np.sqrt(2 * history["nodes"][settled].max())
    for axis in "12":
        left = np.abs(history["PLATEN_rf" + axis] + history["BASE_rf" + axis]) / scale
        report.at_most(run, f"platens out of balance, direction {axis}, of the force", left[settled].max(), limit)
    report.at_most(run, "section out of balance, force and moment", history["MIDDLE_error"][settled].max(), limit)


def check_energy(run, history, report):
    """The ledger: what is missing stays small and does not grow with the events."""
    error, events = history["energy_error"], history["event_count"]
    broken = events > 0
    report.at_most(run, "energy error, of the external work", np.abs(error).max(), 1e-3)
    flagged = history["converged"] == 0
    flagged[1:] |= flagged[:-1].copy()
    drift = np.cumsum(np.where(flagged, 0, np.diff(error, prepend=0)))
    report.at_most(run, "energy error that increments between converged rows bring", np.abs(drift).max(), 1e-3)
    if broken.any():
        first = error[np.argmax(broken)]
        report.at_most(run, "its change from the first event to the last", np.abs(error[broken] - first).max(), 1e-3)


def check_relaxations(run, results, log, tolerance, report):
    """Whatever is above the tolerance is flagged, and the log counts it."""
    history = results.history
    above = history["residual"] > tolerance
    report.at_most(run, "rows above the tolerance that say converged", (above & (history["converged"] == 1)).sum(), 0)
    report.at_most(run, "rows within it that do not", (~above & (history["converged"] == 0)).sum(), 0)
    said = re.search(r"^warning: (\d+) relaxations ended above the tolerance", log, re.M)
    counted = int(said[1]) if said else 0
    in_rows = (above & (history["iterations"] > 0)).sum()
    report.at_most(run, "relaxations in the rows less those that the log counts", abs(in_rows - counted), 0)
    relaxations = (history["iterations"] > 0).sum()
    report.tell(run, f"relaxations above the tolerance, all flagged; of {relaxations}", counted)
    report.tell(run, "largest residual", history["residual"].max())


def check_memory(run, report):
    """Memory against the mesh: what the rows explain beside it is nothing."""
    rows, nodes, resident = np.array(run.samples, dtype=float).T
    largest = np.array([resident[nodes == n].max() for n in np.unique(nodes)])
    nodes = np.unique(nodes)
    report.tell(run.job, "memory at the start, MB", resident[0] / MEGABYTE)
    report.tell(run.job, "largest memory, MB", resident.max() / MEGABYTE)
    if np.ptp(nodes) > LEAST_GROWTH:
        grown = (largest.max() - largest[0]) / (nodes.max() - nodes[0])
        report.at_most(run.job, "bytes for each new node", grown, BYTES_OF_NODE)
    return nodes, largest


def check_block(run, tolerance, report):
    """Everything of a broken block; returns what the figure shows."""
    with rfem_results.open_results(run.path) as results:
        history = results.history.columns
        elements, area = check_body(run.job, results, report)
        check_balance(run.job, history, tolerance, report)
        check_energy(run.job, history, report)
        check_relaxations(run.job, results, run.log, tolerance, report)
    report.tell(run.job, "events", history["event_count"].max())
    report.tell(run.job, "nodes at the end", history["nodes"][-1])
    report.tell(run.job, "pieces at the end", history["fragments"][-1])
    nodes, memory = check_memory(run, report)
    at = np.interp(elements, history["elements"], history["event_count"])
    return {"history": history, "at": at, "area": area, "nodes": nodes, "memory": memory}


def tell_rest(run, history, report):
    """What a crushed block has left."""
    force = np.abs(history["PLATEN_rf2"])
    report.tell(run, "load at the end, of the peak", force[-1] / force.max())
    report.tell(
        run, "events in the last tenth of the compression", np.ptp(history["event_count"][history["load_factor"] > 0.9])
    )
    report.tell(run, "nodes above their strength that cannot split", history["exhausted"][-1])


def check_rows(run, report):
    """Rows and frames of a mesh that stays as it is: no memory."""
    rows, _, resident = np.array(run.samples, dtype=float).T
    settled = rows > 0.1 * rows.max()
    report.tell(run.job, "rows", rows.max())
    growth = (resident[settled][-1] - resident[settled][0]) / np.ptp(rows[settled])
    report.at_most(run.job, "bytes for each row after the first tenth", growth, BYTES_OF_ROW)
    return rows, resident


def draw(path, blocks, rows):
    """One figure: energy and area against events, memory against nodes and against rows."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    labels = {"at_once": "all above the strength at once", "one_by_one": "one by one, until nothing bears load"}
    figure, ((energy, area), (memory, row)) = plt.subplots(2, 2, figsize=(10, 7), layout="constrained")
    for (name, block), colour in zip(blocks.items(), ("tab:blue", "tab:orange"), strict=False):
        history = block["history"]
        events, error = history["event_count"], history["energy_error"]
        flagged = history["converged"] == 0
        energy.plot(events, error, "-o", ms=2.5, lw=0.8, color=colour, label=labels[name])
        energy.plot(events[flagged], error[flagged], "x", color="tab:red", label=None)
        area.plot(block["at"], block["area"], "o", ms=3, color=colour, label=labels[name])
        memory.plot(block["nodes"], block["memory"] / MEGABYTE, "o-", ms=3, lw=0.8, color=colour, label=labels[name])
    energy.plot([], [], "x", color="tab:red", label="row with converged = 0")
    energy.axhline(0, color="0.7", lw=0.8, zorder=0)
    energy.set(xlabel="events", ylabel="energy error / external work", title="Energy ledger")
    area.set(xlabel="events", ylabel="|area / first area - 1|", title="Area")
    area.ticklabel_format(axis="y", style="sci", scilimits=(0, 0))
    memory.set(xlabel="nodes", ylabel="resident memory, MB", title="Memory and mesh", xlim=(0, None), ylim=(0, None))
    row.plot(rows[0], rows[1] / MEGABYTE, color="tab:green", lw=1.2)
    row.set(xlabel="rows of history", ylabel="resident memory, MB", title="Memory of a mesh that does not grow")
    row.set(xlim=(0, None), ylim=(0, 1.3 * rows[1].max() / MEGABYTE))
    for axes in (energy, memory):
        axes.legend(fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the first 60 events of each")
    parser.add_argument("--output", type=Path, default=Path("build/long"), help="folder of the runs (build/long)")
    parser.add_argument("--figure", type=Path, help="where to draw (default: long_run.png in the folder of the runs)")
    options = parser.parse_args()
    program = os.environ.get("RFEM", "rfem")
    options.output.mkdir(parents=True, exist_ok=True)
    report, tolerance = Report(), 1e-5
    block = {"NX": 10, "NY": 20, "LEVEL": 2}
    end = {"EVENTS": 60} if options.quick else {}
    at_once = LongRun(program, "rough_block.inp", options.output, "at_once", {**block, **end} if options.quick else {})
    blocks = {"at_once": check_block(at_once, tolerance, report)}
    if not options.quick:
        report.at_most("at_once", "events short of 2,000", 2000 - blocks["at_once"]["history"]["event_count"].max(), 0)
    worst = [("SELECT=ALL", "SELECT=WORST")]
    settings = {**block, **(end or {"EVENTS": 100000, "U_TOTAL": -0.5, "INCREMENT": 0.04})}
    one_by_one = LongRun(program, "rough_block.inp", options.output, "one_by_one", settings, worst)
    blocks["one_by_one"] = check_block(one_by_one, tolerance, report)
    if not options.quick:
        tell_rest("one_by_one", blocks["one_by_one"]["history"], report)
    rows = check_rows(LongRun(program, "rows.inp", options.output, "rows", {}), report)
    picture = options.figure or options.output / "long_run.png"
    draw(picture, blocks, rows)
    print(f"{picture}; {report.failed + report.open} figures beyond their limits, {report.open} of them open before")
    return 1 if report.failed else 0


if __name__ == "__main__":
    sys.exit(main())

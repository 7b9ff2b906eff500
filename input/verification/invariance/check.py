"""The paper's coarse beam told in other ways: the same answer."""

import sys

import numpy as np
from rfem_verify import PROJECT

sys.path.append(str(PROJECT / "tests" / "regression"))
import test_invariance as beam

TITLE = "The same beam turned, mirrored, moved, renumbered, in other units"
SECTION = "invariance"


def mirror(x):
    """Left and right change places."""
    return np.column_stack([400.0 - x[:, 0], x[:, 1]])


def largest_difference(one, other, columns, rows, sign=1.0):
    """Over columns (ours, theirs): the largest difference relative to the column's largest value."""
    worst = 0.0
    for ours, theirs in columns:
        a, b = sign * one[ours][:rows], other[theirs][:rows]
        worst = max(worst, np.abs(a - b).max() / np.abs(b).max())
    return worst


def compare(case, name, done, plain, point, turn, swap=False, sign=1.0, direction_sign=1):
    """A row for all that comes before the first event, a row for the event."""
    axis = "1" if swap else "2"
    columns = [(m + what + axis, m + what + "2") for m in ("PUSHED", "QUIET") for what in ("_u", "_rf")]
    rows = int((plain.history["event_count"] == 0).sum())
    same = [(c, c) for c in ("external_work", "max_utilisation", "time")]
    worst = max(
        largest_difference(done.history, plain.history, columns, rows, sign),
        largest_difference(done.history, plain.history, same, rows),
    )
    case.at_most(f"{name}: largest relative difference before the first event", worst, 1e-8, kind="invariant")
    ours, theirs = done.events, plain.events
    angle = (ours["direction_deg"][0] - turn - direction_sign * theirs["direction_deg"][0] + 90) % 180 - 90
    place = np.hypot(ours["x"][0] - point[0], ours["y"][0] - point[1])
    what = ("mode", "type", "new_nodes", "new_elements")
    same_event = all(ours[c][0] == theirs[c][0] for c in what) and place <= 1e-6 and abs(angle) <= 1e-5
    case.equal(f"{name}: the first event", "same" if same_event else "another", "same", kind="invariant")


def check(case):
    """Ways to tell the beam."""
    plain = beam.tell(case.work / "plain")
    far = np.array([1000.0, -300.0])
    moved = beam.tell(case.work / "moved", transform=lambda x: x + far)
    compare(case, "moved", moved, plain, (1200.0, -300.0), 0)
    push = "*BOUNDARY\nPUSHED, 1, 1, 0.06"
    turned = beam.tell(
        case.work / "turned", transform=lambda x: np.column_stack([-x[:, 1], x[:, 0]]), roller="1, 1", drive=push
    )
    compare(case, "turned by 90 degrees", turned, plain, (0.0, 200.0), 90, swap=True, sign=-1)
    over = beam.tell(case.work / "over", transform=lambda x: -x, drive="*BOUNDARY\nPUSHED, 2, 2, 0.06")
    compare(case, "upside down", over, plain, (-200.0, 0.0), 0, sign=-1)
    mirrored = beam.tell(case.work / "mirrored", transform=mirror, turned=True)
    compare(case, "mirrored", mirrored, plain, (200.0, 0.0), 180, direction_sign=-1)
    renumbered(case, plain)
    any_angle(case)
    units(case)


def renumbered(case, plain):
    """Ids shuffled, with gaps, in another order in the file."""
    chance = np.random.default_rng(7)
    names = 10 + 3 * chance.permutation(len(beam.NODES))
    elements = 5 + 7 * chance.permutation(beam.TRIANGLES[:, 0].max())
    done = beam.tell(
        case.work / "renumbered",
        number=lambda ids: names[np.asarray(ids) - 1],
        element_number=lambda ids: elements[ids - 1],
        order=lambda n: np.random.default_rng(n).permutation(n),
    )
    compare(case, "renumbered", done, plain, (200.0, 0.0), 0)


def any_angle(case):
    """Both ends of the span pinned, pushed by forces, which can be turned by any angle."""
    runs = {}
    for degrees in (0.0, 37.0, 143.0):
        angle = np.radians(degrees)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        x, y = (turn @ [0.0, -200.0 / len(beam.PUSHED)]).tolist()
        done = beam.tell(
            case.work / f"angle{degrees:g}",
            transform=lambda points, turn=turn: points @ turn.T,
            roller="1, 2",
            drive=f"*CLOAD\nPUSHED, 1, {x!r}\nPUSHED, 2, {y!r}",
        )
        before = done.history["event_count"] == 0
        runs[degrees] = (done.events, done.history["external_work"][before][-1])
    events, work = runs.pop(0.0)
    for degrees, (turned, turned_work) in runs.items():
        worst = max(abs(turned[c][0] / events[c][0] - 1) for c in ("load_factor", "sigma3", "utilisation"))
        worst = max(worst, abs(turned_work / work - 1))
        name = f"turned by {degrees:g} degrees: largest relative difference at the first event"
        case.at_most(name, worst, 1e-7, kind="invariant")
        same = all(turned[c][0] == events[c][0] for c in ("node", "element", "type", "mode"))
        text = f"turned by {degrees:g} degrees: the first event"
        case.equal(text, "same" if same else "another", "same", kind="invariant")


def units(case):
    """Four events in other units; powers of two leave no rounding at all."""
    four = {"fracture": ", MAX EVENTS=4", "tolerance": "1E-6"}
    plain = beam.tell(case.work / "mm", **four)
    for name, length, stress, limit in (("m, Pa", 1e-3, 1e6, 1e-7), ("powers of two", 2.0**60, 2.0**-80, 0.0)):
        done = beam.tell(case.work / name.replace(", ", "_").replace(" ", "_"), length=length, stress=stress, **four)
        force, work = stress * length**2, stress * length**3
        worst = 0.0
        for column, unit in (("PUSHED_rf2", force), ("PUSHED_u2", length), ("external_work", work), ("time", 1.0)):
            a, b = done.history[column] / unit, plain.history[column]
            worst = max(worst, np.abs(a - b).max() / np.abs(b).max())
        case.at_most(f"units {name}: largest relative difference over four events", worst, limit, kind="invariant")
        same = all(done.events[c].tolist() == plain.events[c].tolist() for c in ("node", "element", "type", "mode"))
        case.equal(f"units {name}: the four events", "same" if same else "others", "same", kind="invariant")

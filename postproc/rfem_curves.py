"""Figures of history columns: the load-displacement curve, any two columns, the curves of two jobs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rfem_fields import Units, column_label, parse_units
from rfem_io import ResultsError
from rfem_results import Results
from rfem_style import STYLE, number_text

COLORS = ("#0072B2", "#D55E00")


@dataclass
class Curve:
    """Two history columns of one job. `x_sign`, `y_sign`: -1 where the negative is drawn."""

    results: Results
    x: str
    y: str
    x_sign: int = 1
    y_sign: int = 1


def history_curve(results: Results, x: str, y: str) -> Curve:
    """The curve of any two history columns."""
    history = results.history
    for name in (x, y):
        if history[name].dtype.kind not in "iuf":
            raise ResultsError(f"history column {name} is no number")
    return Curve(results, history.find(x), history.find(y))


def load_displacement_curve(results: Results) -> Curve:
    """Reaction over displacement of the first monitor, in the direction of its largest reaction.

    Negative ones are drawn as positive (the label has a minus sign). A monitor without a reaction (a point of
    observation under prescribed loads) is drawn with the load factor, or, with several steps, with the time.
    ResultsError where the run has no monitor.
    """
    history, monitors = results.history, results.monitors
    if not monitors:
        raise ResultsError(
            f"{results.job} has no monitor, so no load-displacement curve (*MONITOR in the deck)"
        )
    name = monitors[0]
    reaction = [_largest(history[f"{name}_rf{i}"]) for i in (1, 2)]
    displacement = [_largest(history[f"{name}_u{i}"]) for i in (1, 2)]
    if max(abs(value) for value in reaction) > 0:
        i = int(abs(reaction[1]) > abs(reaction[0]))
        return Curve(
            results, f"{name}_u{i + 1}", f"{name}_rf{i + 1}", _sign(displacement[i]), _sign(reaction[i])
        )
    i = int(abs(displacement[1]) > abs(displacement[0]))
    load = "load_factor" if len(np.unique(history["step"])) == 1 else "time"
    return Curve(results, f"{name}_u{i + 1}", load, _sign(displacement[i]))


def _largest(values: np.ndarray) -> float:
    """The value of largest size, with its sign; 0 for none."""
    finite = values[np.isfinite(values)]
    return float(finite[np.argmax(abs(finite))]) if len(finite) else 0.0


def _sign(value: float) -> int:
    return -1 if value < 0 else 1


def curve_figure(curves: Sequence[Curve]) -> Figure:
    """History curves in one diagram, with the peak of each and the rows that did not converge."""
    units = common_units([curve.results for curve in curves])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.8, 3.5), layout="constrained")
        FigureCanvasAgg(figure)
        ax = figure.add_subplot()
        for number, curve in enumerate(curves):
            _draw_curve(ax, curve, COLORS[number % 2], units, alone=len(curves) == 1)
        first = curves[0]
        names = first.results.monitors + first.results.section_checks
        ax.set_xlabel(column_label(first.x, units, names, first.x_sign < 0))
        ax.set_ylabel(column_label(first.y, units, names, first.y_sign < 0))
        ax.grid(color="#DDDDDD", linewidth=0.5)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.margins(x=0.04, y=0.08)
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        if ax.get_legend_handles_labels()[0]:
            ax.legend(loc="best", fontsize=8)
        if len(curves) == 1:
            ax.set_title(_curve_title(first), loc="left")
        return figure


def common_units(all_results: Sequence[Results]) -> Units:
    """Units of results that share axes; ResultsError where two decks state different ones."""
    stated = [(results, parse_units(results.deck)) for results in all_results]
    stated = [(results, units) for results, units in stated if units != Units()]
    for results, units in stated[1:]:
        if units != stated[0][1]:
            raise ResultsError(
                f"{stated[0][0].job} and {results.job} state different units "
                f"({_units_text(stated[0][1])}; {_units_text(units)}): they cannot share axes"
            )
    return stated[0][1] if stated else Units()


def _units_text(units: Units) -> str:
    return ", ".join(text for text in (units.length, units.force, units.stress, units.time) if text)


def _curve_title(curve: Curve) -> str:
    history = curve.results.history
    events = (
        f", {int(history['event_count'][-1])} events" if "event_count" in history and len(history) else ""
    )
    return f"{curve.results.job}{events}"


def _draw_curve(ax: Axes, curve: Curve, color: str, units: Units, alone: bool) -> None:
    history, job = curve.results.history, curve.results.job
    x, y = curve.x_sign * history[curve.x], curve.y_sign * history[curve.y]
    x, y = x + 0.0, y + 0.0  # no negative zeros
    marker = {"marker": "o", "markersize": 2.6} if len(x) <= 200 else {}
    ax.plot(x, y, "-", color=color, linewidth=1.3, label=None if alone else job, **marker)
    if "converged" in history:
        bad = np.asarray(history["converged"]) == 0
        if bad.any():
            ax.plot(
                x[bad], y[bad], "o", markersize=5, markerfacecolor="white", markeredgecolor=color,
                label="not converged" if alone else f"{job}: not converged",
            )  # fmt: skip
    if curve.y.endswith(("_rf1", "_rf2", "load_factor")) and len(y) > 2:
        top = int(np.nanargmax(y))
        if 0 < top < len(y) - 1 and y[top] > 0:
            unit = units.of("force") if "_rf" in curve.y else ""
            ax.annotate(
                f"{number_text(y[top])} {unit}".rstrip(), (x[top], y[top]), (5, 3),
                textcoords="offset points", fontsize=8, color=color,
            )  # fmt: skip

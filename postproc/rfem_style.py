"""What all figures share: style, numbers as text, writing a file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from rfem_io import ResultsError

DPI = 300
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "rfem",
    "mathtext.default": "it",
}


def number_text(value: float) -> str:
    """A number as labels write it: up to four digits, a true minus sign."""
    return f"{value:.4g}".replace("-", "\u2212")


def save(figure: Figure, path: Path) -> Path:
    """Write a figure; the suffix says the format. ResultsError where the file cannot be written."""
    metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix, {})
    with mpl.rc_context(STYLE), writing(path):
        figure.savefig(path, dpi=DPI, bbox_inches="tight", pad_inches=0.05, metadata=metadata)
    return path


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn a failure to write `path` (no folder, disk full) into a ResultsError; leave no half file."""
    try:
        yield
    except OSError as error:
        with contextlib.suppress(OSError):
            path.unlink()
        raise ResultsError(f"{path} cannot be written: {error.strerror or error}") from error

"""Opening rfem's HDF5 files, whatever became of their run, and reading its tables (history, events)."""

from __future__ import annotations

import csv
import difflib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Union

import h5py
import numpy as np

PathLike = Union[str, Path]


class ResultsError(Exception):
    """Something cannot be read or does not exist; the text is one line for the user."""


def nearest(name: str, names: Sequence[str]) -> str:
    """Text '; did you mean X?' for the nearest of `names`, or nothing when none is near."""
    by_lower = {candidate.lower(): candidate for candidate in names}
    close = difflib.get_close_matches(name.lower(), list(by_lower), n=1, cutoff=0.6)
    return f"; did you mean {by_lower[close[0]]}?" if close else ""


def short_text(error: BaseException) -> str:
    """First line of an exception's text, for messages of one line."""
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__


def open_hdf5(path: PathLike) -> tuple[h5py.File, bool]:
    """Open for reading; also a file that a run is writing, or was writing when it was killed.

    Returns the file, and whether it was closed normally. ResultsError says what to do where nothing helps.
    """
    path = Path(path)
    if not path.is_file():
        raise ResultsError(f"{path} does not exist")
    reason = ""
    for options in _ways_to_open():
        try:
            return h5py.File(path, "r", **options), "swmr" not in options
        except PermissionError as error:
            raise ResultsError(f"{path}: {error.strerror or 'permission denied'}") from error
        except (OSError, RuntimeError, ValueError) as error:
            reason = reason or short_text(error)
    if not h5py.is_hdf5(path):
        raise ResultsError(f"{path} is no HDF5 file, or is cut off before its first frame")
    raise ResultsError(
        f"{path} cannot be opened: a run is still starting, or was killed while it did; wait for its first "
        f"frame, or repair the file with 'h5clear -s --increment=0 {path}' ({reason})"
    )


def _ways_to_open() -> list[dict[str, object]]:
    """Options to try in turn: a closed file; one that a single writer keeps readable; that without a lock.

    Some file systems have no locks. A plain file whose writer holds one is never read past it.
    """
    return [
        {"locking": "best-effort"},
        {"locking": "best-effort", "swmr": True},
        {"locking": False, "swmr": True},
    ]


@dataclass
class Table:
    """Columns of equal length, in the order of the file."""

    title: str  #: 'history' or 'events', for messages
    source: Path  #: file it was read from
    columns: dict[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[self.find(name)]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    @property
    def names(self) -> list[str]:
        """Column names in the order of the file."""
        return list(self.columns)

    def find(self, name: str) -> str:
        """Name of the column as the file writes it (case does not matter); ResultsError if there is none."""
        if name in self.columns:
            return name
        for candidate in self.columns:
            if candidate.lower() == name.lower():
                return candidate
        raise ResultsError(
            f"{self.source.name} has no {self.title} column {name}{nearest(name, self.names)} "
            f"(columns: {', '.join(self.names) or 'none'})"
        )


def read_csv_table(path: PathLike, title: str) -> Table:
    """Read JOB_history.csv or JOB_events.csv. A last line cut off by a killed run is left out."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ResultsError(f"{path}: {error.strerror or error}") from error
    lines = text.split("\n")
    lines.pop()  # after the last newline: nothing, or half a row
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines) if row]
    if not rows:
        raise ResultsError(f"{path} has no header line: no table of rfem, or the run wrote nothing yet")
    names = rows.pop(0)
    for number, row in enumerate(rows, start=2):
        if len(row) != len(names):
            raise ResultsError(f"{path}: row {number} has {len(row)} values for {len(names)} columns")
    columns = {name: _array_of_text([row[i] for row in rows]) for i, name in enumerate(names)}
    return Table(title, path, columns)


def _array_of_text(values: list[str]) -> np.ndarray:
    """Integers where all are integers, else real numbers where all are numbers, else text."""
    for kind in (int, float):
        try:
            return np.array([kind(value) for value in values], dtype=np.int64 if kind is int else np.float64)
        except (ValueError, OverflowError):
            continue
    return np.array(values, dtype=str)


def read_hdf5_table(group: h5py.Group, title: str, source: Path, order: Sequence[str]) -> Table:
    """Read /rfem/history or /rfem/events. `order`: column names in the order wanted; others follow.

    While a run goes on, or after it was killed, columns may differ in length by the row that was being
    written: the rows that all columns have are returned.
    """
    names = [name for name, item in group.items() if isinstance(item, h5py.Dataset)]
    rank = {name: number for number, name in enumerate(order)}
    names.sort(key=lambda name: rank.get(name, len(rank)))  # stable: the others stay as the file lists them
    length = min((group[name].shape[0] for name in names), default=0)
    return Table(title, source, {name: _decoded(group[name][:length]) for name in names})


def _decoded(values: np.ndarray) -> np.ndarray:
    """Text of HDF5 (bytes, or objects for variable length) as a numpy array of str; numbers as they are."""
    if values.dtype.kind not in "SO":
        return values
    return np.array([text_of(value) for value in values.tolist()], dtype=str)


def text_of(value: object) -> str:
    """An attribute's or dataset's value as text, without the blanks and NULs that pad fixed lengths."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind in "SO":
            return "\n".join(text_of(item) for item in value.reshape(-1).tolist())
        return " ".join(str(item) for item in value.reshape(-1).tolist())
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    return str(value).rstrip(" \0")

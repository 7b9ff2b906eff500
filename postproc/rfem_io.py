"""Opening rfem's HDF5 files, whatever became of their run, and reading its tables (history, events)."""

from __future__ import annotations

import contextlib
import csv
import ctypes
import difflib
from collections.abc import Iterator, Sequence
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


@contextlib.contextmanager
def reading(path: PathLike, what: str = "its content", advice: str = "") -> Iterator[None]:
    """Turn a failure to read from an open HDF5 file (a damaged or missing piece) into a ResultsError."""
    try:
        yield
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, IndexError, OverflowError) as error:
        raise ResultsError(
            f"{path}: {what} cannot be read, the file is damaged ({short_text(error)}); "
            f"{advice or WHAT_TO_DO}"
        ) from error


# Reading what a run is writing means reading again what does not fit together yet. HDF5 waits between two
# attempts, each time twice as long as before, from 1 ns on; its own limit of 100 attempts means for ever, and
# what is cut off never fits together. With N attempts it waits 2^N ns for a piece: 0.13 s for these.
READ_ATTEMPTS = 27
WHAT_TO_DO = "'rfem-recover JOB' saves what can be read; else run it again"
NOT_SAVED = "nothing is saved of it, it is as it was; run it again"  # rfem-recover itself


def open_hdf5(path: PathLike, salvage: bool = False) -> tuple[h5py.File, bool]:
    """Open for reading; also a file that a run is writing, or was writing when it was killed.

    Never waits long. Returns the file, and whether it was closed normally and is whole. ResultsError says
    what to do where nothing helps. `salvage`: also a file that was cut off later, and without waiting for
    what does not fit together: HDF5 notices only missing pieces that have a checksum (`unreadable_rows`).
    """
    path = Path(path)
    if not path.is_file():
        raise ResultsError(f"{path} does not exist")
    try:
        cut = cut_off(path)
    except OSError as error:
        raise ResultsError(f"{path}: {(error.strerror or str(error)).lower()}") from error
    if cut and not salvage:
        raise ResultsError(f"{path} is cut off: {cut}; {WHAT_TO_DO}")
    reason = ""
    for options in _ways_to_open():
        try:
            file = _open(path, 1 if salvage else READ_ATTEMPTS, **options)
        except PermissionError as error:
            raise ResultsError(f"{path}: {error.strerror or 'permission denied'}") from error
        except (OSError, RuntimeError, ValueError) as error:
            reason = reason or short_text(error)
            continue
        try:
            list(file)
        except (OSError, RuntimeError, ValueError) as error:
            file.close()
            raise ResultsError(
                f"{path} is cut off at its beginning, or that is damaged: nothing can be read "
                f"of it ({short_text(error)}); run it again"
            ) from error
        return file, "swmr" not in options and not cut
    if not h5py.is_hdf5(path):
        raise ResultsError(f"{path} is no HDF5 file, or is cut off before its first frame; run it again")
    raise ResultsError(
        f"{path} cannot be opened: a run is still starting, or was killed while it did; wait for its first "
        f"frame, or repair the file with 'h5clear -s --increment=0 {path}' ({reason})"
    )


def cut_off(path: Path) -> str:
    """How many bytes a file has lost since it was closed; empty if none, or if it was never closed."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(48)
    # superblock: signature, version, sizes of offsets and lengths, flags (0: closed), base, extension, end
    if (
        len(head) < 48
        or head[:8] != b"\x89HDF\r\n\x1a\n"
        or head[8] not in (2, 3)
        or head[9] != 8
        or head[11]
    ):
        return ""
    end = int.from_bytes(head[28:36], "little")
    return f"it has {size:,} of {end:,} bytes" if size < end < 2**63 else ""


def _ways_to_open() -> list[dict[str, object]]:
    """Options to try in turn: a closed file; one that a single writer keeps readable; that without a lock.

    Some file systems have no locks. A plain file whose writer holds one is never read past it.
    """
    return [
        {"locking": True},
        {"locking": True, "swmr": True},
        {"locking": False, "swmr": True},
    ]


def _open(path: Path, attempts: int, locking: bool, swmr: bool = False) -> h5py.File:
    """What h5py.File does, with a limit on reading again, which h5py does not know."""
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    access.set_file_locking(locking, locking)  # the second: where there are locks
    if swmr:
        _limit_attempts(access, attempts)
    mode = h5py.h5f.ACC_RDONLY | (h5py.h5f.ACC_SWMR_READ if swmr else 0)
    return h5py.File(h5py.h5f.open(bytes(path), mode, fapl=access))


def _limit_attempts(access: h5py.h5p.PropFAID, attempts: int) -> None:
    """Set the limit with the function of the HDF5 library that h5py has loaded."""
    set_attempts = ctypes.CDLL(h5py.h5p.__file__).H5Pset_metadata_read_attempts
    set_attempts.argtypes = [ctypes.c_int64, ctypes.c_uint]
    set_attempts.restype = ctypes.c_int
    if set_attempts(access.id, attempts) < 0:
        raise RuntimeError("HDF5 takes no limit of attempts to read")


def unreadable_rows(dataset: h5py.Dataset) -> list[tuple[int, int]]:
    """Ranges of rows (first, behind the last) of which something cannot be read; all data are read once.

    What lies behind the end of the file counts as well: HDF5 gives zeros for it where there is no checksum.
    A single value counts as one row.
    """
    size = Path(dataset.file.filename).stat().st_size
    count = dataset.shape[0] if dataset.shape else 1
    if not count or not dataset.size:
        return []
    if dataset.chunks is None:
        start = dataset.id.get_offset()
        whole = start is None or start + dataset.id.get_storage_size() <= size
        return [] if whole and _readable(dataset, 0, count) else [(0, count)]
    if dataset.chunks[1:] != dataset.shape[1:]:  # not a file of rfem
        return [] if _readable(dataset, 0, count) else [(0, count)]
    rows = dataset.chunks[0]
    starts = range(0, count, rows)
    inside = [_chunk_inside(dataset, start, size) for start in starts]
    many = max(1, BLOCK_BYTES // max(1, dataset.dtype.itemsize * int(np.prod(dataset.chunks))))
    bad: list[tuple[int, int]] = []
    for first in range(0, len(starts), many):
        last = min(first + many, len(starts))
        if all(inside[first:last]) and _readable(dataset, starts[first], min(last * rows, count)):
            continue
        for number in range(first, last):
            start, stop = starts[number], min((number + 1) * rows, count)
            if inside[number] and _readable(dataset, start, stop):
                continue
            if bad and bad[-1][1] == start:
                start = bad.pop()[0]
            bad.append((start, stop))
    return bad


BLOCK_BYTES = 64_000_000  # read at once


def _readable(dataset: h5py.Dataset, start: int, stop: int) -> bool:
    try:
        dataset[start:stop] if dataset.shape else dataset[()]
    except (OSError, RuntimeError, ValueError):
        return False
    return True


def _chunk_inside(dataset: h5py.Dataset, start: int, size: int) -> bool:
    """Whether the chunk that begins with a row lies inside the file; so does one that was never written."""
    try:
        chunk = dataset.id.get_chunk_info_by_coord((start,) + (0,) * (len(dataset.shape) - 1))
    except (OSError, RuntimeError, ValueError):
        return False
    return chunk.byte_offset is None or chunk.byte_offset + chunk.size <= size


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
    with reading(source, title):
        names = [name for name, item in group.items() if isinstance(item, h5py.Dataset)]
        rank = {name: number for number, name in enumerate(order)}
        names.sort(key=lambda name: rank.get(name, len(rank)))  # stable: others stay as the file lists them
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

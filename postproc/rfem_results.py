"""Read what an rfem run has written, as numpy arrays.

    import rfem_results

    with rfem_results.open_results("out/beam") as results:   # or out/beam.vtkhdf, out/beam_history.csv, out
        frame = results.frames[-1]                            # the last frame
        frame.points                                          # (n, 2) reference coordinates
        frame.cells                                           # (m, 3) node numbers, from 0
        frame.point_data["displacement"]                      # (n, 3)
        results.cracks[-1].cell_data["opening"]               # one value a crack segment
        results.history["TOP_rf2"], results.events["mode"]

A run that is still going, or was killed, can be read as well: all frames and rows it had finished are there
(`results.unfinished` names such files; `results.refresh()` looks again). Every failure is a `ResultsError`
whose text is one line that says what is wrong and what is allowed.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import h5py

from rfem_frames import CRACK_MODES, CRACK_STATES, FRAME_KINDS, FieldData, Frame, FrameFile
from rfem_io import (
    PathLike,
    ResultsError,
    Table,
    nearest,
    open_hdf5,
    read_csv_table,
    read_hdf5_table,
    reading,
    text_of,
)

__all__ = [
    "CRACK_MODES",
    "CRACK_STATES",
    "EVENT_COLUMNS",
    "FRAME_KINDS",
    "HISTORY_COLUMNS",
    "FieldData",
    "Frame",
    "FrameFile",
    "Results",
    "ResultsError",
    "Table",
    "find_job",
    "heading_lines",
    "jobs_in",
    "nearest",
    "open_results",
]

# Longest first, so that 'beam_history.csv' is not taken for the job 'beam_history'.
RESULT_SUFFIXES = (
    "_cracks.vtkhdf",
    "_history.csv",
    "_events.csv",
    ".rst.1.h5",
    ".rst.h5",
    ".vtkhdf",
    ".h5",
    ".dat",
    ".mac",
)
JOB_FILES = (".vtkhdf", ".h5", "_history.csv")  # any one of them makes a result set

# History columns that are not a monitor's or a section check's, in the order of the file.
HISTORY_COLUMNS = tuple(
    "step increment time load_factor event_count iterations residual converged nodes elements cracks "
    "crack_length fragments exhausted exhausted_utilisation contacts_open contacts_slip contacts_stick "
    "events_tension events_shear max_utilisation external_work strain_energy kinetic_energy friction_work "
    "softening_work released_energy damping_work energy_error".split(" ")
)
EVENT_COLUMNS = tuple(
    "event step increment time load_factor node x y mode sigma1 sigma3 utilisation direction_deg element "
    "type new_nodes new_elements released_energy iterations".split(" ")
)
MONITOR_SUFFIXES = ("_u1", "_u2", "_rf1", "_rf2")
SECTION_SUFFIXES = ("_f1", "_f2", "_m", "_error")


def find_job(job: PathLike) -> tuple[Path, str]:
    """Directory and job name for what a user types: JOB, DIR/JOB, one of the job's files, or a directory.

    ResultsError where there are no results, with the jobs that lie there and the nearest name.
    """
    path = Path(job)
    for suffix in ("", *RESULT_SUFFIXES):
        if suffix and not path.name.endswith(suffix):
            continue
        name = path.name[: len(path.name) - len(suffix)] if suffix else path.name
        if name and any((path.parent / (name + end)).is_file() for end in JOB_FILES):
            return path.parent, name
    directory = path if path.is_dir() else path.parent
    if not directory.is_dir():
        raise ResultsError(f"no results of {job}: there is no directory {directory}")
    jobs = jobs_in(directory)
    if path.is_dir() and len(jobs) == 1:
        return directory, jobs[0]
    if path.is_dir():
        listing = f"name one of its jobs: {', '.join(jobs)}" if jobs else "it has no results of rfem"
        raise ResultsError(f"{job} is a directory: {listing}")
    raise ResultsError(
        f"no results of {path.name} in {directory.resolve()}{nearest(path.name, jobs)} (jobs there: "
        f"{', '.join(jobs) or 'none'})"
    )


def jobs_in(directory: PathLike) -> list[str]:
    """Names of the jobs that have results in a directory."""
    names = set()
    for path in Path(directory).iterdir():
        suffix = next((end for end in RESULT_SUFFIXES if path.name.endswith(end)), None)
        if suffix in JOB_FILES and len(path.name) > len(suffix):
            names.add(path.name[: -len(suffix)])
    return sorted(names)


class Results:
    """The result set of one job. Use `open_results`; files are opened when they are first needed."""

    def __init__(self, directory: PathLike, job: str) -> None:
        self.directory, self.job = Path(directory), job
        self._opened: dict[str, object] = {}

    def __enter__(self) -> Results:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def path(self, suffix: str) -> Path:
        """The job's file with a suffix such as '.vtkhdf' or '_history.csv' (it may not exist)."""
        return self.directory / (self.job + suffix)

    @property
    def frames(self) -> FrameFile:
        """Frames of the mesh (JOB.vtkhdf)."""
        if not self.path(".vtkhdf").is_file():
            raise ResultsError(
                f"{self.path('.vtkhdf')} does not exist: the run wrote no frames in this format"
            )
        return self._once("frames", lambda: FrameFile(self.path(".vtkhdf")))

    @property
    def cracks(self) -> FrameFile | None:
        """Frames of the crack segments (JOB_cracks.vtkhdf), frame for frame; None without that file."""
        if not self.path("_cracks.vtkhdf").is_file():
            return None
        return self._once("cracks", lambda: FrameFile(self.path("_cracks.vtkhdf")))

    def crack_frame(self, index: int) -> Frame | None:
        """Crack segments that belong to a frame of the mesh; None where there are none."""
        if self.cracks is None or index >= len(self.cracks):
            return None
        frame = self.cracks[index]
        return frame if len(frame.cells) else None

    @property
    def history(self) -> Table:
        """History rows, from JOB.h5 or, where that cannot be read, from JOB_history.csv."""
        return self._once("history", lambda: self._read_table("history", HISTORY_COLUMNS))

    @property
    def events(self) -> Table:
        """Event rows, from JOB.h5 or, where that cannot be read, from JOB_events.csv."""
        return self._once("events", lambda: self._read_table("events", EVENT_COLUMNS))

    @property
    def provenance(self) -> dict[str, str]:
        """What produced the results: attributes and datasets of /rfem in JOB.h5 as text; {} without it."""
        return self._once("provenance", self._read_provenance)

    @property
    def deck(self) -> str:
        """Full text of the deck, with included files; empty where JOB.h5 is missing."""
        return self.provenance.get("deck", "")

    @property
    def monitors(self) -> list[str]:
        """Names of the monitors, in the order of the history's columns."""
        return self._prefixes(MONITOR_SUFFIXES)

    @property
    def section_checks(self) -> list[str]:
        """Names of the section checks, in the order of the history's columns."""
        return self._prefixes(SECTION_SUFFIXES)

    @property
    def unfinished(self) -> list[str]:
        """Names of the opened files that their run has not closed: it is still going, or was killed."""
        files = [
            item for item in self._opened.values() if isinstance(item, FrameFile) and not item.closed_normally
        ]
        names = [item.path.name for item in files]
        if self._opened.get("h5_unfinished"):
            names.append(self.path(".h5").name)
        return sorted(names)

    @property
    def unreadable(self) -> list[str]:
        """Why a file that was asked for was passed over: JOB.h5, whose tables JOB_history.csv has as well."""
        return [str(self._opened["h5_error"])] if "h5_error" in self._opened else []

    def refresh(self) -> None:
        """Forget what was read, so that what a running job has written since is seen."""
        self.close()

    def close(self) -> None:
        """Close all files; arrays that were read stay."""
        for item in self._opened.values():
            if isinstance(item, FrameFile):
                item.close()
        self._opened.clear()

    def _once(self, key: str, read):  # noqa: ANN001, ANN202
        if key not in self._opened:
            self._opened[key] = read()
        return self._opened[key]

    def _prefixes(self, suffixes: Sequence[str]) -> list[str]:
        names = [name[: -len(suffixes[0])] for name in self.history.names if name.endswith(suffixes[0])]
        return [name for name in names if all(name + end in self.history for end in suffixes)]

    def _read_table(self, title: str, order: Sequence[str]) -> Table:
        h5_path, csv_path = self.path(".h5"), self.path(f"_{title}.csv")
        reason = f"{h5_path} does not exist"
        if h5_path.is_file():
            try:
                return self._read_table_of_h5(title, order)
            except ResultsError as error:
                reason = self._opened["h5_error"] = str(error)
        if csv_path.is_file():
            return read_csv_table(csv_path, title)
        raise ResultsError(f"no {title} of {self.job}: {reason}, {csv_path.name} neither")

    def _read_table_of_h5(self, title: str, order: Sequence[str]) -> Table:
        path = self.path(".h5")
        file, closed = open_hdf5(path)
        self._opened["h5_unfinished"] = not closed
        with file:
            with reading(path):
                if f"rfem/{title}" not in file:
                    raise ResultsError(f"{path.name} has no /rfem/{title}")
                group = file[f"rfem/{title}"]
            return read_hdf5_table(group, title, path, [*order, *self._header_of(title)])

    def _header_of(self, title: str) -> list[str]:
        """Column names of the CSV table, whose order an HDF5 group may not keep; [] without it."""
        try:
            with self.path(f"_{title}.csv").open(encoding="utf-8") as stream:
                return [name.strip() for name in next(csv.reader(stream), [])]
        except (OSError, UnicodeDecodeError, csv.Error):
            return []

    def _read_provenance(self) -> dict[str, str]:
        if not self.path(".h5").is_file():
            return {}
        try:
            return self._read_provenance_of_h5()
        except ResultsError as error:
            self._opened["h5_error"] = str(error)
            return {}

    def _read_provenance_of_h5(self) -> dict[str, str]:
        file, closed = open_hdf5(self.path(".h5"))
        self._opened["h5_unfinished"] = not closed
        with file, reading(self.path(".h5"), "the provenance"):
            if "rfem" not in file:
                return {}
            group = file["rfem"]
            values = {name: text_of(value) for name, value in group.attrs.items()}
            for name, item in group.items():
                if isinstance(item, h5py.Dataset):
                    values[name] = text_of(item[()])
            return values


def open_results(job: PathLike) -> Results:
    """Open the results of JOB, DIR/JOB, DIR (with one job) or one of the job's files (see `find_job`)."""
    return Results(*find_job(job))


def heading_lines(deck: str) -> list[str]:
    """The title lines of a deck: the data lines of all its *HEADING (included files have some)."""
    lines: list[str] = []
    inside = False
    for line in deck.splitlines():
        if re.match(r"\s*\*(?!\*)", line):
            inside = bool(re.match(r"\s*\*\s*heading\s*(,|$)", line, re.IGNORECASE))
        elif inside and not line.lstrip().startswith("**"):
            lines.append(line.strip())
    return lines

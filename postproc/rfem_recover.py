#!/usr/bin/env python3
"""Repair the result files of a run that was killed, so that every program can open them.

rfem_recover.py JOB keeps all frames and rows that the run had finished and leaves out what it was writing
when it ended. rfem_plot.py and rfem_results need no repair; ParaView, VTK and plain h5py do.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from rfem_command import Parser
from rfem_frames import GEOMETRY_COUNTS, FrameFile
from rfem_io import ResultsError, open_hdf5, short_text
from rfem_results import find_job

BLOCK_BYTES = 64_000_000  # copied at once
FRAME_SUFFIXES = (".vtkhdf", "_cracks.vtkhdf")
TEXT_SUFFIXES = ("_history.csv", "_events.csv", ".dat")
PER_GEOMETRY = GEOMETRY_COUNTS  # one row a geometry; all else below Steps: one row a frame


@dataclass
class Report:
    """What became of a job's files."""

    repaired: list[str] = field(default_factory=list)  #: file: what is in it now
    sound: list[str] = field(default_factory=list)  #: files that needed nothing
    lost: list[str] = field(default_factory=list)  #: file: why nothing can be had of it


def recover(job: str | Path) -> Report:
    """Repair all files of a job. ResultsError if there are none, or if a program has one of them open."""
    directory, name = find_job(job)
    paths = {end: directory / (name + end) for end in (*FRAME_SUFFIXES, ".h5", *TEXT_SUFFIXES)}
    paths = {end: path for end, path in paths.items() if path.is_file()}
    for path in paths.values():
        refuse_open(path)
    report = Report()
    count = frames_to_keep([path for end, path in paths.items() if end in FRAME_SUFFIXES])
    for end, path in paths.items():
        try:
            if end in TEXT_SUFFIXES:
                done = mend_text(path)
            elif end in FRAME_SUFFIXES:
                done = mend_frames(path, count)
            else:
                done = mend_tables(path)
        except ResultsError as error:
            report.lost.append(str(error))
            continue
        (report.repaired if done else report.sound).append(f"{path.name}: {done}" if done else path.name)
    return report


def refuse_open(path: Path) -> None:
    """ResultsError if some process of this machine has the file open: its run may not have ended."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ResultsError(f"{path} is open in another program: is the run still going?") from error
        except OSError:
            pass  # a file system without locks
    wanted = path.stat()
    for link in open_files():
        try:
            found = link.stat()
        except OSError:
            continue
        if (found.st_dev, found.st_ino) == (wanted.st_dev, wanted.st_ino):
            raise ResultsError(
                f"{path} is open in process {link.parts[2]}: wait for its end, or end it, before repairing"
            )


def open_files() -> Iterator[Path]:
    """Open files of all other processes that may be looked at (Linux)."""
    for process in Path("/proc").glob("[0-9]*"):
        if process.name == str(os.getpid()):
            continue
        try:
            yield from (process / "fd").iterdir()
        except OSError:
            continue


# --- HDF5 ------------------------------------------------------------------------------------------------


def frames_to_keep(paths: Sequence[Path]) -> int | None:
    """Number of frames that all frame files have complete (they go together, frame for frame).

    A file without any frame does not count: it is lost, the other one is not. None where all are closed.
    """
    counts, closed = [], True
    for path in paths:
        try:
            frames = FrameFile(path)
        except ResultsError:
            closed = False
            continue
        counts.append(len(frames))
        closed = closed and frames.closed_normally
        frames.close()
    return None if closed else min((count for count in counts if count), default=0)


def mend_frames(path: Path, count: int | None) -> str:
    """Write a frame file anew with its first `count` frames; '' if it is sound, else what it has now."""
    frames = FrameFile(path)
    try:
        if count is None or (frames.closed_normally and len(frames) == count):
            return ""
        if not len(frames) or not count:
            raise ResultsError(f"{path}: killed before its first frame was complete")
        rows = rows_of_frames(frames.file["VTKHDF"], count)
        rewrite(path, frames.file, rows, {"VTKHDF/Steps": {"NSteps": count}})
    finally:
        frames.close()
    check_frames(path, count)
    return f"{count} frames"


def rows_of_frames(root: h5py.Group, count: int) -> dict[str, int]:
    """Rows to keep of each dataset for the first `count` frames."""
    steps = root["Steps"]
    parts = steps["PartOffsets"][:count]
    rows = {f"VTKHDF/{name}": int(parts.max()) + 1 for name in PER_GEOMETRY}
    sizes = [root[name][:][parts] for name in GEOMETRY_COUNTS]  # of each frame: points, cells, ids
    starts = [
        np.ravel(steps[name][:count]) for name in ("PointOffsets", "CellOffsets", "ConnectivityIdOffsets")
    ]
    points, cells, ids = (int((start + size).max()) for start, size in zip(starts, sizes))
    rows |= {"VTKHDF/Points": points, "VTKHDF/Connectivity": ids, "VTKHDF/Types": cells}
    rows["VTKHDF/Offsets"] = cells + int(parts.max()) + 1  # one more than cells, for each geometry
    for location, size in (
        ("PointData", sizes[0]),
        ("CellData", sizes[1]),
        ("FieldData", np.ones(count, int)),
    ):
        for name in root.get(location, {}):
            offsets = steps[f"{location}Offsets/{name}"][:count]
            rows[f"VTKHDF/{location}/{name}"] = int((offsets + size).max())

    def of_steps(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            rows[f"VTKHDF/Steps/{name}"] = count

    steps.visititems(of_steps)
    return rows


def check_frames(path: Path, count: int) -> None:
    """ResultsError unless the file opens as an ordinary one with all its frames."""
    frames = FrameFile(path)
    sound = frames.closed_normally and len(frames) == count
    frames.close()
    if not sound:
        raise ResultsError(f"{path}: the repaired file has not the {count} frames it should have")


def mend_tables(path: Path) -> str:
    """Write JOB.h5 anew, with the rows that all columns of a table have; '' if it is sound."""
    try:
        file, closed = open_hdf5(path)
    except (
        ResultsError
    ):  # killed between the last row and the end of the provenance: an ordinary file, not closed
        if not clear_flags(path):
            raise
        file, closed = open_hdf5(path)[0], False
    with file:
        if closed:
            return ""
        rows, kept = {}, []
        for title in ("history", "events"):
            group = file.get(f"rfem/{title}")
            if group is None:
                continue
            length = min((column.shape[0] for column in group.values()), default=0)
            rows |= {f"rfem/{title}/{name}": length for name in group}
            kept.append(f"{length} rows of {title}" if title == "history" else f"{length} {title}")
        rewrite(
            path, file, rows, {"rfem": {"recovered": f"{', '.join(kept)}; the run did not end by itself"}}
        )
    return ", ".join(kept)


def clear_flags(path: Path) -> bool:
    """Let h5clear of the HDF5 tools, if it is installed, take off the mark of a file being written."""
    if shutil.which("h5clear") is None:
        return False
    copy = path.with_name(path.name + ".recover")
    try:
        shutil.copyfile(path, copy)
        subprocess.run(["h5clear", "-s", "--increment=0", copy], check=True, capture_output=True)
        with h5py.File(copy):
            pass
        copy.replace(path)
        return True
    except (OSError, subprocess.CalledProcessError):
        return False
    finally:
        copy.unlink(missing_ok=True)


def rewrite(
    path: Path, old: h5py.File, rows: dict[str, int], attributes: dict[str, dict[str, object]]
) -> None:
    """A new file in the place of `path`: all of `old`, datasets cut to `rows`, attributes as given.

    It is written beside it, synchronised with the disk and renamed, so that nothing is lost whatever happens.
    """
    temporary = path.with_name(path.name + ".recover")
    try:
        with h5py.File(temporary, "w", libver=("v110", "v110")) as new:
            copy_group(old["/"], new["/"], rows)
            for owner, values in attributes.items():
                for name, value in values.items():
                    kind = old[owner].attrs.get_id(name).dtype if name in old[owner].attrs else None
                    value = np.bytes_(value.encode()) if isinstance(value, str) else value
                    new[owner].attrs.create(name, value, dtype=kind)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        temporary.unlink(missing_ok=True)
        reason = getattr(error, "strerror", None) or short_text(error)
        raise ResultsError(f"{path} cannot be repaired: {reason}; it is as it was") from error


def copy_group(old: h5py.Group, new: h5py.Group, rows: dict[str, int]) -> None:
    """Copy a group with all that is in it."""
    copy_attributes(old, new)
    for name, item in old.items():
        if isinstance(item, h5py.Group):
            copy_group(item, new.create_group(name), rows)
        else:
            copy_dataset(item, new, name, rows.get(item.name.lstrip("/")))


def copy_dataset(old: h5py.Dataset, group: h5py.Group, name: str, rows: int | None) -> None:
    """Copy a dataset of the same type, layout and filters, cut to so many rows (None: all)."""
    shape = old.shape if rows is None or not old.shape else (rows, *old.shape[1:])
    if shape and shape[0] > old.shape[0]:
        raise ResultsError(f"{old.file.filename}: {old.name} has {old.shape[0]} rows, {rows} are needed")
    space = h5py.h5s.create_simple(shape, old.id.get_space().get_simple_extent_dims(True)) if shape else None
    made = h5py.h5d.create(
        group.id,
        name.encode(),
        old.id.get_type(),
        space or h5py.h5s.create(h5py.h5s.SCALAR),
        old.id.get_create_plist(),
    )
    new = h5py.Dataset(made)
    copy_attributes(old, new)
    if not shape:
        new[()] = old[()]
        return
    step = max(1, BLOCK_BYTES // max(1, old.dtype.itemsize * int(np.prod(shape[1:]))))
    for start in range(0, shape[0], step):
        stop = min(start + step, shape[0])
        new[start:stop] = old[start:stop]


def copy_attributes(old: h5py.Group | h5py.Dataset, new: h5py.Group | h5py.Dataset) -> None:
    """Copy attributes with their types (VTK wants texts of fixed length)."""
    for name, value in old.attrs.items():
        new.attrs.create(name, value, dtype=old.attrs.get_id(name).dtype)


# --- text ------------------------------------------------------------------------------------------------


def mend_text(path: Path) -> str:
    """Cut off a last line without an end; '' if there is none."""
    size = path.stat().st_size
    with path.open("rb+") as file:
        end = size
        while end > 0:
            start = max(0, end - 65536)
            file.seek(start)
            newline = file.read(end - start).rfind(b"\n")
            if newline >= 0:
                end = start + newline + 1
                break
            end = start
        if end == size:
            return ""
        file.truncate(end)
        os.fsync(file.fileno())
    return f"a torn last line of {size - end} bytes is cut off"


# --- the command -----------------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: 0 all files are sound now, 1 some file is lost, 2 wrong usage or a run that goes on."""
    parser = Parser(
        prog="rfem_recover.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="exit status: 0 all files can be read now, 1 some file is lost, 2 nothing was tried",
    )
    parser.add_argument(
        "job", metavar="JOB", help="job name, with its directory; one of its files will do as well"
    )
    options = parser.parse_args(arguments)
    try:
        report = recover(options.job)
    except ResultsError as error:
        sys.stderr.write(f"rfem_recover: error: {error}\n")
        return 2
    for line in report.repaired:
        print(f"repaired {line}")
    for name in report.sound:
        print(f"sound    {name}")
    for line in report.lost:
        sys.stderr.write(f"rfem_recover: error: {line}\n")
    return 1 if report.lost else 0


if __name__ == "__main__":
    sys.exit(main())

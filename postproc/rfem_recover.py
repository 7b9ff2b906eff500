#!/usr/bin/env python3
"""Repair the result files of a run that was killed, so that every program can open them.

rfem_recover.py JOB .. keeps all frames and rows that the run had finished and leaves out what it was
writing when it ended. rfem_plot.py and rfem_results need no repair; ParaView, VTK and plain h5py do. All data
are read once: what is damaged, cut off or missing is told; of a file that was cut off, what can be read is
kept.
JOB may be a folder: all jobs in it.
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

from rfem_command import Parser, leave_without

try:
    import h5py
    import numpy as np

    from rfem_frames import GEOMETRY_COUNTS, FrameFile
    from rfem_io import (
        BLOCK_BYTES,
        NOT_SAVED,
        ResultsError,
        cut_off,
        open_hdf5,
        reading,
        short_text,
        unreadable_rows,
    )
    from rfem_results import find_job, jobs_in
except ModuleNotFoundError as missing:
    leave_without("rfem_recover", missing)

FRAME_SUFFIXES = (".vtkhdf", "_cracks.vtkhdf")
TEXT_SUFFIXES = ("_history.csv", "_events.csv", ".dat")
PER_GEOMETRY = GEOMETRY_COUNTS  # one row a geometry; all else below Steps: one row a frame


@dataclass
class Report:
    """What became of a job's files."""

    repaired: list[str] = field(default_factory=list)  #: file: what is in it now
    sound: list[str] = field(default_factory=list)  #: files that needed nothing
    lost: list[str] = field(default_factory=list)  #: file: why nothing, or not all, can be had of it


@dataclass
class Frames:
    """What can be had of a frame file."""

    count: int  #: frames that it has complete
    stored: int  #: frames that it should have
    closed: bool  #: an ordinary file, and whole
    cut: bool  #: it was cut off after it was closed
    bad: dict[int, str] = field(default_factory=dict)  #: frames that cannot be read: which data first

    @property
    def whole(self) -> bool:
        """Nothing is to be done."""
        return self.closed and self.undamaged and self.count == self.stored

    @property
    def undamaged(self) -> bool:
        """It is as its run left it, as far as can be seen."""
        return not self.bad and not self.cut


def recover(job: str | Path) -> Report:
    """Repair all files of a job. ResultsError if there are none, or if a program has one of them open."""
    directory, name = find_job(job)
    paths = {end: directory / (name + end) for end in (*FRAME_SUFFIXES, ".h5", *TEXT_SUFFIXES)}
    paths = {end: path for end, path in paths.items() if path.is_file()}
    for path in paths.values():
        refuse_open(path)
    report = Report()
    looks: dict[Path, Frames] = {}
    for end in FRAME_SUFFIXES:
        if end in paths:
            try:
                looks[paths[end]] = look_at_frames(paths[end])
            except ResultsError as error:
                report.lost.append(str(error))
    report.lost += missing_files(directory, name, looks)
    keep = frames_to_keep(looks, len(looks) < sum(end in paths for end in FRAME_SUFFIXES))
    for end, path in paths.items():
        if end in FRAME_SUFFIXES and path not in looks:
            continue
        try:
            if end in TEXT_SUFFIXES:
                done = mend_text(path)
            elif end in FRAME_SUFFIXES:
                done = mend_frames(path, looks[path], keep.get(path))
            else:
                done = mend_tables(path)
        except ResultsError as error:
            tables = [paths[end].name for end in TEXT_SUFFIXES[:2] if end in paths]
            also = f" ({' and '.join(tables)} have its rows)" if end == ".h5" and tables else ""
            report.lost.append(f"{error}{also}")
            continue
        (report.repaired if done else report.sound).append(f"{path.name}: {done}" if done else path.name)
    return report


def missing_files(directory: Path, name: str, looks: dict[Path, Frames]) -> list[str]:
    """Files that a run has always written by the time it wrote those that are there.

    They are made in this order: JOB.h5, tables, frames of the mesh, frames of the cracks.
    """
    there = {end for end in (".h5", *TEXT_SUFFIXES, *FRAME_SUFFIXES) if (directory / (name + end)).is_file()}
    needed = {}
    if ".vtkhdf" in there and any(look.count for look in looks.values()):
        needed["_cracks.vtkhdf"] = f"{name}.vtkhdf"
    if "_cracks.vtkhdf" in there:
        needed[".vtkhdf"] = f"{name}_cracks.vtkhdf"
    if there & set(FRAME_SUFFIXES):
        needed |= dict.fromkeys((".h5", "_history.csv", "_events.csv"), "the frames")
    return [
        f"{directory / (name + end)} is missing: it goes with {other}; look for it where the run wrote "
        "it, or run it again"
        for end, other in needed.items()
        if end not in there
    ]


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


def look_at_frames(path: Path) -> Frames:
    """Read all data of a frame file once. ResultsError if it has no frame that can be had."""
    frames = FrameFile(path, salvage=True)
    try:
        with reading(path, advice=NOT_SAVED):
            stored = int(frames.file["VTKHDF/Steps"].attrs["NSteps"])
            look = Frames(len(frames), stored, frames.closed_normally, bool(cut_off(path)))
            if not look.count:
                how = "cut off" if look.cut else "killed"
                raise ResultsError(f"{path}: {how} before its first frame was complete")
            look.bad = unreadable_frames(frames)
    finally:
        frames.close()
    if len(look.bad) == look.count:
        raise ResultsError(
            f"{path}: none of its {look.count} frames can be read whole ({next(iter(look.bad.values()))} is "
            "damaged); it is as it was"
        )
    return look


def unreadable_frames(frames: FrameFile) -> dict[int, str]:
    """Frames of which some data cannot be read, each with the name of such data."""
    root, count = frames.file["VTKHDF"], len(frames)
    bad: dict[int, str] = {}

    def spoil(name: str, first: np.ndarray, size: np.ndarray) -> None:
        """The frames whose rows `first` to `first + size` of a dataset meet rows that cannot be read."""
        for start, stop in unreadable_rows(root[name]):
            for index in np.flatnonzero((first < stop) & (first + size > start)):
                bad.setdefault(int(index), name)

    def of_steps(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            spoil(f"Steps/{name}", np.arange(count), np.ones(count, int))

    root["Steps"].visititems(of_steps)
    for index in range(count):
        if index not in bad and not frames.is_complete(index):
            bad[index] = "Steps"
    good = np.array([index not in bad for index in range(count)])
    if not good.any():
        return bad
    parts, sizes, starts = places_of_frames(root, count)
    # what is wrong in the steps is told already, and must not spoil the look at the rest
    sizes = [np.where(good, size, 0) for size in sizes]
    for name in GEOMETRY_COUNTS:
        spoil(name, parts, np.ones(count, int))
    points, cells, ids = starts
    for name, first, size in (
        ("Points", points, sizes[0]),
        ("Connectivity", ids, sizes[2]),
        ("Types", cells, sizes[1]),
        ("Offsets", cells + parts, sizes[1] + 1),
        *fields_of_frames(root, count, sizes),
    ):
        spoil(name, first, size)
    return bad


def places_of_frames(root: h5py.Group, count: int) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Of each frame: number of its geometry; how many points, cells, ids; where they begin."""
    steps = root["Steps"]
    parts = steps["PartOffsets"][:count]
    last = [root[name].shape[0] - 1 for name in GEOMETRY_COUNTS]
    sizes = [root[name][:][np.clip(parts, 0, end)] for name, end in zip(GEOMETRY_COUNTS, last)]
    starts = [
        np.ravel(steps[name][:count]) for name in ("PointOffsets", "CellOffsets", "ConnectivityIdOffsets")
    ]
    return parts, sizes, starts


def fields_of_frames(
    root: h5py.Group, count: int, sizes: Sequence[np.ndarray]
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Each field: its name, of each frame the first row and the number of rows."""
    for location, size in (
        ("PointData", sizes[0]),
        ("CellData", sizes[1]),
        ("FieldData", np.ones(count, int)),
    ):
        for name in root.get(location, {}):
            yield f"{location}/{name}", np.ravel(root[f"Steps/{location}Offsets/{name}"][:count]), size


def frames_to_keep(looks: dict[Path, Frames], more: bool) -> dict[Path, list[int]]:
    """Frames to keep of each file that is to be written anew.

    The frames of the two files go together, frame for frame: after a run that was killed all that both
    have. A file that is whole is not cut because the other one was damaged later: of that its first frames
    are kept. `more`: there is a file without any frame; it is lost, the other is not.
    """
    if not more and all(look.closed for look in looks.values()):
        return {}
    count = min((look.count for look in looks.values()), default=0)
    common = [index for index in range(count) if not any(index in look.bad for look in looks.values())]
    if not any(look.whole for look in looks.values()) or all(look.undamaged for look in looks.values()):
        return dict.fromkeys(looks, common)
    keep = {}
    for path, look in looks.items():
        if not look.whole:
            keep[path] = list(range(min((*look.bad, look.count))))
    return keep


def mend_frames(path: Path, look: Frames, keep: Sequence[int] | None) -> str:
    """Write a frame file anew with the frames to keep; '' if it is sound, else what it has now."""
    if look.whole and (keep is None or len(keep) == look.count):
        return ""
    if keep is None:
        bad = [*look.bad, *range(look.count, look.stored)]
        reason = f" (damaged: {', '.join(dict.fromkeys(look.bad.values()))})" if look.bad else ""
        raise ResultsError(
            f"{path}: {frames_text(bad)} of {look.stored} cannot be read{reason}, the others can; "
            "it is as it was"
        )
    if not keep:
        raise ResultsError(f"{path}: its first frame cannot be read; it is as it was")
    frames = FrameFile(path, salvage=True)
    try:
        with reading(path, advice=NOT_SAVED):
            rows = rows_of_frames(frames.file["VTKHDF"], keep)
        rewrite(path, frames.file, rows, {"VTKHDF/Steps": {"NSteps": len(keep)}}, keep)
    finally:
        frames.close()
    check_frames(path, len(keep))
    lost = [*look.bad, *(range(look.count, look.stored) if look.cut else ())]
    if not lost:
        return f"{len(keep)} frames"
    return f"{len(keep)} frames; {frames_text(lost)} of {max(look.count, look.stored)} cannot be read"


def frames_text(numbers: Sequence[int]) -> str:
    """Numbers of frames in words: 'frame 3', 'frames 3, 5 to 8'."""
    runs: list[list[int]] = []
    for index in sorted(numbers):
        if runs and runs[-1][1] == index - 1:
            runs[-1][1] = index
        else:
            runs.append([index, index])
    texts = [str(first) if first == last else f"{first} to {last}" for first, last in runs]
    return f"frame{'s' if len(numbers) != 1 else ''} {', '.join(texts)}"


def rows_of_frames(root: h5py.Group, keep: Sequence[int]) -> dict[str, int]:
    """Rows to keep of each dataset for some frames; of those below Steps only the frames' own rows are."""
    count, chosen = max(keep) + 1, np.array(keep)
    parts, sizes, starts = places_of_frames(root, count)
    rows = {f"VTKHDF/{name}": int(parts[chosen].max()) + 1 for name in PER_GEOMETRY}
    points, cells, ids = (int((start + size)[chosen].max()) for start, size in zip(starts, sizes))
    rows |= {"VTKHDF/Points": points, "VTKHDF/Connectivity": ids, "VTKHDF/Types": cells}
    rows["VTKHDF/Offsets"] = cells + int(parts[chosen].max()) + 1  # one more than cells, for each geometry
    for name, first, size in fields_of_frames(root, count, sizes):
        rows[f"VTKHDF/{name}"] = int((first + size)[chosen].max())

    def of_steps(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            rows[f"VTKHDF/Steps/{name}"] = len(keep)

    root["Steps"].visititems(of_steps)
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
        file, closed = open_hdf5(path, salvage=True)
    except (
        ResultsError
    ):  # killed between the last row and the end of the provenance: an ordinary file, not closed
        if cut_off(path) or not clear_flags(path):
            raise
        file, closed = open_hdf5(path, salvage=True)[0], False
    with file, reading(path, advice=NOT_SAVED):
        if "rfem" not in file:
            raise ResultsError(f"{path} has no /rfem: no file of rfem, or damaged")
        bad = unreadable_datasets(file)
        if closed:
            if not bad:
                return ""
            raise ResultsError(
                f"{path}: {', '.join(bad)} cannot be read; the rows are in {path.stem}_history.csv and "
                "_events.csv; it is as it was"
            )
        rows, kept = {}, []
        for title in ("history", "events"):
            group = file.get(f"rfem/{title}")
            if group is None:
                continue
            there = min((column.shape[0] for column in group.values()), default=0)
            length = min((readable_rows(column, bad) for column in group.values()), default=0)
            rows |= {f"rfem/{title}/{name}": length for name in group}
            less = f" of {there}, the others cannot be read" if length < there else ""
            kept.append(f"{length} {'rows of history' if title == 'history' else 'events'}{less}")
        left_out = [name for name in bad if name not in rows]
        reason = "the file was cut off" if cut_off(path) else "the run did not end by itself"
        rewrite(path, file, rows, {"rfem": {"recovered": f"{', '.join(kept)}; {reason}"}}, left_out=left_out)
    done = ", ".join(kept)
    return f"{done}; without {', '.join(left_out)}, which cannot be read" if left_out else done


def unreadable_datasets(file: h5py.File) -> dict[str, int]:
    """Datasets below /rfem of which something cannot be read: the number of rows before that."""
    bad = {}

    def look(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            rows = unreadable_rows(item)
            if rows:
                bad[f"rfem/{name}"] = rows[0][0]

    file["rfem"].visititems(look)
    return bad


def readable_rows(column: h5py.Dataset, bad: dict[str, int]) -> int:
    """Number of rows of a column up to the first that cannot be read."""
    return bad.get(column.name.lstrip("/"), column.shape[0])


def clear_flags(path: Path) -> bool:
    """Let h5clear of the HDF5 tools, if it is installed, take off the mark of a file being written."""
    if shutil.which("h5clear") is None:
        return False
    copy = path.with_name(path.name + ".recover")
    try:
        shutil.copyfile(path, copy)
        subprocess.run(["h5clear", "-s", "--increment=0", copy], check=True, capture_output=True, timeout=60)
        with h5py.File(copy) as file:
            list(file["rfem"])
        copy.replace(path)
        return True
    except (OSError, RuntimeError, KeyError, subprocess.SubprocessError):
        return False
    finally:
        copy.unlink(missing_ok=True)


def rewrite(
    path: Path,
    old: h5py.File,
    rows: dict[str, int],
    attributes: dict[str, dict[str, object]],
    keep: Sequence[int] = (),
    left_out: Sequence[str] = (),
) -> None:
    """A new file in the place of `path`: all of `old`, datasets cut to `rows`, attributes as given.

    `keep`: the frames to keep; below Steps only their rows are copied. `left_out`: datasets that are not.

    It is written beside it, synchronised with the disk and renamed, so that nothing is lost whatever happens.
    """
    temporary = path.with_name(path.name + ".recover")
    try:
        with h5py.File(temporary, "w", libver=("v110", "v110")) as new:
            copy_group(old["/"], new["/"], rows, keep, left_out)
            for owner, values in attributes.items():
                for name, value in values.items():
                    kind = old[owner].attrs.get_id(name).dtype if name in old[owner].attrs else None
                    value = np.bytes_(value.encode()) if isinstance(value, str) else value
                    new[owner].attrs.create(name, value, dtype=kind)
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        temporary.unlink(missing_ok=True)
        reason = getattr(error, "strerror", None) or short_text(error)
        raise ResultsError(f"{path} cannot be repaired: {reason}; it is as it was") from error


def copy_group(
    old: h5py.Group, new: h5py.Group, rows: dict[str, int], keep: Sequence[int], left_out: Sequence[str]
) -> None:
    """Copy a group with all that is in it."""
    copy_attributes(old, new)
    for name, item in old.items():
        path = item.name.lstrip("/")
        if isinstance(item, h5py.Group):
            copy_group(item, new.create_group(name), rows, keep, left_out)
        elif path not in left_out:
            copy_dataset(item, new, name, rows.get(path), keep if path.startswith("VTKHDF/Steps/") else ())


def copy_dataset(
    old: h5py.Dataset, group: h5py.Group, name: str, rows: int | None, keep: Sequence[int]
) -> None:
    """Copy a dataset of the same type, layout and filters, cut to `rows` (None: all), or to those to keep.

    Rows that cannot be read stay empty: no frame to keep has any.
    """
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
    elif keep:
        new[...] = old[: max(keep) + 1][list(keep)]
    else:
        first = 0
        for start, stop in [*unreadable_rows(old), (shape[0], shape[0])]:
            copy_rows(old, new, first, min(start, shape[0]))
            first = stop


def copy_rows(old: h5py.Dataset, new: h5py.Dataset, first: int, last: int) -> None:
    """Copy rows from `first` up to `last`, a block at a time."""
    step = max(1, BLOCK_BYTES // max(1, old.dtype.itemsize * int(np.prod(old.shape[1:]))))
    for start in range(first, last, step):
        stop = min(start + step, last)
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


def jobs_of(place: str) -> list[str | Path]:
    """The jobs that an argument means: all of a folder, else the one it names."""
    folder = Path(place)
    if folder.is_dir() and jobs_in(folder):
        return [folder / name for name in jobs_in(folder)]
    return [place]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: 0 all files are sound now, 1 some file is lost, 2 wrong usage or a run that goes on."""
    parser = Parser(
        prog="rfem_recover.py",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="exit status: 0 all files are there and can be read now, 1 some file is missing, lost or "
        "damaged, 2 some job was left alone",
    )
    parser.add_argument(
        "jobs",
        metavar="JOB",
        nargs="+",
        help="job name, with its directory; one of its files will do as well, or a folder of jobs",
    )
    options = parser.parse_args(arguments)
    return max(recover_and_say(job) for place in options.jobs for job in jobs_of(place))


def recover_and_say(job: str | Path) -> int:
    """Recover a job and say what was done; the exit status."""
    try:
        report = recover(job)
    except ResultsError as error:
        sys.stderr.write(f"rfem_recover: error: {error}\n")
        return 2
    for line in report.repaired:
        print(f"repaired {line}")
    for name in report.sound:
        print(f"sound    {name}")
    sys.stdout.flush()  # before the errors, where both go into one file
    for line in report.lost:
        sys.stderr.write(f"rfem_recover: error: {line}\n")
    return 1 if report.lost else 0


if __name__ == "__main__":
    sys.exit(main())

"""What runs have left: ordinary files, the beginning of what the whole run wrote; or all of it, to the last byte."""

import h5py
import numpy as np
from rfem_results import open_results

HDF5 = (".h5", ".vtkhdf", "_cracks.vtkhdf")
TEXTS = ("_history.csv", "_events.csv", ".dat")


def assert_kept(folder, whole, job):
    """Check every file of a job in a folder; rows of the history and frames that are there."""
    for end in HDF5:
        if (folder / (job + end)).exists():
            with h5py.File(folder / (job + end)) as file:  # refuses what was not closed
                whole_columns(file) if end == ".h5" else whole_steps(file)
    for end in TEXTS:
        path = folder / (job + end)
        if path.exists():
            text = path.read_text()
            assert not text or text.endswith("\n"), f"{path.name} ends within a line"
            assert (whole / path.name).read_text().startswith(text), path.name
    with open_results(folder / job) as found, open_results(whole / job) as expected:
        rows = same_tables(found, expected)
        if not (folder / f"{job}.vtkhdf").exists():
            return rows, 0
        frames = len(found.frames)
        assert frames == len(found.cracks) > 0
        for number in {0, frames // 2, frames - 1}:
            same_frame(found.frames[number], expected.frames[number])
            same_frame(found.cracks[number], expected.cracks[number])
        return rows, frames


def whole_columns(file):
    """All columns of a table are of one length."""
    for title in ("history", "events"):
        assert len({column.shape[0] for column in file[f"rfem/{title}"].values()}) == 1, title


def whole_steps(file):
    """VTK's readers see the finished frames alone."""
    steps = file["VTKHDF/Steps"]
    assert steps.attrs["NSteps"] == len(steps["Values"])


def same_tables(found, expected):
    """The rows are the first ones of the whole run; how many there are in the history."""
    for title in ("history", "events"):
        one, two = getattr(found, title), getattr(expected, title)
        for name, column in one.columns.items():
            other = two[name][: len(column)]
            assert np.array_equal(column, other, equal_nan=column.dtype.kind == "f"), name
    return len(found.history["step"])


def same_frame(one, two):
    assert one.time == two.time and one.kind == two.kind
    assert np.array_equal(one.points, two.points) and np.array_equal(one.cells, two.cells)
    for fields, others in ((one.point_data, two.point_data), (one.cell_data, two.cell_data)):
        assert fields.keys() == others.keys()
        for name in fields:
            assert np.array_equal(fields[name], others[name]), name


def datasets(path):
    """The bytes of every dataset of a file."""
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset):
            found[name] = (item.shape, np.asarray(item[()]).tobytes() if item.dtype.kind != "O" else item[()].tolist())

    with h5py.File(path, "r") as file:
        file.visititems(keep)
    return found


def tables(folder):
    """The bytes of every text that a run writes."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in (".csv", ".dat", ".mac")}


def assert_same(folder, other):
    """Two runs of the job j have written the same bytes."""
    assert tables(folder) == tables(other)
    for name in ("j.vtkhdf", "j_cracks.vtkhdf", "j.h5"):
        assert (folder / name).exists() == (other / name).exists()
        if not (folder / name).exists():
            continue
        one, two = datasets(folder / name), datasets(other / name)
        assert one.keys() == two.keys(), name
        for key, value in one.items():
            assert value == two[key], (name, key)

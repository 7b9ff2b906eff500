"""Reading frames: the meshes and crack segments of rfem's VTKHDF files, with their fields."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rfem_io import NOT_SAVED, WHAT_TO_DO, PathLike, ResultsError, open_hdf5, reading, short_text

TRIANGLE, LINE = 5, 3  # VTK cell types
NODES_OF_CELL = {TRIANGLE: 3, LINE: 2}
GEOMETRY_COUNTS = ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds")  # one entry a geometry

FRAME_KINDS = {
    0: "start",
    1: "before the first event",
    2: "after an event",
    3: "nothing fails any more",
    4: "not converged",
}
CRACK_MODES = {0: "pre-existing", 1: "tension", 2: "shear"}
CRACK_STATES = {0: "open", 1: "slip", 2: "stick"}

# The k-th frame of one time t has the value t (1 + k 1e-9): neighbours closer than this are one time.
SAME_TIME = 1.5e-9


class FieldData(Mapping):
    """The fields of one frame: a read-only mapping from name to array, read when it is asked for."""

    def __init__(self, frames: FrameFile, location: str, index: int, count: int) -> None:
        self._frames, self._location, self._index, self._count = frames, location, index, count
        self._cache: dict[str, np.ndarray] = {}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._cache:
            if name not in self._names():
                raise KeyError(name)
            self._cache[name] = self._frames.read_field(self._location, name, self._index, self._count)
        return self._cache[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names())

    def __len__(self) -> int:
        return len(self._names())

    def components(self, name: str) -> int:
        """Number of components of a field without reading it: 1, 3 (vector) or 6 (XX YY ZZ XY YZ XZ)."""
        return self._frames.components(self._location, name)

    def _names(self) -> list[str]:
        return self._frames.field_names(self._location)


@dataclass
class Frame:
    """One frame: a mesh of triangles, or of crack segments, with its fields."""

    index: int  #: number of the frame, from 0
    time: float  #: total time, without the 1e-9 that keep frames of one time apart
    kind: int  #: see FRAME_KINDS; -1 where the file does not say
    points: np.ndarray  #: (n, 2) reference coordinates
    cells: np.ndarray  #: (m, 3) corners of triangles or (m, 2) ends of segments, counted from 0
    point_data: FieldData  #: name -> (n,) or (n, components)
    cell_data: FieldData  #: name -> (m,) or (m, components)

    @property
    def kind_text(self) -> str:
        """What the frame shows, in words; empty where the file does not say."""
        return FRAME_KINDS.get(self.kind, "")

    @property
    def displacement(self) -> np.ndarray:
        """(n, 2) displacements; zeros where the file has none."""
        if "displacement" not in self.point_data:
            return np.zeros_like(self.points)
        return self.point_data["displacement"][:, :2].astype(np.float64)


class FrameFile(Sequence):
    """A temporal VTKHDF file: a sequence of `Frame`, read one at a time; negative indices from the end."""

    def __init__(self, path: PathLike, salvage: bool = False) -> None:
        self.path = Path(path)
        self.file, self.closed_normally = open_hdf5(self.path, salvage)
        try:
            self._root = self.file["VTKHDF"]
            self._steps = self._root["Steps"]
            self._count = self._complete_frames()
            self._values = self._steps["Values"][: self._count].astype(np.float64)
        except (KeyError, OSError, RuntimeError, ValueError, TypeError, IndexError) as error:
            self.file.close()
            raise ResultsError(
                f"{self.path} is no VTKHDF file with steps, or its steps are damaged ({short_text(error)}); "
                f"{NOT_SAVED if salvage else WHAT_TO_DO}"
            ) from error
        self._geometry: tuple[int, np.ndarray, np.ndarray] = (-1, np.empty(0), np.empty(0))

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, index: int) -> Frame:  # type: ignore[override]
        number = self.number(index)
        with reading(self.path, f"the mesh of frame {number}"):
            points, cells = self._read_geometry(number)
        return Frame(
            index=number,
            time=float(self.times[number]),
            kind=int(self.kinds[number]),
            points=points,
            cells=cells,
            point_data=FieldData(self, "PointData", number, len(points)),
            cell_data=FieldData(self, "CellData", number, len(cells)),
        )

    def __iter__(self) -> Iterator[Frame]:
        return (self[index] for index in range(self._count))

    def number(self, index: int) -> int:
        """Frame number from 0 for an index that may be negative; ResultsError if there is no such frame."""
        if self._count == 0:
            raise ResultsError(f"{self.path.name} has no frame yet")
        if not -self._count <= index < self._count:
            raise ResultsError(
                f"{self.path.name} has no frame {index} (frames: 0 to {self._count - 1}, or -1 to "
                f"-{self._count} from the end)"
            )
        return index % self._count

    @property
    def values(self) -> np.ndarray:
        """(frames,) the file's Values: the k-th frame of one time t has t (1 + k 1e-9)."""
        return self._values

    @property
    def times(self) -> np.ndarray:
        """(frames,) time of each frame; frames of one time have equal times."""
        times = self._values.copy()
        for i in range(1, len(times)):
            if abs(self._values[i] - self._values[i - 1]) <= SAME_TIME * abs(self._values[i]):
                times[i] = times[i - 1]
        return times

    @property
    def kinds(self) -> np.ndarray:
        """(frames,) frame_kind, see FRAME_KINDS; -1 where the file does not say."""
        kinds = np.full(self._count, -1, dtype=np.int64)
        if "FieldData/frame_kind" not in self._root:
            return kinds
        with reading(self.path, "frame_kind"):
            stored = self._root["FieldData/frame_kind"][...].reshape(-1)
            if "FieldDataOffsets/frame_kind" in self._steps:
                where = self._steps["FieldDataOffsets/frame_kind"][: self._count].reshape(-1)
            else:
                where = np.arange(self._count)
        known = np.flatnonzero(where[: self._count] < len(stored))
        kinds[known] = stored[where[known]]
        return kinds

    def at_time(self, time: float) -> int:
        """Number of the frame nearest to a time; of several frames of one time the last.

        ResultsError outside the times of the file.
        """
        self.number(0)
        times = self.times
        slack = 1e-6 * max(abs(float(times[0])), abs(float(times[-1])))
        if not times.min() - slack <= time <= times.max() + slack:
            raise ResultsError(
                f"{self.path.name} has no frame near time {time:g} "
                f"(frames: from {times.min():g} to {times.max():g})"
            )
        distance = np.abs(times - time)
        return int(np.flatnonzero(distance == distance.min())[-1])

    def field_names(self, location: str) -> list[str]:
        """Names of the fields of 'PointData' or 'CellData'."""
        with reading(self.path, location):
            return sorted(self._root[location]) if location in self._root else []

    def components(self, location: str, name: str) -> int:
        """Number of components of a field."""
        with reading(self.path, name):
            shape = self._root[f"{location}/{name}"].shape
        return shape[1] if len(shape) > 1 else 1

    def read_field(self, location: str, name: str, index: int, count: int) -> np.ndarray:
        """(count,) or (count, components) values of a field in a frame."""
        offsets = f"{location}Offsets/{name}"
        if offsets not in self._steps:
            raise ResultsError(f"{self.path.name}: Steps/{offsets} is missing, {name} cannot be read")
        with reading(self.path, f"{name} of frame {index}"):
            start = int(self._steps[offsets][index])
            values = self._root[f"{location}/{name}"][start : start + count]
        if values.ndim == 2 and values.shape[1] == 1:
            values = values[:, 0]
        return values

    def close(self) -> None:
        """Close the file; arrays that were read stay."""
        self.file.close()

    def _read_geometry(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Reference coordinates and cells of a frame; frames that share a geometry share the arrays."""
        part = int(self._steps["PartOffsets"][index])
        if self._geometry[0] == part:
            return self._geometry[1], self._geometry[2]
        n_points, n_cells, n_ids = (int(self._root[name][part]) for name in GEOMETRY_COUNTS)
        first_point = int(self._steps["PointOffsets"][index])
        first_cell = int(np.ravel(self._steps["CellOffsets"][index])[0])
        first_id = int(np.ravel(self._steps["ConnectivityIdOffsets"][index])[0])
        points = self._root["Points"][first_point : first_point + n_points, :2].astype(np.float64)
        ids = self._root["Connectivity"][first_id : first_id + n_ids]
        types = np.unique(self._root["Types"][first_cell : first_cell + n_cells])
        width = NODES_OF_CELL.get(int(types[0]), 0) if len(types) == 1 else self._usual_width()
        if len(types) > 1 or n_ids != n_cells * width:
            raise ResultsError(f"{self.path.name}: frame {index} has cells that are no triangles or segments")
        if n_ids and (ids.min() < 0 or ids.max() >= n_points):
            raise ResultsError(f"{self.path.name}: frame {index} has a cell with a node that does not exist")
        self._geometry = (part, points, ids.reshape(n_cells, width).astype(np.int64))
        return self._geometry[1], self._geometry[2]

    def _usual_width(self) -> int:
        """Nodes of a cell where a frame has none: as in the file's other frames, else by the file's name."""
        types = self._root["Types"]
        if types.shape[0]:
            return NODES_OF_CELL.get(int(types[0]), 3)
        return 2 if self.path.stem.endswith("_cracks") else 3

    def _complete_frames(self) -> int:
        """Number of frames of which everything is there (a killed run may have written half of the next)."""
        steps = self._steps
        names = ["Values", "PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets"]
        names += [
            f"{location}Offsets/{name}"
            for location in ("PointData", "CellData")
            for name in self.field_names(location)
            if f"{location}Offsets/{name}" in steps
        ]
        count = min([int(steps.attrs["NSteps"])] + [steps[name].shape[0] for name in names])
        while count > 0 and not self.is_complete(count - 1):
            count -= 1
        return count

    def is_complete(self, index: int) -> bool:
        """Whether the data of a frame reach as far as its offsets say."""
        root, steps = self._root, self._steps
        part = int(steps["PartOffsets"][index])
        if part >= min(root[name].shape[0] for name in GEOMETRY_COUNTS):
            return False
        n_points, n_cells, n_ids = (int(root[name][part]) for name in GEOMETRY_COUNTS)
        first_id = int(np.ravel(steps["ConnectivityIdOffsets"][index])[0])
        if root["Points"].shape[0] < int(steps["PointOffsets"][index]) + n_points:
            return False
        if root["Connectivity"].shape[0] < first_id + n_ids:
            return False
        return all(
            root[f"{location}/{name}"].shape[0] >= int(steps[f"{location}Offsets/{name}"][index]) + count
            for location, count in (("PointData", n_points), ("CellData", n_cells))
            for name in self.field_names(location)
            if f"{location}Offsets/{name}" in steps
        )

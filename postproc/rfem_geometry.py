"""Geometry for drawing a cracked, deformed mesh: outline, both faces of each crack, deformation scale."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rfem_frames import Frame

TARGET_DEFLECTION = 0.05  # drawn displacements as a part of the model's larger side, before rounding
SAME_POINT = 1e-9  # of the model's size: far below any element, far above rounding


def extent(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of points; zeros for none."""
    if len(points) == 0:
        return np.zeros(2), np.zeros(2)
    return points.min(axis=0), points.max(axis=0)


def model_size(points: np.ndarray) -> float:
    """The larger side of the model; 1 for a model without extent."""
    low, high = extent(points)
    return float((high - low).max()) or 1.0


def auto_scale(points: np.ndarray, displacement: np.ndarray) -> float:
    """Factor on displacements, rounded to 1, 2 or 5 times a power of ten.

    The largest displacement drawn comes to about TARGET_DEFLECTION of the model's larger side. Flying debris
    (one node in a hundred, moved five times farther than all others) does not count.
    """
    length = np.hypot(*displacement.T) if len(displacement) else np.zeros(0)
    length = length[np.isfinite(length)]
    largest = float(length.max()) if len(length) else 0.0
    if largest == 0.0:
        return 1.0
    most = float(np.quantile(length, 0.99))
    if 0.0 < most < largest / 5:
        largest = most
    return round_125(TARGET_DEFLECTION * model_size(points) / largest)


def round_125(value: float) -> float:
    """The number 1, 2 or 5 times a power of ten that is nearest to `value` (on a logarithmic scale)."""
    power = 10.0 ** np.floor(np.log10(value))
    candidates = np.array([1.0, 2.0, 5.0, 10.0])
    return float(candidates[np.argmin(abs(np.log(candidates * power / value)))] * power)


def boundary_edges(triangles: np.ndarray) -> np.ndarray:
    """(k, 2) nodes of the edges that belong to one triangle only: the outline and the crack faces."""
    if len(triangles) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    keys = _pair_keys(edges)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    differs = ordered[1:] != ordered[:-1]
    alone = np.concatenate([[True], differs]) & np.concatenate([differs, [True]])
    return edges[np.sort(order[alone])]


def _pair_keys(pairs: np.ndarray) -> np.ndarray:
    """One integer for each unordered pair of numbers below 2^31."""
    return (pairs.min(axis=1).astype(np.int64) << 31) | pairs.max(axis=1).astype(np.int64)


def _places(points: np.ndarray, origin: np.ndarray, size: float) -> np.ndarray:
    """One integer for each place; points with the same coordinates have the same."""
    steps = np.rint((points - origin) / (SAME_POINT * size)).astype(np.int64)
    return (steps[:, 0] << 31) + steps[:, 1]


@dataclass
class Outline:
    """Edges of a frame's mesh that are drawn as lines."""

    free: np.ndarray  #: (k, 2) nodes of outline edges that are no crack
    faces: np.ndarray  #: (c, 2) nodes of crack faces, two for most segments
    segment: np.ndarray  #: (c,) number of the crack segment that a face belongs to


def outline(frame: Frame, cracks: Frame | None) -> Outline:
    """Free edges of the mesh, and the crack faces with the segment each belongs to.

    Crack segments have reference coordinates only; the two faces are the free edges of the mesh that lie
    there, so that each is drawn with its own side's displacement. A segment without free edges (both ends
    are tips) is drawn between the nodes at its ends.
    """
    free = boundary_edges(frame.cells)
    if cracks is None or len(cracks.cells) == 0:
        return Outline(free, np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64))
    origin, size = extent(frame.points)[0], model_size(frame.points)
    crack_places = _places(cracks.points, origin, size)
    names, of_crack = np.unique(crack_places, return_inverse=True)
    segment_keys = _pair_keys(of_crack.reshape(-1)[cracks.cells])
    order = np.argsort(segment_keys, kind="stable")

    edge_places = _places(frame.points[free.reshape(-1)], origin, size)
    number = np.searchsorted(names, edge_places).clip(0, len(names) - 1)
    on_crack = (names[number] == edge_places).reshape(-1, 2).all(axis=1)
    candidates = np.flatnonzero(on_crack)
    keys = _pair_keys(number.reshape(-1, 2)[candidates])
    found = np.searchsorted(segment_keys[order], keys).clip(0, len(order) - 1)
    matches = segment_keys[order][found] == keys
    faces, segment = free[candidates[matches]], order[found[matches]]
    is_free = np.ones(len(free), dtype=bool)
    is_free[candidates[matches]] = False

    missing = np.setdiff1d(np.arange(len(cracks.cells)), segment)
    if len(missing):
        faces = np.concatenate([faces, _nodes_at(frame, cracks, missing, origin, size)])
        segment = np.concatenate([segment, missing])
    return Outline(free[is_free], faces.astype(np.int64), segment.astype(np.int64))


def _nodes_at(
    frame: Frame, cracks: Frame, missing: np.ndarray, origin: np.ndarray, size: float
) -> np.ndarray:
    """(len(missing), 2) nodes of the mesh nearest in place to the ends of some segments."""
    ends = cracks.points[cracks.cells[missing].reshape(-1)]
    places = _places(frame.points, origin, size)
    order = np.argsort(places, kind="stable")
    wanted = _places(ends, origin, size)
    found = order[np.searchsorted(places[order], wanted).clip(0, len(order) - 1)]
    for i in np.flatnonzero(places[found] != wanted):  # not a node of the mesh: take the nearest one
        found[i] = np.argmin(((frame.points - ends[i]) ** 2).sum(axis=1))
    return found.reshape(-1, 2)

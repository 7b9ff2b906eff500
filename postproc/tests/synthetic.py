"""Synthetic result sets in exactly the layout that rfem writes, made with h5py alone."""

from __future__ import annotations

import csv
from pathlib import Path

import h5py
import numpy as np

TRIANGLE, LINE = 5, 3


class VtkhdfWriter:
    """Temporal VTKHDF 2.0 UnstructuredGrid: a geometry is stored once, each frame repeats its offsets."""

    def __init__(self, path, cell_type, point_fields, cell_fields, swmr=False):
        self.file = h5py.File(path, "w", libver=("v110", "v110"))  # as HDF5 1.10 writes
        self.cell_type, self.width = cell_type, 3 if cell_type == TRIANGLE else 2
        root = self.root = self.file.create_group("VTKHDF")
        root.attrs.create("Version", np.array([2, 0], dtype=np.int64))
        root.attrs.create("Type", np.bytes_("UnstructuredGrid"), dtype="S16")
        for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds", "Connectivity", "Offsets"):
            self._create(root, name, np.int64)
        self._create(root, "Types", np.uint8)
        self._create(root, "Points", np.float64, 3)
        steps = self.steps = root.create_group("Steps")
        steps.attrs.create("NSteps", 0, dtype=np.int64)
        self._create(steps, "Values", np.float64)
        for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
            self._create(steps, name, np.int64)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            self._create(steps, name, np.int64, 1)
        for location, fields in (("PointData", point_fields), ("CellData", cell_fields)):
            root.create_group(location)
            steps.create_group(f"{location}Offsets")
            for name, (components, kind) in fields.items():
                self._create(root[location], name, kind, components if components > 1 else 0)
                self._create(steps[f"{location}Offsets"], name, np.int64)
        root.create_group("FieldData")
        self._create(root["FieldData"], "frame_kind", np.int32)
        self._create(steps.create_group("FieldDataOffsets"), "frame_kind", np.int64)
        self._create(steps.create_group("FieldDataSizes"), "frame_kind", np.int64, 2)
        self.n_geometries = 0
        self.offsets = (0, 0, 0, 0)  # part, point, cell, connectivity id of the present geometry
        if swmr:
            self.file.swmr_mode = True

    def _create(self, group, name, kind, components=0):
        shape, limit = ((0, components), (None, components)) if components else ((0,), (None,))
        group.create_dataset(
            name, shape, dtype=kind, maxshape=limit, chunks=(1024, *shape[1:]), compression=4
        )

    def _append(self, dataset, rows):
        rows = np.asarray(rows)
        start = dataset.shape[0]
        dataset.resize(start + len(rows), axis=0)
        if len(rows):
            dataset[start:] = rows
        dataset.flush()
        return start

    def add_geometry(self, points, cells):
        root = self.root
        points = np.column_stack([points, np.zeros(len(points))])
        n_ids = self.width * len(cells)
        part = self._append(root["NumberOfPoints"], [len(points)])
        self._append(root["NumberOfCells"], [len(cells)])
        self._append(root["NumberOfConnectivityIds"], [n_ids])
        point = self._append(root["Points"], points)
        first_id = self._append(root["Connectivity"], np.asarray(cells, dtype=np.int64).reshape(-1))
        self._append(root["Offsets"], self.width * np.arange(len(cells) + 1))
        cell = self._append(root["Types"], np.full(len(cells), self.cell_type, dtype=np.uint8))
        self.offsets = (part, point, cell, first_id)

    def add_frame(self, value, kind, point_data, cell_data):
        steps = self.steps
        for location, data in (("PointData", point_data), ("CellData", cell_data)):
            for name, values in data.items():
                start = self._append(self.root[location][name], values)
                self._append(steps[f"{location}Offsets"][name], [start])
        start = self._append(self.root["FieldData/frame_kind"], [kind])
        self._append(steps["FieldDataOffsets/frame_kind"], [start])
        self._append(steps["FieldDataSizes/frame_kind"], [[1, 1]])
        part, point, cell, first_id = self.offsets
        self._append(steps["Values"], [value])
        self._append(steps["PartOffsets"], [part])
        self._append(steps["NumberOfParts"], [1])
        self._append(steps["PointOffsets"], [point])
        self._append(steps["CellOffsets"], [[cell]])
        self._append(steps["ConnectivityIdOffsets"], [[first_id]])
        steps.attrs.modify("NSteps", np.int64(len(steps["Values"])))
        self.file.flush()

    def close(self):
        self.file.close()


POINT_FIELDS = {
    "displacement": (3, np.float32),
    "reaction": (3, np.float32),
    "stress": (6, np.float32),
    "sigma1": (1, np.float32),
    "sigma3": (1, np.float32),
    "utilisation": (1, np.float32),
    "node_id": (1, np.int32),
    "node_origin": (1, np.int32),
}
CELL_FIELDS = {
    "stress": (6, np.float32),
    "material": (1, np.int32),
    "element_id": (1, np.int32),
    "element_origin": (1, np.int32),
    "split_level": (1, np.int32),
    "fragment": (1, np.int32),
    "strength_factor": (1, np.float32),
}
CRACK_FIELDS = {
    "opening": (1, np.float32),
    "slip": (1, np.float32),
    "shear_traction": (1, np.float32),
    "normal_traction": (1, np.float32),
    "state": (1, np.int32),
    "mode": (1, np.int32),
    "event": (1, np.int32),
}
DECK = """*HEADING
Three-point bending beam (synthetic)
units: mm, N, MPa
** a comment
*NODE
1, 0., 0.
"""


def lattice(length, height, nx, ny, jitter=0.15, seed=1):
    """Near-equilateral lattice of triangles with jittered inner nodes, and its node grid."""
    random = np.random.default_rng(seed)
    hx, hy = length / nx, height / ny
    points, rows = [], []
    for j in range(ny + 1):
        x = np.linspace(0, length, nx + 1)
        if j % 2:
            x = np.concatenate([[0], (x[:-1] + x[1:]) / 2, [length]])
        rows.append(np.arange(len(x)) + sum(len(row) for row in rows))
        row = np.column_stack([x, np.full(len(x), j * hy)])
        if 0 < j < ny:
            row[1:-1] += jitter * np.array([hx, hy]) * random.uniform(-1, 1, (len(x) - 2, 2))
        points.append(row)
    triangles = []
    for j in range(ny):
        low, high = rows[j], rows[j + 1]
        a = b = 0
        xs = np.vstack(points)[:, 0]
        while a < len(low) - 1 or b < len(high) - 1:
            if b == len(high) - 1 or (a < len(low) - 1 and xs[low[a + 1]] <= xs[high[b + 1]]):
                triangles.append((low[a], low[a + 1], high[b]))
                a += 1
            else:
                triangles.append((low[a], high[b + 1], high[b]))
                b += 1
    return np.vstack(points), np.array(triangles)


def crack_path(points, triangles, x_start, y_end):
    """Nodes of a path of mesh edges from the bottom up to a height."""
    neighbours = {}
    for a, b, c in triangles:
        for p, q in ((a, b), (b, c), (c, a)):
            neighbours.setdefault(p, set()).add(q)
            neighbours.setdefault(q, set()).add(p)
    bottom = np.flatnonzero(points[:, 1] == 0)
    path = [int(bottom[np.argmin(abs(points[bottom, 0] - x_start))])]
    while points[path[-1], 1] < y_end:
        up = [q for q in neighbours[path[-1]] if points[q, 1] > points[path[-1], 1] + 1e-9]
        path.append(int(min(up, key=lambda q: abs(points[q, 0] - x_start))))
    return path


def split(points, triangles, path, n_segments):
    """Open the first segments of the path: nodes of all but its tip get a copy on the right."""
    triangles = triangles.copy()
    if n_segments == 0:
        return points, triangles, np.zeros(0, dtype=int)
    nodes = path[:n_segments]
    copies = {node: len(points) + i for i, node in enumerate(nodes)}
    line = points[path]
    centroids = points[triangles].mean(axis=1)
    right = centroids[:, 0] > np.interp(centroids[:, 1], line[:, 1], line[:, 0])
    for node, copy in copies.items():
        triangles[right[:, None] & (triangles == node)] = copy
    return np.vstack([points, points[nodes]]), triangles, np.array(nodes)


def beam_fields(points, triangles, height, length, line, n_segments, deflection, copies):
    """Displacement and stress that look like a bent beam whose crack is the first segments of `line`."""
    x, y = points.T
    middle = length / 2
    tip = line[n_segments, 1] if n_segments else 0.0
    side = np.where(x > np.interp(y, line[:, 1], line[:, 0]) + 1e-6, 1.0, -1.0)  # the path itself: left
    side[copies] = 1.0
    share = tip / height
    slope = deflection / (length / 2)
    smooth = np.where(y >= tip, np.tanh((x - middle) / (4 + 1.5 * (y - tip) + 40 * (1 - share))), side)
    if n_segments == 0:
        smooth = (x - middle) / (length / 2)
    else:  # near the tip the faces close
        near = np.clip((tip - y) / 25, 0, 1)
        gentle = np.tanh((x - middle) / (4 + 40 * (1 - share)))
        smooth = np.where(y < tip, near * side + (1 - near) * gentle, smooth)
    u = np.zeros((len(x), 3))
    u[:, 0] = -slope * smooth * (y - max(tip, height / 2 * (1 - share)))
    u[:, 1] = -deflection * (1 - abs(x - middle) / (length / 2))
    moment = (1 - share) ** 2 * deflection / 0.02 * np.clip(1 - abs(x - middle) / 150, 0, 1)
    stress = np.zeros((len(x), 6))
    neutral = (tip + height) / 2
    stress[:, 0] = -9 * moment * (y - neutral) / (height / 2)
    radius = np.hypot(x - middle, y - tip) + 3
    angle = np.arctan2(y - tip, x - middle)
    if tip > 0:
        near = 2.5 * np.sqrt(12 / radius) * np.exp(-radius / 40)
        stress[:, 0] += near * (1 + np.sin(angle))
        stress[:, 1] += near * (1 + 0.3 * np.cos(2 * angle))
        stress[:, 3] += 0.5 * near * np.cos(angle)
        shadow = (y < tip) & (abs(x - middle) < 40)
        stress[shadow, 0] *= abs(x[shadow] - middle) / 40
        stress[:, 0] *= np.where(y > tip, 1 - 1.6 * (y - tip) / (height - tip), 1)
    element_stress = stress[triangles].mean(axis=1)
    return u, stress, element_stress


def write_beam(
    directory, job="beam", nx=60, ny=15, deflection=0.02, deck=DECK, swmr=False, close=True, shear=3
):
    """A beam 400 x 100: start, intact, then a crack that grows at one load. Returns the writers."""
    directory = Path(directory)
    length, height = 400.0, 100.0
    points, triangles = lattice(length, height, nx, ny)
    path = crack_path(points, triangles, length / 2, 0.75 * height)
    n_path = len(path) - 1
    mesh = VtkhdfWriter(directory / f"{job}.vtkhdf", TRIANGLE, POINT_FIELDS, CELL_FIELDS, swmr)
    crack = VtkhdfWriter(directory / f"{job}_cracks.vtkhdf", LINE, {}, CRACK_FIELDS, swmr)
    counts = [0, 0, *np.unique(np.linspace(2, n_path, 4).astype(int)), n_path]
    times = [0.0, 0.5, *[0.5 * (1 + k * 1e-9) for k in range(1, len(counts) - 2)], 1.0]
    kinds = [0, 1, *[2] * (len(counts) - 4), 3, 3]
    previous = -1
    for count, time, kind in zip(counts, times, kinds):
        x, cells, nodes = split(points, triangles, path, count)
        if count != previous:
            mesh.add_geometry(x, cells)
            crack.add_geometry(points[path[: count + 1]] if count else np.zeros((0, 2)), _segments(count))
        previous = count
        copies = np.arange(len(points), len(x))
        factor = min(1.0, time * 2) if time < 0.9 else 1.6
        u, stress, element_stress = beam_fields(
            x, cells, height, length, points[path], count, deflection * factor, copies
        )
        s1, s3 = _principal(stress)
        utilisation = np.maximum(-s3 / 4.5, ((s1 - s3) / 2) / np.maximum(8.66 + 0.25 * (s1 + s3), 1))
        reaction = np.zeros_like(u)
        reaction[(x[:, 1] == 0) & (abs(x[:, 0] - 50) < 4), 1] = 50.0 * factor
        mesh.add_frame(
            time,
            kind,
            {
                "displacement": u,
                "reaction": reaction,
                "stress": stress,
                "sigma1": s1,
                "sigma3": s3,
                "utilisation": utilisation,
                "node_id": np.arange(1, len(x) + 1),
                "node_origin": np.concatenate([np.arange(1, len(points) + 1), nodes + 1]),
            },
            {
                "stress": element_stress,
                "material": np.where(abs(cells.mean(axis=1) - len(x) / 2) < 0.02 * len(x), 2, 1),
                "element_id": np.arange(1, len(cells) + 1),
                "element_origin": np.arange(1, len(cells) + 1),
                "split_level": np.isin(cells, path).sum(axis=1).clip(0, 2),
                "fragment": np.ones(len(cells), dtype=int),
                "strength_factor": 1 + 0.02 * np.random.default_rng(2).standard_normal(len(cells)),
            },
        )
        mode = np.ones(count, dtype=int)
        mode[max(0, count - shear) :] = 2 if count > shear else 1
        mode[:1] = 0
        crack.add_frame(
            time,
            kind,
            {},
            {
                "opening": np.linspace(0.01, 0.001, count) if count else [],
                "slip": np.linspace(-1e-3, 1e-3, count) if count else [],
                "shear_traction": np.zeros(count),
                "normal_traction": -np.linspace(0, 1, count) if count else [],
                "state": np.arange(count) % 3,
                "mode": mode,
                "event": np.arange(count),
            },
        )
    if close:
        mesh.close()
        crack.close()
    write_tables(directory, job, deflection=deflection, deck=deck)
    return mesh, crack


def _segments(count):
    return np.column_stack([np.arange(count), np.arange(1, count + 1)])


def _principal(stress):
    mean = -(stress[:, 0] + stress[:, 1]) / 2
    radius = np.hypot((stress[:, 0] - stress[:, 1]) / 2, stress[:, 3])
    return mean + radius, mean - radius


HISTORY = (
    "step,increment,time,load_factor,event_count,iterations,residual,converged,nodes,elements,cracks,crack_length,"
    "fragments,exhausted,exhausted_utilisation,contacts_open,contacts_slip,contacts_stick,events_tension,"
    "events_shear,max_utilisation,external_work,strain_energy,kinetic_energy,friction_work,softening_work,"
    "released_energy,damping_work,energy_error"
).split(",")
INTEGERS = set(
    "step,increment,event_count,iterations,converged,nodes,elements,cracks,fragments,exhausted,contacts_open,"
    "contacts_slip,contacts_stick,events_tension,events_shear".split(",")
)


def history_rows(deflection=0.02, peak=106.2, n=20):
    """Load rises to the peak at half the deflection, drops at fixed displacement, falls on slowly."""
    rows = []
    for i in range(n + 1):
        states = [(i, 0)] if i != n // 2 else [(i, 0), (i, 12)]
        for increment, new_events in states:
            row = dict.fromkeys(HISTORY, 0)
            broken = new_events or i > n // 2
            u = -deflection * i / n
            force = -peak * i / (n // 2) if not broken else -0.15 * peak * (1 - 0.5 * (i - n // 2) / n)
            row.update(step=1, increment=increment, time=i / n, load_factor=i / n, converged=int(i != n - 2))
            row.update(
                event_count=12 if broken else 0, iterations=700 + i, residual=8e-7, nodes=900, elements=1700
            )
            row.update(max_utilisation=abs(force) / peak, external_work=abs(u * force) / 2, fragments=1)
            row.update(crack_length=75.0 if broken else 0.0, cracks=int(bool(broken)))
            row.update(PLATEN_u1=0.0, PLATEN_u2=u, PLATEN_rf1=1e-9, PLATEN_rf2=force)
            row.update(CMOD_u1=0.2 * abs(u), CMOD_u2=0.0, CMOD_rf1=0.0, CMOD_rf2=0.0)
            row.update(MID_f1=0.0, MID_f2=0.0, MID_m=50 * force, MID_error=1.8e-5)
            rows.append(row)
    return rows


def event_rows(n=12):
    return [
        {
            "event": i + 1,
            "step": 1,
            "increment": 10,
            "time": 0.5,
            "load_factor": 0.5,
            "node": 30 + i,
            "x": 200.0,
            "y": 6.0 * i,
            "mode": "tension" if i < 9 else "shear",
            "sigma1": 0.1,
            "sigma3": -4.6,
            "utilisation": 1.02,
            "direction_deg": 90.0,
            "element": 100 + i,
            "type": ("edge", "I", "II", "III")[i % 4],
            "new_nodes": 2,
            "new_elements": 2,
            "released_energy": 1e-3,
            "iterations": 2000,
            "PLATEN_rf1": 0.0,
            "PLATEN_rf2": -106.0 + 7 * i,
            "CMOD_rf1": 0.0,
            "CMOD_rf2": 0.0,
        }
        for i in range(n)
    ]


def write_tables(
    directory, job, deflection=0.02, deck=DECK, h5=True, csv_files=True, monitors=True, peak=106.2
):
    """JOB.h5 with history, events and provenance, and the two CSV tables."""
    directory = Path(directory)
    tables = {"history": history_rows(deflection, peak), "events": event_rows()}
    if not monitors:
        for rows in tables.values():
            for row in rows:
                for name in [n for n in row if n.startswith(("PLATEN", "CMOD"))]:
                    del row[name]
    if csv_files:
        for title, rows in tables.items():
            with (directory / f"{job}_{title}.csv").open("w", newline="\n", encoding="utf-8") as stream:
                writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows)
    if not h5:
        return
    with h5py.File(directory / f"{job}.h5", "w", libver=("v110", "v110")) as file:
        group = file.create_group("rfem")
        group.attrs["version"] = "0.1.0"
        group.attrs["threads"] = 2
        group.create_dataset("deck", data=deck)
        for title, rows in tables.items():
            table = group.create_group(title)
            for name in rows[0]:
                values = [row[name] for row in rows]
                if isinstance(values[0], str):
                    table.create_dataset(name, data=np.array(values, dtype="S8"))
                else:
                    kind = np.int64 if name in INTEGERS else np.float64
                    table.create_dataset(name, data=np.array(values, dtype=kind), maxshape=(None,))

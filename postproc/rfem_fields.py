"""What the numbers of a result set mean: fields, their components and signs, history columns, and units.

Units are not stored with the numbers: rfem takes any consistent set. A deck states its own in a heading line

    *HEADING
    Three-point bending of a notched beam
    units: mm, N, MPa

that is length, force, stress, and, if time is real time, a fourth. Labels carry units only where it does.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rfem_frames import Frame
from rfem_io import ResultsError, nearest
from rfem_results import heading_lines

# --- units -----------------------------------------------------------------------------------------------

UNIT_KINDS = ("length", "force", "stress", "time")
KNOWN_UNITS = {
    "length": "m dm cm mm um µm km in ft".split(" "),
    "force": "N kN MN GN mN kgf lbf kip".split(" "),
    "stress": "Pa hPa kPa MPa GPa bar psi ksi psf".split(" "),
    "time": "s ms us µs min h d a".split(" "),
}
ENERGY_NAMES = {("N", "m"): "J", ("kN", "m"): "kJ", ("MN", "m"): "MJ"}


@dataclass(frozen=True)
class Units:
    """Unit of each kind of quantity, as the deck's heading states it; empty text where it does not."""

    length: str = ""
    force: str = ""
    stress: str = ""
    time: str = ""

    def of(self, kind: str) -> str:
        """Unit of one of UNIT_KINDS, of 'energy', 'moment', 'velocity'; empty for any other kind."""
        if kind in ("energy", "moment"):
            if not (self.force and self.length):
                return ""
            product = f"{self.force} {self.length}"
            return ENERGY_NAMES.get((self.force, self.length), product) if kind == "energy" else product
        if kind == "velocity":
            return f"{self.length}/{self.time}" if self.length and self.time else ""
        return getattr(self, kind) if kind in UNIT_KINDS else ""

    def label(self, text: str, kind: str) -> str:
        """`text` with the unit in parentheses where there is one."""
        return f"{text} ({self.of(kind)})" if self.of(kind) else text


def parse_units(deck: str) -> Units:
    """Units from the deck's heading; a `Units` of empty texts where no heading line states them.

    The line is `units: LENGTH, FORCE, STRESS[, TIME]`. A known unit is recognised wherever it stands; others
    take the first place that is free.
    """
    for line in heading_lines(deck):
        match = re.search(r"\bunits?\s*[:=]\s*([^;]+)", line, re.IGNORECASE)
        if not match:
            continue
        words = [word.strip().rstrip(".") for word in re.split(r"[,\s]+", match.group(1)) if word.strip(" .")]
        found: dict[str, str] = {}
        for word in words:
            kind = next((kind for kind in UNIT_KINDS if word in KNOWN_UNITS[kind]), None)
            if kind is not None:
                found.setdefault(kind, word)
        for word in words:
            if not any(word in KNOWN_UNITS[kind] for kind in UNIT_KINDS):
                free = next((kind for kind in UNIT_KINDS if kind not in found), None)
                if free is not None:
                    found[free] = word
        return Units(**found)
    return Units()


# --- fields ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FieldInfo:
    """What a field is: its words, kind of unit, sign convention, and how it wants to be coloured."""

    label: str
    unit: str = ""  #: kind of unit, see Units.of
    sign: str = ""  #: sign convention, in words
    scale: str = (
        "signed"  #: 'signed' (diverging, zero in the middle), 'positive' (from 0), 'plain', 'category'
    )
    names: tuple[tuple[int, str], ...] = ()  #: words for the values of a category

    def title(self, units: Units) -> str:
        """Label with sign convention and unit, for a colour bar."""
        return units.label(f"{self.label}, {self.sign}" if self.sign else self.label, self.unit)


TENSION, COMPRESSION = "tension positive", "compression positive"
FIELDS = {
    # point data
    "displacement": FieldInfo("displacement", "length", scale="positive"),
    "velocity": FieldInfo("velocity", "velocity", scale="positive"),
    "reaction": FieldInfo("reaction on the body", "force", scale="positive"),
    "stress": FieldInfo("stress", "stress", TENSION),
    "sigma1": FieldInfo(r"major principal stress $\sigma_1$", "stress", COMPRESSION),
    "sigma3": FieldInfo(r"minor principal stress $\sigma_3$", "stress", COMPRESSION),
    "tau_max": FieldInfo(r"shear stress $(\sigma_1 - \sigma_3)/2$", "stress", scale="positive"),
    "utilisation": FieldInfo("utilisation $F$", sign="fails at 1", scale="positive"),
    "node_id": FieldInfo("node", scale="plain"),
    "node_origin": FieldInfo("node it is a copy of", sign="0: none", scale="plain"),
    # cell data
    "material": FieldInfo("material", scale="category"),
    "element_id": FieldInfo("element", scale="plain"),
    "element_origin": FieldInfo("element it is a part of", scale="plain"),
    "split_level": FieldInfo("split level", scale="category"),
    "fragment": FieldInfo("fragment", scale="category"),
    "strength_factor": FieldInfo("strength factor", scale="plain"),
    # crack segments
    "opening": FieldInfo("crack opening", "length", scale="positive"),
    "slip": FieldInfo("crack slip", "length", "second side against first"),
    "shear_traction": FieldInfo("shear traction on the crack", "stress", "on the second side"),
    "normal_traction": FieldInfo("normal traction on the crack", "stress", TENSION),
    "state": FieldInfo("crack state", scale="category", names=((0, "open"), (1, "slip"), (2, "stick"))),
    "mode": FieldInfo(
        "crack mode", scale="category", names=((1, "tension"), (2, "shear"), (0, "pre-existing"))
    ),
    "event": FieldInfo("event", scale="plain"),
}
LOCATIONS = ("node", "element", "crack")  # as a prefix: element:stress_xx
VECTOR_COMPONENTS = {"x": 0, "y": 1}
TENSOR_COMPONENTS = {"xx": 0, "yy": 1, "zz": 2, "xy": 3}
PRINCIPAL = ("sigma1", "sigma3", "tau_max")  # made from the stress where the file does not have them


@dataclass
class FieldValues:
    """One scalar field of one frame, ready to be drawn."""

    name: str  #: as the user would type it, with its prefix where it needs one
    location: str  #: 'node', 'element' or 'crack'
    values: np.ndarray  #: (nodes,), (elements,) or (segments,)
    info: FieldInfo


def principal_stresses(stress: np.ndarray) -> dict[str, np.ndarray]:
    """In-plane principal stresses, compression positive, sigma1 >= sigma3, of (n, 6) XX YY ZZ XY YZ XZ."""
    stress = stress.astype(np.float64)
    mean = -(stress[:, 0] + stress[:, 1]) / 2
    radius = np.hypot((stress[:, 0] - stress[:, 1]) / 2, stress[:, 3])
    return {"sigma1": mean + radius, "sigma3": mean - radius, "tau_max": radius}


def field_names(frame: Frame, cracks: Frame | None) -> list[str]:
    """All names that `field_values` takes for a frame, in the order node, element, crack."""
    seen: set[str] = set()
    names = []
    for location, frame_of, data in _places(frame, cracks):
        del frame_of
        for base in _names_of(data):
            names.append(base if base not in seen else f"{location}:{base}")
            seen.add(base)
    return names


def field_values(frame: Frame, cracks: Frame | None, name: str) -> FieldValues:
    """The scalar field of a name such as utilisation, stress_xx, element:stress_xx, displacement_y, opening.

    A name that both nodes and elements have means the nodes'. ResultsError lists the names there are.
    """
    prefix, _, base = name.rpartition(":")
    for location, _, data in _places(frame, cracks):
        if prefix not in ("", location):
            continue
        match = next((known for known in _names_of(data) if known.lower() == base.lower()), None)
        if match is not None:
            values, info = _evaluate(data, match, location)
            return FieldValues(name if not prefix else f"{location}:{match}", location, values, info)
    allowed = field_names(frame, cracks)
    if base.lower() == "stress":
        raise ResultsError(
            f"stress has several components: say which ({', '.join(n for n in allowed if 'stress_' in n)}; "
            "or sigma1, sigma3, tau_max)"
        )
    if base.lower() in FIELDS and cracks is None and base.lower() in CRACK_FIELDS:
        raise ResultsError(
            f"no field {name} in frame {frame.index}: it has no crack (fields: {', '.join(allowed)})"
        )
    raise ResultsError(f"no field {name}{nearest(name, allowed)} (fields: {', '.join(allowed)})")


CRACK_FIELDS = ("opening", "slip", "shear_traction", "normal_traction", "state", "mode", "event")


def _places(frame: Frame, cracks: Frame | None) -> Iterator[tuple[str, Frame, object]]:
    yield "node", frame, frame.point_data
    yield "element", frame, frame.cell_data
    if cracks is not None:
        yield "crack", cracks, cracks.cell_data


def _names_of(data) -> list[str]:  # noqa: ANN001
    """Scalar names of one kind of data: components of tensors, magnitude and components of vectors."""
    names = []
    for name in data:
        components = data.components(name)
        if components == 6:
            names += [f"{name}_{suffix}" for suffix in TENSOR_COMPONENTS]
        else:
            names.append(name)
            if components == 3:
                names += [f"{name}_{suffix}" for suffix in VECTOR_COMPONENTS]
    if "stress" in data:
        names += [name for name in PRINCIPAL if name not in data]
    return names


def _evaluate(data, name: str, location: str) -> tuple[np.ndarray, FieldInfo]:  # noqa: ANN001
    """Values and description of a scalar name that `_names_of` has listed."""
    element = "element " if location == "element" and name.startswith(("stress", *PRINCIPAL)) else ""
    if name in data and data.components(name) == 1:
        info = FIELDS.get(name, FieldInfo(name.replace("_", " "), scale="plain"))
        return data[name], _with_label(info, element + info.label)
    if name in PRINCIPAL:
        info = FIELDS[name]
        return principal_stresses(data["stress"])[name], _with_label(info, element + info.label)
    if name in data:
        info = FIELDS.get(name, FieldInfo(name.replace("_", " "), scale="positive"))
        return np.linalg.norm(data[name].astype(np.float64), axis=1), info
    base, _, suffix = name.rpartition("_")
    info = FIELDS.get(base, FieldInfo(base.replace("_", " ")))
    if suffix in TENSOR_COMPONENTS:
        label = (
            rf"{element}{info.label} $\sigma_{{{suffix}}}$" if base == "stress" else f"{info.label} {suffix}"
        )
        return data[base][:, TENSOR_COMPONENTS[suffix]], _with_label(info, label, scale="signed")
    label = rf"{info.label}, ${suffix}$ component"
    return data[base][:, VECTOR_COMPONENTS[suffix]], _with_label(info, label, scale="signed")


def _with_label(info: FieldInfo, label: str, scale: str = "") -> FieldInfo:
    return FieldInfo(label, info.unit, info.sign, scale or info.scale, info.names)


# --- history columns -------------------------------------------------------------------------------------

COLUMN_UNITS = {"time": "time", "crack_length": "length", "x": "length", "y": "length"}
COLUMN_UNITS.update(
    dict.fromkeys(
        (
            "external_work",
            "strain_energy",
            "kinetic_energy",
            "friction_work",
            "softening_work",
            "released_energy",
            "damping_work",
        ),
        "energy",
    )
)
COLUMN_WORDS = {
    "cracks": "connected cracks",
    "exhausted": "exhausted nodes",
    "event_count": "events",
    "max_utilisation": "largest utilisation $F$",
    "exhausted_utilisation": "largest utilisation $F$ of exhausted nodes",
    "energy_error": "energy error, relative",
    "residual": "residual, relative",
    "events_tension": "events in tension",
    "events_shear": "events in shear",
    "contacts_open": "open contacts",
    "contacts_slip": "slipping contacts",
    "contacts_stick": "sticking contacts",
}
SUFFIX_WORDS = {  # column suffix -> words before and after the name, kind of unit
    "_rf1": ("reaction", "$x$", "force"),
    "_rf2": ("reaction", "$y$", "force"),
    "_u1": ("displacement", "$x$", "length"),
    "_u2": ("displacement", "$y$", "length"),
    "_f1": ("section force", "$x$", "force"),
    "_f2": ("section force", "$y$", "force"),
    "_m": ("section moment", "", "moment"),
    "_error": ("section balance error", "", ""),
}


def column_label(name: str, units: Units, own_names: list[str], negative: bool = False) -> str:
    """Axis label of a history column. `own_names`: names of monitors and section checks."""
    minus = "\u2212" if negative else ""
    for suffix, (words, direction, kind) in SUFFIX_WORDS.items():
        if name.endswith(suffix) and name[: -len(suffix)] in own_names:
            quantity = f"{minus}{words} in {direction}" if direction else f"{minus}{words}"
            return units.label(f"{quantity}, {name[: -len(suffix)]}", kind)
    words = COLUMN_WORDS.get(name, name.replace("_", " "))
    return units.label(minus + words, COLUMN_UNITS.get(name, ""))

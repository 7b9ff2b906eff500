"""Figures of the mesh: deformed, with cracks and fields, of one frame or as an animation.

The functions return matplotlib figures and never open a window, so that a script can go on from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation
from PIL import Image

from rfem_fields import FieldValues, Units, field_names, field_values, parse_units
from rfem_frames import CRACK_MODES, Frame
from rfem_geometry import auto_scale, extent, model_size, outline
from rfem_results import Results
from rfem_style import STYLE, number_text, writing

MESH_LINES_UP_TO = 20_000  # elements; above, mesh lines would cover the field
CHARACTERS_PER_INCH = 13  # of a title, about
VECTOR_UP_TO = 5_000  # elements; above, PDF and SVG hold the mesh as an image (text and cracks stay lines)
MODE_COLORS = {1: "#D55E00", 2: "#0072B2", 0: "#000000"}  # Okabe and Ito: told apart by the colour-blind
CATEGORY_COLORS = (
    "#E3DCCB",
    "#56B4E9",
    "#E69F00",
    "#009E73",
    "#CC79A7",
    "#F0E442",
    "#999999",
    "#0072B2",
    "#D55E00",
)
STATE_COLORS = ("#009E73", "#D55E00", "#0072B2")  # open, slip, stick
BODY_COLOR, MESH_COLOR, OUTLINE_COLOR, UNDEFORMED_COLOR = "#ECE7DB", "#9A958A", "#3A3A3A", "#B4B4B4"
FAR_FROM_ZERO = 0.3  # smallest part of largest value from which a field of one sign has its own range
SIGNED_MAP, POSITIVE_MAP = "RdBu_r", "viridis"


@dataclass
class MeshOptions:
    """What a picture of the mesh shows."""

    field: str = ""  #: name of a field, see rfem_fields.field_values; empty: the mesh alone
    frame: int = -1  #: number of the frame; negative from the end
    scale: float | None = None  #: factor on displacements; None: chosen by auto_scale


@dataclass
class View:
    """One frame as it is to be drawn."""

    job: str
    frame: Frame
    n_frames: int
    cracks: Frame | None
    units: Units
    scale: float
    values: FieldValues | None = None
    drawn: np.ndarray = field(init=False)  #: (n, 2) deformed coordinates

    def __post_init__(self) -> None:
        self.drawn = self.frame.points + self.scale * self.frame.displacement


def make_view(results: Results, options: MeshOptions, scale: float | None = None) -> View:
    """Read what a picture of one frame needs. `scale` stands in for an automatic one."""
    frames = results.frames
    frame = frames[options.frame]
    cracks = results.crack_frame(frame.index)
    values = field_values(frame, cracks, options.field) if options.field else None
    if options.scale is not None:
        scale = options.scale
    elif scale is None:
        scale = auto_scale(frame.points, frame.displacement)
    return View(results.job, frame, len(frames), cracks, parse_units(results.deck), scale, values)


def common_scale(views: Sequence[View]) -> float:
    """The scale that fits all views: the smallest of those that moved."""
    return min([view.scale for view in views if np.any(view.frame.displacement)], default=views[0].scale)


def names_of_fields(results: Results, index: int) -> list[str]:
    """Names of the fields that a frame can be coloured by."""
    frame = results.frames[index]
    return field_names(frame, results.crack_frame(frame.index))


# --- the mesh --------------------------------------------------------------------------------------------


def mesh_figure(views: Sequence[View]) -> Figure:
    """Deformed mesh with cracks coloured by mode, and a field with its colour bar, of one or more views.

    Several views (a comparison) have one colour range, so that equal colours are equal values.
    """
    with mpl.rc_context(STYLE):
        coloring = Coloring.of([view.values for view in views if view.values is not None])
        window = _window(views)
        figure, axes, room = _mesh_axes(len(views), window, coloring is not None)
        for ax, view in zip(axes, views):
            _draw_view(ax, view, coloring, window)
            ax.set_title(_mesh_title(view, room), loc="left")
        if coloring is not None:
            _color_bar(figure, axes, coloring, views[0].units, _is_wide(window))
        _crack_legend(figure, views)
        return figure


def _window(views: Sequence[View]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what is drawn, with a margin. Debris far from the model is left outside."""
    low, high = extent(np.concatenate([np.stack(extent(view.drawn)) for view in views]))
    reference = np.concatenate([np.stack(extent(view.frame.points)) for view in views])
    size = model_size(reference)
    low = np.maximum(np.minimum(low, reference.min(axis=0)), reference.min(axis=0) - 0.3 * size)
    high = np.minimum(np.maximum(high, reference.max(axis=0)), reference.max(axis=0) + 0.3 * size)
    return low - 0.02 * size, high + 0.02 * size


def _is_wide(window: tuple[np.ndarray, np.ndarray]) -> bool:
    width, height = window[1] - window[0]
    return width > 1.3 * height


def _mesh_axes(n: int, window: tuple[np.ndarray, np.ndarray], bar: bool) -> tuple[Figure, list[Axes], int]:
    """Figure of a size that suits the model's shape: wide models above each other, others side by
    side.

    Also returned: how many characters of a title have room above one model.
    """
    width, height = window[1] - window[0]
    wide = _is_wide(window)
    largest = (6.3, 5.0) if wide else (4.6, 5.2)
    scale = min(largest[0] / width, largest[1] / height)
    axis = np.array([width, height]) * scale
    rows, columns = (n, 1) if wide else (1, n)
    margin = (0.85, 0.95 + (0.75 if bar else 0.0)) if wide else (0.95 + (0.95 if bar else 0.0), 0.95)
    size = (max(columns * (axis[0] + 0.55) + margin[0] - 0.4, 4.4), rows * (axis[1] + 0.75) + margin[1] - 0.4)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    room = (axis[0] + size[0] / columns) / 2 - (0.5 if bar and not wide else 0.0)
    return figure, list(axes.reshape(-1)), int(CHARACTERS_PER_INCH * room)


def _draw_view(
    ax: Axes, view: View, coloring: Coloring | None, window: tuple[np.ndarray, np.ndarray]
) -> None:
    frame = view.frame
    edges = outline(frame, view.cracks)
    if view.scale and np.any(frame.displacement):
        _add_lines(ax, frame.points[edges.free], UNDEFORMED_COLOR, 0.6, zorder=1)
    _draw_body(ax, view, coloring)
    _add_lines(ax, view.drawn[edges.free], OUTLINE_COLOR, 0.6, zorder=3)
    if view.cracks is not None and len(edges.faces):
        _draw_cracks(ax, view, edges.faces, edges.segment, coloring)
    ax.set_aspect("equal")
    ax.set_xlim(window[0][0], window[1][0])
    ax.set_ylim(window[0][1], window[1][1])
    ax.set_xlabel(view.units.label("$x$", "length"))
    ax.set_ylabel(view.units.label("$y$", "length"))
    ax.label_outer()


def _draw_body(ax: Axes, view: View, coloring: Coloring | None) -> None:
    """Triangles: in one colour, in the colours of a field of elements, or shaded between nodes."""
    triangles, values = view.frame.cells, view.values
    few = len(triangles) <= MESH_LINES_UP_TO
    location = values.location if values is not None and coloring is not None else ""
    if location == "node":
        finite = np.isfinite(values.values)
        triangles = triangles[finite[triangles].all(axis=1)]
        _add_shades(ax, view.drawn, triangles, np.where(finite, values.values, 0.0), coloring)
    elif location == "element":
        finite = np.isfinite(values.values)
        triangles = triangles[finite]
        corners = np.arange(3 * len(triangles)).reshape(-1, 3)  # each triangle with corners of its own: flat
        shades = np.repeat(values.values[finite], 3)
        _add_shades(ax, view.drawn[triangles.reshape(-1)], corners, shades, coloring)
    elif not few:
        uniform = Coloring(ListedColormap([BODY_COLOR]), Normalize(0, 1), "neither", [])
        _add_shades(ax, view.drawn, triangles, np.zeros(len(view.drawn)), uniform)
    if few:
        width = 0.25 if len(triangles) < 5000 else 0.12
        raster = len(triangles) > VECTOR_UP_TO
        mesh = PolyCollection(view.drawn[triangles], linewidths=width, rasterized=raster, zorder=2.5)
        mesh.set(facecolors="none" if location in ("node", "element") else BODY_COLOR)
        mesh.set(edgecolors=(*to_rgb(MESH_COLOR), 0.4 if location in ("node", "element") else 1.0))
        ax.add_collection(mesh, autolim=False)


def _add_shades(
    ax: Axes, points: np.ndarray, triangles: np.ndarray, values: np.ndarray, coloring: Coloring
) -> None:
    """Triangles shaded between their corners; an image in PDF and SVG, seamless, fast for millions."""
    if len(triangles) == 0:
        return
    mesh = TriMesh(Triangulation(*points.T, triangles), rasterized=True, zorder=2)
    mesh.set_array(np.asarray(values, dtype=np.float64))
    mesh.set(cmap=coloring.cmap, norm=coloring.norm)
    ax.add_collection(mesh, autolim=False)


def _add_lines(ax: Axes, lines: np.ndarray, color: str, width: float, zorder: float) -> None:
    collection = LineCollection(lines, colors=color, linewidths=width, zorder=zorder, capstyle="round")
    collection.set_rasterized(len(lines) > VECTOR_UP_TO)
    ax.add_collection(collection, autolim=False)


def _draw_cracks(
    ax: Axes, view: View, faces: np.ndarray, segment: np.ndarray, coloring: Coloring | None
) -> None:
    """Both faces of each crack: coloured by mode, or by a field of the crack segments."""
    lines, values = view.drawn[faces], view.values
    if values is not None and values.location == "crack" and coloring is not None:
        _add_lines(ax, lines, OUTLINE_COLOR, 3.2, zorder=4)
        collection = LineCollection(lines, linewidths=2.2, zorder=5, capstyle="round")
        collection.set_array(np.asarray(values.values, dtype=np.float64)[segment])
        collection.set(cmap=coloring.cmap, norm=coloring.norm)
    else:
        colors = [MODE_COLORS.get(int(mode), MODE_COLORS[0]) for mode in _modes(view.cracks)[segment]]
        collection = LineCollection(lines, colors=colors, linewidths=1.5, zorder=5, capstyle="round")
        if values is not None:  # a white edge sets the crack off from the colours of a field
            _add_lines(ax, lines, "white", 2.9, zorder=4)
    ax.add_collection(collection, autolim=False)


def _modes(cracks: Frame) -> np.ndarray:
    """(segments,) mode of each segment; pre-existing where the file does not say."""
    if "mode" in cracks.cell_data:
        return np.asarray(cracks.cell_data["mode"]).astype(np.int64)
    return np.zeros(len(cracks.cells), dtype=np.int64)


def _crack_legend(figure: Figure, views: Sequence[View]) -> None:
    """Legend of the modes that are drawn; none where there is no crack or a field colours the cracks."""
    present: set[int] = set()
    for view in views:
        if view.cracks is not None and not (view.values is not None and view.values.location == "crack"):
            present |= set(_modes(view.cracks).tolist())
    handles = [
        Line2D([], [], color=MODE_COLORS[mode], linewidth=1.8, label=f"crack: {CRACK_MODES[mode]}")
        for mode in (1, 2, 0)
        if mode in present
    ]
    if handles:
        figure.legend(
            handles=handles, loc="outside lower center", ncols=3, handlelength=1.6, columnspacing=1.5
        )


def _mesh_title(view: View, width: int) -> str:
    """Job, frame, time, what the state is, how much displacements are enlarged, in lines of `width`."""
    frame = view.frame
    time = f"{number_text(frame.time)} {view.units.time}".rstrip()
    first = [view.job, f"frame {frame.index} of 0\u2013{view.n_frames - 1}", f"time {time}"]
    if frame.kind_text:
        first.append(frame.kind_text)
    second = ["undeformed" if view.scale == 0 else f"displacements \u00d7 {number_text(view.scale)}"]
    if view.values is not None and view.values.info.scale != "category":
        finite = np.asarray(view.values.values)[np.isfinite(view.values.values)]
        if len(finite):
            name = view.values.name
            second.append(f"{name} from {number_text(finite.min())} to {number_text(finite.max())}")
    return "\n".join(_lines_of(first, width) + _lines_of(second, width))


def _lines_of(parts: list[str], width: int) -> list[str]:
    """Parts joined by commas, broken into lines of about `width` characters between them."""
    lines = [parts[0]]
    for part in parts[1:]:
        if len(lines[-1]) + len(part) + 2 <= width:
            lines[-1] += f", {part}"
        else:
            lines[-1] += ","
            lines.append(part)
    return lines


# --- colours ---------------------------------------------------------------------------------------------


@dataclass
class Coloring:
    """Colour map, range and colour bar of a field."""

    cmap: Colormap
    norm: Normalize
    extend: str  #: 'neither', 'min', 'max', 'both': where values lie outside the range
    fields: list[FieldValues]
    ticks: list[tuple[float, str]] | None = None  #: places and words of a category's colours

    @staticmethod
    def of(fields: list[FieldValues]) -> Coloring | None:
        """Colours for fields that share a colour bar; None for no field."""
        if not fields:
            return None
        arrays = [np.asarray(item.values, dtype=np.float64) for item in fields]
        values = np.concatenate([array[np.isfinite(array)] for array in arrays])
        if fields[0].info.scale == "category":
            category = _category_coloring(fields, np.unique(values))
            if category is not None:
                return category
        return _continuous_coloring(fields, values)


def _category_coloring(fields: list[FieldValues], present: np.ndarray) -> Coloring | None:
    """One colour for each value; None where there are more values than colours to tell apart."""
    words = dict(fields[0].info.names)
    numbers = list(words) + [int(value) for value in present if int(value) not in words]
    if not 0 < len(numbers) <= len(CATEGORY_COLORS):
        return None
    colors = list(CATEGORY_COLORS[: len(numbers)])
    if fields[0].name.endswith("mode"):
        colors = [MODE_COLORS.get(number, CATEGORY_COLORS[6]) for number in numbers]
    elif fields[0].location == "crack":
        colors = [*STATE_COLORS, *CATEGORY_COLORS[4:]][: len(numbers)]
    order = np.argsort(numbers)
    for item in fields:  # draw the place in the legend, not the number itself
        values = np.asarray(item.values, dtype=np.float64)
        places = order[
            np.searchsorted(np.array(numbers)[order], np.nan_to_num(values)).clip(0, len(order) - 1)
        ]
        item.values = np.where(np.isfinite(values), places, np.nan)
    norm = BoundaryNorm(np.arange(len(numbers) + 1) - 0.5, len(numbers))
    ticks = [(float(place), words.get(number, str(number))) for place, number in enumerate(numbers)]
    return Coloring(ListedColormap(colors), norm, "neither", fields, ticks)


def _continuous_coloring(fields: list[FieldValues], values: np.ndarray) -> Coloring:
    """Range of a continuous field: all its values, or, where a few stand far out, all but those."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    inner = np.quantile(values, (0.002, 0.998)) if len(values) > 1000 else np.array([low, high])
    if high - low > 3 * (inner[1] - inner[0]) > 0:
        low, high = float(inner[0]), float(inner[1])
    scale = fields[0].info.scale
    nearest, farthest = sorted((abs(low), abs(high)))
    if scale == "signed" and low * high > 0 and nearest > FAR_FROM_ZERO * farthest:
        scale = "plain"  # a narrow range far from zero would have one shade of a diverging map
    if scale == "signed":
        high = max(abs(low), abs(high)) or 1.0
        low = -high
    elif scale == "positive":
        low, high = min(0.0, low), high if high > min(0.0, low) else 1.0
    elif high == low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    below, above = bool(len(values)) and values.min() < low, bool(len(values)) and values.max() > high
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[(int(below), int(above))]
    cmap = mpl.colormaps[SIGNED_MAP if scale == "signed" else POSITIVE_MAP]
    return Coloring(cmap, Normalize(low, high), extend, fields)


def _color_bar(figure: Figure, axes: list[Axes], coloring: Coloring, units: Units, wide: bool) -> None:
    mappable = mpl.cm.ScalarMappable(coloring.norm, coloring.cmap)
    place = {"location": "bottom", "aspect": 45, "pad": 0.02} if wide else {"location": "right", "aspect": 30}
    bar = figure.colorbar(mappable, ax=axes, shrink=0.8, extend=coloring.extend, **place)
    bar.outline.set_linewidth(0.5)
    bar.set_label(coloring.fields[0].info.title(units))
    if coloring.ticks is not None:
        bar.set_ticks([place for place, _ in coloring.ticks], labels=[word for _, word in coloring.ticks])
        bar.ax.minorticks_off()
    elif max(abs(coloring.norm.vmin), abs(coloring.norm.vmax)) < 1e-2:
        bar.formatter.set_powerlimits((0, 0))
        bar.update_ticks()


# --- animation -------------------------------------------------------------------------------------------


def animate(results: Results, options: MeshOptions, path: Path, seconds: float = 8.0) -> Path:
    """Write all frames as a GIF with one deformation scale and one colour range.

    Each frame is shown equally long, at most half a second, so that the whole takes about `seconds`; the last
    one stays for two seconds. ResultsError where the file cannot be written.
    """
    views = _animation_views(results, options)
    with mpl.rc_context(STYLE):
        fields = [view.values for view in views if view.values is not None]
        coloring = Coloring.of(fields)
        window = _window(views)
        pictures = [_animation_picture(view, views, coloring, window) for view in views]
    palette = _palette(coloring)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    shown = int(min(500, max(40, 1000 * seconds / len(frames))))
    durations = [shown] * (len(frames) - 1) + [2000]
    with writing(path):
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, loop=0)
    return path


def _palette(coloring: Coloring | None) -> Image.Image:
    """The 256 colours of an animation: the colour map, the cracks' colours fading into white, and greys."""
    lines = [MODE_COLORS[1], MODE_COLORS[2], BODY_COLOR, MESH_COLOR, OUTLINE_COLOR, UNDEFORMED_COLOR]
    colors = [np.array(to_rgb(color)) for color in lines]
    colors += [part * color + 1 - part for color in colors[:2] for part in (0.25, 0.5, 0.75)]
    colors += [np.full(3, grey) for grey in np.linspace(0, 1, 40)]
    for color in colors[:5]:  # fading into the body
        colors += [part * color + (1 - part) * colors[2] for part in np.linspace(0.1, 0.9, 8)]
    if coloring is not None:
        colors += [color[:3] for color in coloring.cmap(np.linspace(0, 1, 256 - len(colors)))]
    image = Image.new("P", (1, 1))
    image.putpalette(np.rint(255 * np.array(colors)).astype(np.uint8).tobytes())
    return image


def _animation_views(results: Results, options: MeshOptions) -> list[View]:
    """Views of all frames with the scale that suits the frame that moves most.

    Frames without a crack have no crack fields: they are drawn without colours.
    """
    frames = results.frames
    frames.number(0)
    scale = options.scale
    if scale is None:
        scale = (
            min(auto_scale(frame.points, frame.displacement) for frame in frames if _moves(frame))
            if any(_moves(frame) for frame in frames)
            else 1.0
        )
    last = make_view(results, MeshOptions(options.field, -1, scale))
    views = []
    for index in range(len(frames)):
        crackless = results.crack_frame(index) is None
        without = last.values is not None and last.values.location == "crack" and crackless
        views.append(make_view(results, MeshOptions("" if without else options.field, index, scale)))
    return views


def _moves(frame: Frame) -> bool:
    return bool(np.any(frame.displacement))


def _animation_picture(view: View, views: Sequence[View], coloring: Coloring | None, window) -> Image.Image:  # noqa: ANN001
    """One frame as an image; all have the same size, colour bar and legend."""
    figure, axes, room = _mesh_axes(1, window, coloring is not None)
    figure.set_dpi(110)
    _draw_view(axes[0], view, coloring, window)
    lines = max(_mesh_title(other, room).count("\n") for other in views)
    title = _mesh_title(view, room)
    axes[0].set_title("\n" * (lines - title.count("\n")) + title, loc="left")  # so that nothing jumps
    if coloring is not None:
        _color_bar(figure, axes, coloring, view.units, _is_wide(window))
    _crack_legend(figure, views)
    figure.canvas.draw()
    return Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())

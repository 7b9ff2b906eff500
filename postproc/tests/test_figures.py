"""Figures: what is drawn where, in which colours, with which words. Each is rendered to pixels."""

import numpy as np
import pytest
import synthetic
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import to_rgb, to_rgba

import rfem_curves
import rfem_figures
from rfem_curves import curve_figure, history_curve, load_displacement_curve
from rfem_fields import FieldInfo, FieldValues
from rfem_figures import Coloring, MeshOptions, make_view, mesh_figure
from rfem_geometry import auto_scale, boundary_edges, outline, round_125
from rfem_results import ResultsError, open_results


def pixels(figure):
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int)


def count_color(image, color, tolerance=40):
    wanted = np.rint(255 * np.array(to_rgb(color)))
    return int((abs(image - wanted).max(axis=2) < tolerance).sum())


def words(figure):
    texts = [
        text.get_text()
        for ax in figure.axes
        for text in (ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label)
    ]
    texts += [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    for ax in figure.axes:
        texts += [text.get_text() for text in ax.get_legend().get_texts()] if ax.get_legend() else []
        texts += [text.get_text() for text in ax.texts]
    return "\n".join(texts)


# --- geometry --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "rounded"), [(1, 1), (1.3, 1), (1.5, 2), (3, 2), (4, 5), (7.2, 10), (480, 500), (0.034, 0.05)]
)
def test_scales_are_1_2_5(value, rounded):
    assert round_125(value) == pytest.approx(rounded)


def test_auto_scale_draws_a_twentieth_of_the_size():
    x = np.array([[0, 0], [400, 0], [400, 100.0]])
    u = np.array([[0, 0], [0, -0.04], [0.01, 0]])
    assert auto_scale(x, u) == 500  # 0.05 x 400 / 0.04
    assert auto_scale(x * 1e-3, u * 1e-3) == 500  # whatever the units
    assert auto_scale(x, 0 * u) == 1


def test_debris_does_not_set_the_scale():
    x = np.random.default_rng(1).uniform(0, 100, (1000, 2))
    u = np.full((1000, 2), 0.1)
    assert auto_scale(x, u) == 50
    u[0] = 1e6
    assert auto_scale(x, u) == 50


def test_boundary_of_two_triangles():
    edges = boundary_edges(np.array([[0, 1, 2], [1, 3, 2]]))
    assert {tuple(sorted(edge)) for edge in edges.tolist()} == {(0, 1), (1, 3), (2, 3), (0, 2)}
    assert boundary_edges(np.zeros((0, 3), dtype=int)).shape == (0, 2)


def test_each_crack_segment_has_two_faces_with_their_own_displacement(beam):
    frame = beam.frames[-1]
    cracks = beam.crack_frame(frame.index)
    edges = outline(frame, cracks)
    n = len(cracks.cells)
    np.testing.assert_array_equal(np.bincount(edges.segment, minlength=n), 2)
    for face, segment in zip(edges.faces, edges.segment):
        ends = {tuple(point) for point in frame.points[face]}
        assert ends == {tuple(point) for point in cracks.points[cracks.cells[segment]]}
    assert len(set(edges.faces.reshape(-1).tolist())) == 2 * (n + 1) - 1  # all but the tip are there twice
    free = outline(frame, None).free
    assert len(free) == len(edges.free) + 2 * n


def test_a_segment_inside_the_body_is_drawn_between_its_tips(beam):
    """One cracked edge alone opens nothing: its two ends are tips, the mesh has no free edge there."""
    frame = beam.frames[0]
    first = frame.cells[40]

    class Cracks:
        points = frame.points[first]
        cells = np.array([[0, 1]])

    edges = outline(frame, Cracks())
    assert edges.faces.tolist() == [first[:2].tolist()]
    assert edges.segment.tolist() == [0]


# --- meshes ----------------------------------------------------------------------------------------------


def test_mesh_with_cracks_by_mode(beam):
    figure = mesh_figure([make_view(beam, MeshOptions())])
    ax = figure.axes[0]
    assert ax.get_xlabel() == "$x$ (mm)"
    assert ax.get_ylabel() == "$y$ (mm)"
    assert ax.get_aspect() == 1
    text = words(figure)
    assert "displacements \u00d7 500" in text
    assert "beam, frame 6 of 0\u20136, time 1, nothing fails any more" in text
    assert "crack: tension\ncrack: shear\ncrack: pre-existing" in text
    image = pixels(figure)
    for color in rfem_figures.MODE_COLORS.values():
        assert count_color(image, color) > 20
    assert count_color(image, rfem_figures.BODY_COLOR) > 10_000
    assert any(isinstance(item, PolyCollection) for item in ax.collections)


def test_the_first_frame_has_no_legend_and_no_scale(beam):
    figure = mesh_figure([make_view(beam, MeshOptions(frame=0))])
    assert not figure.legends
    assert "frame 0" in words(figure)
    pixels(figure)


def test_scale_is_stated_and_obeyed(beam):
    view = make_view(beam, MeshOptions(scale=0.0))
    np.testing.assert_array_equal(view.drawn, view.frame.points)
    assert "undeformed" in words(mesh_figure([view]))
    view = make_view(beam, MeshOptions(scale=20.0))
    np.testing.assert_allclose(view.drawn, view.frame.points + 20 * view.frame.displacement)
    assert "displacements \u00d7 20" in words(mesh_figure([view]))


@pytest.mark.parametrize(
    ("field", "label"),
    [
        ("stress_xx", r"stress $\sigma_{xx}$, tension positive (MPa)"),
        ("element:stress_xy", r"element stress $\sigma_{xy}$, tension positive (MPa)"),
        ("sigma3", r"minor principal stress $\sigma_3$, compression positive (MPa)"),
        ("utilisation", "utilisation $F$, fails at 1"),
        ("displacement", "displacement (mm)"),
        ("displacement_x", "displacement, $x$ component (mm)"),
        ("opening", "crack opening (mm)"),
        ("normal_traction", "normal traction on the crack, tension positive (MPa)"),
        ("split_level", "split level"),
        ("fragment", "fragment"),
        ("mode", "crack mode"),
        ("state", "crack state"),
    ],
)
def test_fields_have_a_colour_bar_with_name_sign_and_unit(beam, field, label):
    figure = mesh_figure([make_view(beam, MeshOptions(field))])
    bar = figure.axes[1]
    assert label in (bar.get_xlabel(), bar.get_ylabel())
    image = pixels(figure)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 100
    crack_field = field in ("opening", "normal_traction", "mode", "state")
    assert bool(figure.legends) == (not crack_field)


def test_node_fields_are_shaded_and_element_fields_are_flat(beam):
    def shades(field):
        axes = mesh_figure([make_view(beam, MeshOptions(field))]).axes[0]
        (mesh,) = [item for item in axes.collections if isinstance(item, TriMesh)]
        return mesh

    n_nodes, n_elements = len(beam.frames[-1].points), len(beam.frames[-1].cells)
    assert len(shades("stress_xx").get_array()) == n_nodes
    flat = shades("element:stress_xx").get_array()
    assert len(flat) == 3 * n_elements
    assert np.all(np.ptp(flat.reshape(-1, 3), axis=1) == 0)


def values_of(array, scale, location="node"):
    return FieldValues("f", location, np.asarray(array, dtype=float), FieldInfo("f", scale=scale))


def test_signed_fields_have_zero_in_the_middle_of_a_diverging_map():
    coloring = Coloring.of([values_of([-1.0, 4.0], "signed")])
    assert (coloring.norm.vmin, coloring.norm.vmax) == (-4, 4)
    assert coloring.cmap.name == rfem_figures.SIGNED_MAP


def test_a_signed_field_of_one_sign_down_to_zero_keeps_zero_in_the_middle():
    coloring = Coloring.of([values_of([-6.0, -0.001], "signed")])
    assert (coloring.norm.vmin, coloring.norm.vmax) == (-6, 6)


def test_a_signed_field_far_from_zero_uses_the_whole_map():
    coloring = Coloring.of([values_of([-30.0, -28.0], "signed")])
    assert (coloring.norm.vmin, coloring.norm.vmax) == (-30, -28)
    assert coloring.cmap.name == rfem_figures.POSITIVE_MAP


def test_positive_fields_begin_at_zero():
    coloring = Coloring.of([values_of([0.2, 0.7], "positive")])
    assert (coloring.norm.vmin, coloring.norm.vmax) == (0, 0.7)


@pytest.mark.parametrize("scale", ["signed", "positive", "plain", "category"])
@pytest.mark.parametrize("array", [[0.0, 0.0], [3.0, 3.0], [np.nan, 1.0], [], [np.nan]])
def test_fields_without_a_range_can_be_coloured(scale, array):
    coloring = Coloring.of([values_of(array, scale)])
    assert coloring.norm.vmin < coloring.norm.vmax


def test_a_few_extreme_values_do_not_bleach_the_rest_and_the_bar_says_so():
    values = np.concatenate([np.linspace(0, 1, 5000), [1e6]])
    coloring = Coloring.of([values_of(values, "positive")])
    assert coloring.norm.vmax < 2
    assert coloring.extend == "max"


def test_many_fragments_get_a_continuous_bar():
    coloring = Coloring.of([values_of(np.arange(50), "category")])
    assert coloring.ticks is None


def test_a_comparison_has_one_range_and_two_titles(beam_directory):
    with open_results(beam_directory / "beam") as one, open_results(beam_directory / "coarse") as two:
        views = [make_view(results, MeshOptions("stress_xx")) for results in (one, two)]
        figure = mesh_figure(views)
        text = words(figure)
        assert "beam, frame" in text
        assert "coarse, frame" in text
        meshes = [c for ax in figure.axes for c in ax.collections if isinstance(c, TriMesh)]
        assert meshes[0].norm is meshes[1].norm
        pixels(figure)


def test_large_meshes_have_no_mesh_lines_and_are_images(tmp_path):
    x, t = synthetic.lattice(100, 100, 110, 110)
    assert len(t) > rfem_figures.MESH_LINES_UP_TO
    writer = synthetic.VtkhdfWriter(tmp_path / "a.vtkhdf", 5, {"displacement": (3, np.float32)}, {})
    writer.add_geometry(x, t)
    writer.add_frame(0.0, 0, {"displacement": np.zeros((len(x), 3))}, {})
    writer.close()
    with open_results(tmp_path / "a") as results:
        figure = mesh_figure([make_view(results, MeshOptions())])
        assert not any(isinstance(item, PolyCollection) for item in figure.axes[0].collections)
        (mesh,) = [item for item in figure.axes[0].collections if isinstance(item, TriMesh)]
        assert mesh.get_rasterized()
        assert count_color(pixels(figure), rfem_figures.BODY_COLOR, 8) > 10_000
        assert figure.axes[0].get_xlabel() == "$x$"  # no deck, no units


def test_values_that_are_no_numbers_are_left_out(tmp_path):
    writer = synthetic.VtkhdfWriter(
        tmp_path / "a.vtkhdf", 5, {"utilisation": (1, np.float64)}, {"x": (1, np.float64)}
    )
    writer.add_geometry([[0, 0], [1, 0], [0, 1], [1, 1.0]], [[0, 1, 2], [1, 3, 2]])
    writer.add_frame(0.0, 0, {"utilisation": [0, 0.5, 1, np.nan]}, {"x": [np.nan, 1.0]})
    writer.close()
    with open_results(tmp_path / "a") as results:
        for field in ("utilisation", "x"):
            pixels(mesh_figure([make_view(results, MeshOptions(field))]))


# --- curves ----------------------------------------------------------------------------------------------


def test_the_load_displacement_curve_is_that_of_the_first_monitor(beam):
    curve = load_displacement_curve(beam)
    assert (curve.x, curve.y, curve.x_sign, curve.y_sign) == ("PLATEN_u2", "PLATEN_rf2", -1, -1)
    figure = curve_figure([curve])
    ax = figure.axes[0]
    assert ax.get_xlabel() == "\u2212displacement in $y$, PLATEN (mm)"
    assert ax.get_ylabel() == "\u2212reaction in $y$, PLATEN (N)"
    np.testing.assert_allclose(ax.lines[0].get_ydata(), -beam.history["PLATEN_rf2"])
    np.testing.assert_allclose(ax.lines[0].get_xdata(), -beam.history["PLATEN_u2"])
    assert "106.2 N" in words(figure)  # the peak
    assert "not converged" in words(figure)
    assert len(ax.lines[1].get_xdata()) == 1
    assert count_color(pixels(figure), rfem_curves.COLORS[0]) > 200


def test_a_monitor_without_reaction_is_drawn_with_the_load_factor(tmp_path):
    synthetic.write_tables(tmp_path, "a", h5=False)
    text = (tmp_path / "a_history.csv").read_text().replace("PLATEN_", "LAST_")
    (tmp_path / "a_history.csv").write_text(text)
    with open_results(tmp_path / "a") as results:
        history = results.history
        for i in (1, 2):
            history.columns[f"LAST_rf{i}"] = 0 * history["time"]
        curve = load_displacement_curve(results)
        assert (curve.x, curve.y) == ("LAST_u2", "load_factor")
        history.columns["step"] = np.arange(len(history))
        assert load_displacement_curve(results).y == "time"


def test_a_run_without_monitor_says_what_to_do(tmp_path):
    synthetic.write_tables(tmp_path, "a", monitors=False)
    with (
        open_results(tmp_path / "a") as results,
        pytest.raises(ResultsError, match=r"a has no monitor.*\*MONITOR"),
    ):
        load_displacement_curve(results)


def test_any_two_columns(beam):
    figure = curve_figure([history_curve(beam, "TIME", "strain_energy")])
    assert figure.axes[0].get_ylabel() == "strain energy (N mm)"
    with pytest.raises(ResultsError, match=r"did you mean time\?"):
        history_curve(beam, "tme", "time")


def test_two_curves_share_a_diagram(beam_directory):
    with open_results(beam_directory / "beam") as one, open_results(beam_directory / "coarse") as two:
        figure = curve_figure([load_displacement_curve(one), load_displacement_curve(two)])
        assert words(figure).count("beam") >= 1
        assert "coarse" in words(figure)
        lines = [line for line in figure.axes[0].lines if line.get_linestyle() == "-"]
        assert to_rgba(lines[0].get_color()) != to_rgba(lines[1].get_color())


def test_different_units_cannot_share_axes(tmp_path, beam_directory):
    synthetic.write_tables(tmp_path, "si", deck="*HEADING\nunits: m, N, Pa\n")
    with (
        open_results(beam_directory / "beam") as one,
        open_results(tmp_path / "si") as two,
        pytest.raises(ResultsError, match=r"beam and si state different units \(mm, N, MPa; m, N, Pa\)"),
    ):
        curve_figure([load_displacement_curve(one), load_displacement_curve(two)])


def test_crack_lines_lie_on_the_deformed_faces(beam):
    view = make_view(beam, MeshOptions())
    figure = mesh_figure([view])
    edges = outline(view.frame, view.cracks)
    lines = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    drawn = np.array([path.vertices for path in lines[-1].get_paths()])
    np.testing.assert_allclose(drawn, view.drawn[edges.faces])

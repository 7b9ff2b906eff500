"""Fields, units and labels."""

import numpy as np
import pytest

from rfem_fields import Units, column_label, field_names, field_values, parse_units, principal_stresses
from rfem_results import ResultsError, heading_lines


def deck(*lines):
    return "\n".join(["** a deck", "*Heading", *lines, "*NODE", "1, units: m, kN, kPa"])


# --- units -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "units"),
    [
        ("units: mm, N, MPa", Units("mm", "N", "MPa")),
        ("Beam. Units = mm, N, MPa, ms", Units("mm", "N", "MPa", "ms")),
        ("UNITS: m N Pa s", Units("m", "N", "Pa", "s")),
        ("units: MPa, mm, N", Units("mm", "N", "MPa")),  # known units find their place
        ("units: smoot, N, MPa", Units("smoot", "N", "MPa")),  # an unknown one takes the first free one
        ("units: m; plane strain", Units(length="m")),
        ("a beam of unknown units", Units()),
        ("", Units()),
    ],
)
def test_units_come_from_the_heading(line, units):
    assert parse_units(deck("A title", line)) == units


def test_only_headings_state_units():
    assert parse_units("** units: mm, N, MPa\n*NODE\n1, 0, 0\n") == Units()
    assert parse_units("") == Units()
    assert parse_units("*Heading\n exported.inp\n*NODE\n1,0,0\n*HEADING\r\nunits: mm, N, MPa\r\n") == Units(
        "mm", "N", "MPa"
    )


def test_heading_lines_leave_out_comments():
    assert heading_lines(deck("First", "** no", "second")) == ["First", "second"]


def test_labels_have_units_where_there_are_some():
    units = Units("mm", "N", "MPa")
    assert units.label("stress", "stress") == "stress (MPa)"
    assert units.label("work", "energy") == "work (N mm)"
    assert units.label("time", "time") == "time"
    assert Units().label("stress", "stress") == "stress"
    assert Units("m", "N", "Pa").of("energy") == "J"
    assert Units("m", "N", "Pa").of("moment") == "N m"
    assert Units("m", "N", "Pa", "s").of("velocity") == "m/s"


@pytest.mark.parametrize(
    ("column", "label"),
    [
        ("TOP_rf2", "reaction in $y$, TOP (N)"),
        ("TOP_u1", "displacement in $x$, TOP (mm)"),
        ("MID_m", "section moment, MID (N mm)"),
        ("external_work", "external work (N mm)"),
        ("crack_length", "crack length (mm)"),
        ("load_factor", "load factor"),
        ("energy_error", "energy error, relative"),
        ("max_utilisation", "largest utilisation $F$"),
    ],
)
def test_column_labels(column, label):
    assert column_label(column, Units("mm", "N", "MPa"), ["TOP", "MID"]) == label
    assert column_label(column, Units("mm", "N", "MPa"), ["TOP", "MID"], negative=True) == "\u2212" + label


# --- fields ----------------------------------------------------------------------------------------------


def test_all_names_that_are_listed_can_be_drawn(beam):
    frame = beam.frames[-1]
    cracks = beam.crack_frame(frame.index)
    names = field_names(frame, cracks)
    assert len(names) == len(set(names))
    for name in (
        "displacement",
        "displacement_y",
        "reaction_x",
        "stress_xx",
        "element:stress_xy",
        "sigma1",
        "tau_max",
    ):
        assert name in names
    for name in (
        "element:sigma3",
        "material",
        "fragment",
        "opening",
        "slip",
        "normal_traction",
        "state",
        "mode",
    ):
        assert name in names
    sizes = {"node": len(frame.points), "element": len(frame.cells), "crack": len(cracks.cells)}
    for name in names:
        found = field_values(frame, cracks, name)
        assert found.values.shape == (sizes[found.location],)
        assert found.info.label


def test_components_and_places(beam):
    frame = beam.frames[-1]
    u = frame.point_data["displacement"]
    np.testing.assert_array_equal(field_values(frame, None, "displacement_y").values, u[:, 1])
    np.testing.assert_allclose(
        field_values(frame, None, "displacement").values, np.hypot(u[:, 0], u[:, 1]), rtol=1e-6
    )
    for component, place in (("xx", 0), ("yy", 1), ("zz", 2), ("xy", 3)):
        node = field_values(frame, None, f"stress_{component}")
        element = field_values(frame, None, f"element:stress_{component}")
        np.testing.assert_array_equal(node.values, frame.point_data["stress"][:, place])
        np.testing.assert_array_equal(element.values, frame.cell_data["stress"][:, place])
        assert (node.location, element.location) == ("node", "element")
    np.testing.assert_array_equal(field_values(frame, None, "SIGMA1").values, frame.point_data["sigma1"])


def test_principal_stresses_are_compression_positive():
    """Uniaxial compression of 10 along y, tension of 2 along x; and pure shear."""
    stress = np.array([[2.0, -10.0, 0, 0, 0, 0], [0, 0, 0, 3.0, 0, 0]])
    found = principal_stresses(stress)
    np.testing.assert_allclose(found["sigma1"], [10, 3])
    np.testing.assert_allclose(found["sigma3"], [-2, -3])
    np.testing.assert_allclose(found["tau_max"], [6, 3])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("stres_xx", r"no field stres_xx; did you mean stress_xx\? \(fields: displacement, "),
        ("stress", r"stress has several components: say which \(stress_xx, "),
        ("node:material", "no field node:material"),
        ("velocity", "no field velocity"),
    ],
)
def test_fields_that_do_not_exist(beam, name, message):
    frame = beam.frames[-1]
    with pytest.raises(ResultsError, match=message):
        field_values(frame, beam.crack_frame(frame.index), name)


def test_a_crack_field_of_an_intact_body_says_why(beam):
    with pytest.raises(ResultsError, match="no field opening in frame 0: it has no crack"):
        field_values(beam.frames[0], None, "opening")

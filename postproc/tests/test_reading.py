"""Reading result files: frames, cracks, tables, provenance, unfinished runs; what is said of wrong ones."""

import csv
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic

import rfem_results
from rfem_frames import FrameFile
from rfem_io import read_csv_table
from rfem_results import ResultsError, find_job, open_results

HERE = Path(__file__).resolve().parent


# --- frames ----------------------------------------------------------------------------------------------


def two_triangles(path, cell_type=synthetic.TRIANGLE, fields=None):
    fields = fields or {"displacement": (3, np.float32), "value": (1, np.float64)}
    return synthetic.VtkhdfWriter(path, cell_type, fields, {"stress": (6, np.float32)})


def test_frames_take_their_own_part_of_each_array(tmp_path):
    """Geometry 0 for frames 0 and 1, a larger one for frame 2: every number comes from its own offset."""
    writer = two_triangles(tmp_path / "a.vtkhdf")
    x0 = np.array([[0, 0], [1, 0], [0, 1], [1, 1.0]])
    t0 = np.array([[0, 1, 2], [1, 3, 2]])
    x1 = np.vstack([x0 + 10, [[20, 20.0]]])
    t1 = np.array([[0, 1, 4], [1, 3, 4], [3, 2, 4]])
    expected = []
    for frame, (x, t) in enumerate([(x0, t0), (x0, t0), (x1, t1)]):
        if frame != 1:
            writer.add_geometry(x, t)
        u = np.arange(3 * len(x)).reshape(-1, 3) + 100 * frame
        value = np.arange(len(x)) - 5.0 * frame
        stress = np.arange(6 * len(t)).reshape(-1, 6) + 1000 * frame
        writer.add_frame(float(frame), frame, {"displacement": u, "value": value}, {"stress": stress})
        expected.append((x, t, u, value, stress))
    writer.close()
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        assert file["VTKHDF/Points"].shape == (9, 3)  # the shared geometry is stored once
    frames = FrameFile(tmp_path / "a.vtkhdf")
    assert len(frames) == 3
    for index in (2, 0, 1, -1):  # in any order
        frame = frames[index]
        x, t, u, value, stress = expected[index]
        assert frame.index == index % 3
        np.testing.assert_array_equal(frame.points, x)
        np.testing.assert_array_equal(frame.cells, t)
        np.testing.assert_array_equal(frame.point_data["displacement"], u)
        np.testing.assert_array_equal(frame.displacement, u[:, :2])
        np.testing.assert_array_equal(frame.point_data["value"], value)
        np.testing.assert_array_equal(frame.cell_data["stress"], stress)
    assert (
        frames[0].points is frames[1].points or np.shares_memory(frames[0].points, frames[1].points) is False
    )
    assert sorted(frames[0].point_data) == ["displacement", "value"]
    assert frames[0].point_data.components("displacement") == 3
    assert [frame.kind for frame in frames] == [0, 1, 2]
    with pytest.raises(KeyError):
        frames[0].point_data["velocity"]


def test_frames_of_one_time_have_one_time_and_the_last_is_taken(beam):
    assert np.all(np.diff(beam.frames.values) > 0)  # the file keeps them apart
    times = beam.frames.times
    assert times[0] == 0.0
    assert np.all(times[1:-1] == 0.5)
    assert times[-1] == 1.0
    assert beam.frames.at_time(0.5) == len(times) - 2
    assert beam.frames.at_time(0.0) == 0
    assert beam.frames.at_time(1.0) == beam.frames.at_time(0.9) == len(times) - 1
    assert beam.frames[beam.frames.at_time(0.5)].kind_text == "nothing fails any more"


@pytest.mark.parametrize("time", [-0.1, 1.5, float("nan")])
def test_a_time_outside_the_run_is_an_error_that_names_the_times(beam, time):
    with pytest.raises(ResultsError, match=r"no frame near time .* \(frames: from 0 to 1\)"):
        beam.frames.at_time(time)


def test_a_frame_that_does_not_exist_is_an_error_that_names_the_frames(beam):
    n = len(beam.frames)
    with pytest.raises(
        ResultsError, match=rf"no frame {n} \(frames: 0 to {n - 1}, or -1 to -{n} from the end\)"
    ):
        beam.frames[n]
    assert beam.frames[-n].index == 0


def test_cracks_go_with_the_frames_and_begin_with_no_cell(beam):
    assert len(beam.cracks) == len(beam.frames)
    assert beam.cracks[0].cells.shape == (0, 2)
    assert beam.cracks[0].cell_data["opening"].shape == (0,)
    assert beam.crack_frame(0) is None
    last = beam.crack_frame(len(beam.frames) - 1)
    assert last.cells.shape[1] == 2
    assert len(last.cells) == len(last.cell_data["mode"]) > 5
    assert set(last.cell_data["mode"]) <= set(rfem_results.CRACK_MODES)
    last_mesh = beam.frames[-1].points
    for point in last.points:  # reference coordinates of nodes of the mesh, to the last bit
        assert (last_mesh == point).all(axis=1).any()


def test_fields_have_their_types_and_sizes(beam):
    frame = beam.frames[-1]
    assert frame.point_data["stress"].shape == (len(frame.points), 6)
    assert frame.cell_data["element_id"].dtype == np.int32
    assert len(beam.frames[0].points) < len(frame.points)  # nodes were copied on the way


def test_a_missing_offset_is_an_error_not_wrong_data(tmp_path):
    writer = two_triangles(tmp_path / "a.vtkhdf")
    writer.add_geometry(np.eye(3, 2), [[0, 1, 2]])
    writer.add_frame(
        0.0, 0, {"displacement": np.zeros((3, 3)), "value": np.zeros(3)}, {"stress": np.zeros((1, 6))}
    )
    del writer.steps["PointDataOffsets/value"]
    writer.close()
    with pytest.raises(ResultsError, match="PointDataOffsets/value is missing"):
        FrameFile(tmp_path / "a.vtkhdf")[0].point_data["value"]


def test_a_file_without_frames_says_so(tmp_path):
    two_triangles(tmp_path / "a.vtkhdf").close()
    frames = FrameFile(tmp_path / "a.vtkhdf")
    assert len(frames) == 0
    with pytest.raises(ResultsError, match=r"a\.vtkhdf has no frame yet"):
        frames[-1]


def test_cells_that_are_no_triangles_are_refused(tmp_path):
    writer = two_triangles(tmp_path / "a.vtkhdf")
    writer.add_geometry(np.eye(3, 2), [[0, 1, 7]])
    writer.add_frame(
        0.0, 0, {"displacement": np.zeros((3, 3)), "value": np.zeros(3)}, {"stress": np.zeros((1, 6))}
    )
    writer.close()
    with pytest.raises(ResultsError, match="a node that does not exist"):
        FrameFile(tmp_path / "a.vtkhdf")[0]


@pytest.mark.parametrize("content", [b"", b"not HDF5 at all", b"\x89HDF\r\n\x1a\n" + bytes(40)])
def test_what_is_no_hdf5_file_is_named(tmp_path, content):
    (tmp_path / "a.vtkhdf").write_bytes(content)
    with pytest.raises(ResultsError, match=r"a\.vtkhdf (is no HDF5 file|cannot be opened)") as error:
        open_results(tmp_path / "a").frames  # noqa: B018
    assert "\n" not in str(error.value)


def test_an_hdf5_file_of_another_kind_is_named(tmp_path):
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        file["x"] = 1
    with pytest.raises(ResultsError, match=r"a\.vtkhdf is no VTKHDF file with steps"):
        open_results(tmp_path / "a").frames  # noqa: B018


def test_vtk_reads_the_synthetic_files_alike(beam):
    """The synthetic files are good ones: VTK's own reader finds the same meshes and fields."""
    vtk = pytest.importorskip("vtk")
    numpy_support = pytest.importorskip("vtk.util.numpy_support")
    for frames in (beam.frames, beam.cracks):
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(frames.path))
        reader.UpdateInformation()
        assert reader.GetNumberOfSteps() == len(frames)
        for frame in frames:
            reader.SetStep(frame.index)
            reader.Update()
            grid = reader.GetOutput()
            assert grid.GetNumberOfCells() == len(frame.cells)
            if len(frame.cells) == 0:
                continue
            points = numpy_support.vtk_to_numpy(grid.GetPoints().GetData())[:, :2]
            np.testing.assert_array_equal(points, frame.points)
            for theirs, ours in (
                (grid.GetPointData(), frame.point_data),
                (grid.GetCellData(), frame.cell_data),
            ):
                for name in ours:
                    np.testing.assert_array_equal(
                        numpy_support.vtk_to_numpy(theirs.GetArray(name)), ours[name]
                    )


# --- a run that goes on, or was killed -------------------------------------------------------------------

WRITER = """
    import sys
    sys.path.insert(0, {here!r})
    import numpy as np, synthetic
    writer = synthetic.VtkhdfWriter({path!r}, 5, {{"displacement": (3, np.float32)}}, {{}}, swmr={swmr})
    for frame in range(3):
        n = 3 + frame
        writer.add_geometry(np.arange(2.0 * n).reshape(n, 2), [[0, 1, 2]])
        if {swmr} or frame < 2:
            writer.add_frame(float(frame), 1, {{"displacement": np.full((n, 3), frame)}}, {{}})
    print("written", flush=True)
    sys.stdin.read()
"""


def start_writer(path, swmr=True):
    program = textwrap.dedent(WRITER).format(here=str(HERE), path=str(path), swmr=swmr)
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "written\n"
    return process


def check_three_frames(path):
    with open_results(path) as results:
        assert len(results.frames) == 3
        assert results.frames[2].points.shape == (5, 2)
        np.testing.assert_array_equal(results.frames[2].displacement, np.full((5, 2), 2.0))
        assert results.unfinished == ["a.vtkhdf"]
        results.refresh()
        assert len(results.frames) == 3


def test_a_run_that_goes_on_can_be_read(tmp_path):
    process = start_writer(tmp_path / "a.vtkhdf")
    try:
        check_three_frames(tmp_path / "a")
    finally:
        process.communicate("")


def test_a_killed_run_can_be_read(tmp_path):
    process = start_writer(tmp_path / "a.vtkhdf")
    process.send_signal(signal.SIGKILL)
    process.communicate()
    check_three_frames(tmp_path / "a")


def test_a_file_killed_before_it_became_readable_says_how_to_repair_it(tmp_path):
    process = start_writer(tmp_path / "a.vtkhdf", swmr=False)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    with pytest.raises(
        ResultsError, match=r"a\.vtkhdf (cannot be opened: .*h5clear -s --increment=0|is no HDF5)"
    ):
        open_results(tmp_path / "a").frames  # noqa: B018


def test_half_a_frame_is_left_out(tmp_path):
    """Killed between the last array and the next: what is not there in all arrays does not count."""
    writer = two_triangles(tmp_path / "a.vtkhdf")
    writer.add_geometry(np.eye(3, 2), [[0, 1, 2]])
    for i in range(3):
        data = {"displacement": np.zeros((3, 3)), "value": np.zeros(3)}
        writer.add_frame(float(i), 0, data, {"stress": np.zeros((1, 6))})
    writer.root["CellData/stress"].resize(2, axis=0)
    writer.close()
    assert len(FrameFile(tmp_path / "a.vtkhdf")) == 2


# --- tables ----------------------------------------------------------------------------------------------


def test_history_has_the_columns_of_the_contract_in_order(beam):
    names = beam.history.names
    assert tuple(names[: len(rfem_results.HISTORY_COLUMNS)]) == rfem_results.HISTORY_COLUMNS
    assert beam.history.source.name == "beam.h5"
    assert beam.monitors == ["PLATEN", "CMOD"]
    assert beam.section_checks == ["MID"]
    assert beam.history["PLATEN_rf2"].min() == -106.2
    assert beam.history["event_count"].dtype.kind == "i"
    assert len(beam.history) == 22


def test_events_have_words_as_text(beam):
    assert tuple(beam.events.names[: len(rfem_results.EVENT_COLUMNS)]) == rfem_results.EVENT_COLUMNS
    assert set(beam.events["mode"]) == {"tension", "shear"}
    assert set(beam.events["type"]) == {"I", "II", "III", "edge"}
    assert beam.events["x"].dtype == np.float64


def test_csv_and_hdf5_tables_are_equal(beam):
    for title in ("history", "events"):
        from_csv = read_csv_table(beam.path(f"_{title}.csv"), title)
        from_h5 = getattr(beam, title)
        assert from_csv.names == from_h5.names
        for name in from_csv.names:
            np.testing.assert_array_equal(from_csv[name], from_h5[name])


def test_column_order_of_hdf5_without_csv(tmp_path):
    synthetic.write_tables(tmp_path, "a", csv_files=False)
    with open_results(tmp_path / "a") as results:
        assert (
            tuple(results.history.names[: len(rfem_results.HISTORY_COLUMNS)]) == rfem_results.HISTORY_COLUMNS
        )
        assert set(results.monitors) == {"PLATEN", "CMOD"}


def test_csv_stands_in_for_hdf5(tmp_path):
    synthetic.write_tables(tmp_path, "a", h5=False)
    with open_results(tmp_path / "a_history.csv") as results:
        assert results.history.source.name == "a_history.csv"
        assert results.monitors == ["PLATEN", "CMOD"]
        assert results.deck == ""


def test_csv_stands_in_for_an_unreadable_hdf5_file(tmp_path):
    synthetic.write_tables(tmp_path, "a")
    (tmp_path / "a.h5").write_bytes(b"cut off")
    with open_results(tmp_path / "a") as results:
        assert results.history.source.name == "a_history.csv"
        assert results.provenance == {}


def test_half_a_row_of_csv_is_left_out(tmp_path):
    (tmp_path / "a_history.csv").write_text("step,time\n1,0\n1,0.5\n1,0.7")
    table = read_csv_table(tmp_path / "a_history.csv", "history")
    np.testing.assert_array_equal(table["time"], [0, 0.5])


def test_rows_that_not_all_columns_have_are_left_out(tmp_path):
    synthetic.write_tables(tmp_path, "a", csv_files=False)
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file["rfem/history/PLATEN_u2"].resize((5,)) if file["rfem/history/PLATEN_u2"].chunks else None
    with open_results(tmp_path / "a") as results:
        assert len(results.history) == 5
        assert len(results.history["time"]) == 5


def test_columns_with_commas_and_quotes(tmp_path):
    with (tmp_path / "a_history.csv").open("w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([["step", 'P, "left"_u1'], [1, 2.5]])
    assert read_csv_table(tmp_path / "a_history.csv", "history")['P, "left"_u1'][0] == 2.5


def test_a_column_that_does_not_exist_has_its_nearest_name(beam):
    with pytest.raises(
        ResultsError, match=r"no history column load_faktor; did you mean load_factor\?.*columns: step,"
    ):
        beam.history["load_faktor"]
    assert beam.history.find("platen_RF2") == "PLATEN_rf2"


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "has no header line"), ("a,b\n1,2\n3\n4,5\n", "row 3 has 1 values for 2 columns")],
)
def test_bad_csv(tmp_path, text, message):
    (tmp_path / "a_history.csv").write_text(text)
    with pytest.raises(ResultsError, match=message):
        open_results(tmp_path / "a").history  # noqa: B018


def test_provenance_is_text(beam):
    assert beam.provenance["version"] == "0.1.0"
    assert beam.provenance["threads"] == "2"
    assert beam.deck == synthetic.DECK


# --- finding a job ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "ending",
    ["", ".vtkhdf", "_cracks.vtkhdf", ".h5", "_history.csv", "_events.csv", ".dat", ".mac", ".rst.h5"],
)
def test_a_job_may_be_named_by_any_of_its_files(beam_directory, ending):
    assert find_job(str(beam_directory / "beam") + ending) == (beam_directory, "beam")


def test_a_job_may_be_named_by_its_directory_where_it_is_alone(tmp_path, beam_directory):
    synthetic.write_tables(tmp_path, "only")
    assert find_job(tmp_path) == (tmp_path, "only")
    with pytest.raises(ResultsError, match="is a directory: name one of its jobs: beam, coarse"):
        find_job(beam_directory)


def test_a_job_whose_name_ends_like_a_file(tmp_path):
    synthetic.write_tables(tmp_path, "slope_history")
    synthetic.write_tables(tmp_path, "case0.45MPa")
    assert find_job(tmp_path / "slope_history") == (tmp_path, "slope_history")
    assert find_job(tmp_path / "case0.45MPa") == (tmp_path, "case0.45MPa")


def test_a_job_that_does_not_exist(beam_directory, tmp_path):
    with pytest.raises(
        ResultsError, match=r"no results of baem in .*; did you mean beam\? \(jobs there: beam, coarse\)"
    ):
        find_job(beam_directory / "baem")
    with pytest.raises(ResultsError, match="there is no directory"):
        find_job(tmp_path / "nowhere" / "beam")
    with pytest.raises(ResultsError, match="it has no results of rfem"):
        find_job(tmp_path)

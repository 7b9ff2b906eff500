"""The command: its options, the files it writes, its messages."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
from PIL import Image

import rfem_plot

SCRIPT = Path(rfem_plot.__file__).resolve()


@pytest.fixture
def plot(beam_directory, tmp_path, capsys, monkeypatch):
    """Run the command on a job of the synthetic results; returns the names of the files written."""
    monkeypatch.setattr("rfem_style.DPI", 90)  # faster; test_as_a_program draws in full

    def run(job, *options, directory=beam_directory):
        assert rfem_plot.main([str(directory / job), "--output", str(tmp_path), *options]) == 0
        printed = capsys.readouterr()
        written = [Path(line[6:]) for line in printed.out.splitlines() if line.startswith("wrote ")]
        assert all(path.is_file() and path.parent == tmp_path for path in written)
        run.notes, run.printed = printed.err, printed.out
        return sorted(path.name for path in written)

    run.output = tmp_path
    return run


def fails(capsys, *arguments):
    """The one line that the command leaves with."""
    with pytest.raises(SystemExit) as left:
        rfem_plot.main([str(argument) for argument in arguments])
    assert left.value.code == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("rfem_plot: error: ")
    assert printed.err.count("\n") == 1
    return printed.err


def size_and_colors(path):
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))
    return image.size, len(np.unique(pixels.reshape(-1, 3), axis=0))


def test_without_options_mesh_and_curve(plot):
    assert plot("beam") == ["beam_curve.png", "beam_mesh.png"]
    assert plot.notes == ""
    for name in ("beam_curve.png", "beam_mesh.png"):
        (width, height), colors = size_and_colors(plot.output / name)
        assert width > 400
        assert height > 200
        assert colors > 50


@pytest.mark.parametrize("job", ["beam.vtkhdf", "beam_history.csv"])
def test_a_file_names_the_job(plot, job):
    assert plot(job, "--field", "utilisation") == ["beam_utilisation.png"]


def test_the_last_frame_is_drawn_by_default(plot):
    plot("beam", "--frame", "-1")
    plot("beam", "--frame", "6", "--field", "")
    with Image.open(plot.output / "beam_mesh_frame6.png") as image:
        first = np.asarray(image)
    plot("beam")
    with Image.open(plot.output / "beam_mesh.png") as image:
        np.testing.assert_array_equal(first, np.asarray(image))


def test_frame_and_time(plot):
    assert plot("beam", "--frame", "0") == ["beam_mesh_frame0.png"]
    assert plot("beam", "--frame", "-2") == ["beam_mesh_frame5.png"]
    assert plot("beam", "--time", "1") == ["beam_mesh_frame6.png"]
    assert plot.notes == ""
    assert plot("beam", "--time", "0.45", "--field", "stress_xx") == ["beam_stress_xx_frame5.png"]
    assert "no frame at time 0.45: the nearest is frame 5 at 0.5" in plot.notes


def test_scale_changes_the_picture(plot):
    plot("beam", "--scale", "0", "--field", "material")
    small = size_and_colors(plot.output / "beam_material.png")
    plot("beam", "--scale", "2000", "--field", "material")
    assert size_and_colors(plot.output / "beam_material.png") != small


@pytest.mark.parametrize(("kind", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_formats(plot, kind, start):
    names = plot("beam", "--format", kind)
    assert names == [f"beam_curve.{kind}", f"beam_mesh.{kind}"]
    for name in names:
        assert (plot.output / name).read_bytes().startswith(start)
        assert (plot.output / name).stat().st_size > 5000


def test_pictures_are_the_same_each_time(plot):
    for kind in ("pdf", "svg", "png"):
        (name,) = plot("beam", "--field", "utilisation", "--format", kind)
        first = (plot.output / name).read_bytes()
        (plot.output / name).unlink()
        plot("beam", "--field", "utilisation", "--format", kind)
        assert (plot.output / name).read_bytes() == first


def test_history_alone_and_with_a_mesh(plot):
    assert plot("beam", "--history", "time", "max_utilisation") == ["beam_max_utilisation_over_time.png"]
    assert plot("beam", "--history", "time", "cracks", "--frame", "0") == [
        "beam_cracks_over_time.png",
        "beam_mesh_frame0.png",
    ]


def test_compare(plot, beam_directory):
    other = str(beam_directory / "coarse")
    assert plot("beam", "--compare", other) == ["beam_vs_coarse_curve.png", "beam_vs_coarse_mesh.png"]
    assert plot("beam", "--compare", other, "--field", "stress_xx") == ["beam_vs_coarse_stress_xx.png"]
    assert plot("beam", "--compare", other, "--history", "time", "cracks") == [
        "beam_vs_coarse_cracks_over_time.png"
    ]


@pytest.mark.parametrize("field", [None, "utilisation", "element:stress_xx", "opening", "fragment"])
def test_animation(plot, field):
    options = ["--animate", "growth.gif"] + (["--field", field] if field else [])
    assert plot("beam", *options) == ["growth.gif"]
    with Image.open(plot.output / "growth.gif") as image:
        assert image.n_frames == 7
        image.seek(1)
        early = np.asarray(image.convert("RGB")).astype(int)
        image.seek(6)
        late = np.asarray(image.convert("RGB")).astype(int)
    assert early.shape == late.shape
    assert (abs(early - late).max(axis=2) > 60).sum() > 100


def test_names_are_listed(plot):
    assert plot("beam", "--field", "?") == []
    assert "element:stress_xx" in plot.printed.split("\n")
    assert plot("beam", "--history", "?", "?") == []
    assert "PLATEN_rf2" in plot.printed.split("\n")


def test_the_output_directory_is_made(plot, beam_directory):
    directory = plot.output / "a" / "b"
    assert rfem_plot.main([str(beam_directory / "beam"), "--frame", "0", "--output", str(directory)]) == 0
    assert (directory / "beam_mesh_frame0.png").is_file()


def test_without_a_monitor_the_mesh_is_drawn_and_a_note_says_why(plot, tmp_path_factory):
    directory = tmp_path_factory.mktemp("other")
    synthetic.write_beam(directory, "a", nx=20, ny=6)
    synthetic.write_tables(directory, "a", monitors=False)
    assert plot("a", directory=directory) == ["a_mesh.png"]
    assert "rfem_plot: note: a has no monitor" in plot.notes


def test_without_frames_the_curve_is_drawn_and_a_note_says_why(plot, tmp_path_factory):
    directory = tmp_path_factory.mktemp("other")
    synthetic.write_tables(directory, "a", h5=False)
    assert plot("a", directory=directory) == ["a_curve.png"]
    assert "a.vtkhdf does not exist" in plot.notes


def test_a_run_that_has_not_finished_is_drawn_with_a_note(plot, tmp_path_factory):
    directory = tmp_path_factory.mktemp("other")
    program = (
        f"import sys; sys.path.insert(0, {str(SCRIPT.parent / 'tests')!r}); import os, signal, synthetic; "
        f"w = synthetic.write_beam({str(directory)!r}, 'a', nx=20, ny=6, swmr=True, close=False); "
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", program], check=False)
    assert plot("a", directory=directory) == ["a_curve.png", "a_mesh.png"]
    assert "a.vtkhdf, a_cracks.vtkhdf: not closed (the run goes on, or was killed)" in plot.notes


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--field", "utilization"],
            "no field utilization; did you mean utilisation? (fields: displacement, ",
        ),
        (["--frame", "99"], "beam.vtkhdf has no frame 99 (frames: 0 to 6, or -1 to -7 from the end)"),
        (["--time", "7"], "no frame near time 7 (frames: from 0 to 1)"),
        (["--time", "nan"], "--time must be a finite number"),
        (["--scale", "inf"], "--scale must be a finite number"),
        (["--scale", "big"], "argument --scale: invalid float value: 'big'"),
        (["--frame", "1", "--time", "1"], "argument --time: not allowed with argument --frame"),
        (["--history", "time", "PLATEN_rf3"], "no history column PLATEN_rf3; did you mean PLATEN_rf"),
        (["--history", "time"], "argument --history: expected 2 arguments"),
        (["--format", "jpg"], "argument --format: invalid choice: 'jpg'"),
        (["--animate", "a.mp4"], "--animate writes GIF: a.mp4 must end in .gif"),
        (["--animate", "a.gif", "--frame", "1"], "does not go with --frame"),
        (["--output", "z.png"], "--output names a folder, z.png looks like a picture"),
        (["--fild", "x"], "unrecognized arguments: --fild x"),
        (["--compare", "nothing"], "no results of nothing in"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(capsys, beam_directory, tmp_path, options, message):
    assert message in fails(capsys, beam_directory / "beam", "--output", tmp_path, *options)
    assert list(tmp_path.iterdir()) == []


def test_a_job_that_does_not_exist(capsys, beam_directory):
    assert "did you mean beam? (jobs there: beam, coarse)" in fails(capsys, beam_directory / "beem")


def test_no_job(capsys):
    assert "the following arguments are required: JOB" in fails(capsys)


def test_a_job_with_nothing_to_draw(capsys, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w"):
        pass
    assert "a.vtkhdf does not exist" in fails(capsys, tmp_path / "a", "--output", tmp_path)


def test_an_output_directory_that_cannot_be_made(capsys, beam_directory, tmp_path):
    (tmp_path / "file").write_text("")
    message = fails(capsys, beam_directory / "beam", "--output", tmp_path / "file")
    assert "cannot be created" in message
    message = fails(capsys, beam_directory / "beam", "--animate", tmp_path / "nowhere" / "a.gif")
    assert "cannot be written: No such file or directory" in message


@pytest.mark.parametrize(
    ("options", "place"),
    [
        (["--frame", "0"], "matplotlib.figure.Figure.savefig"),
        (["--animate", "a.gif"], "PIL.Image.Image.save"),
    ],
)
def test_a_full_disk_leaves_no_half_file(capsys, monkeypatch, beam_directory, tmp_path, options, place):
    def half(self, path, *args, **others):
        Path(path).write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(place, half)
    message = fails(capsys, beam_directory / "beam", "--output", tmp_path, *options)
    assert "cannot be written: No space left on device" in message
    assert list(tmp_path.iterdir()) == []


def test_as_a_program(beam_directory, tmp_path):
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(beam_directory / "beam"), "--frame", "0"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "wrote beam_mesh_frame0.png\n"
    assert size_and_colors(tmp_path / "beam_mesh_frame0.png")[0][0] > 2000


def test_a_missing_module_is_named(beam_directory, tmp_path):
    (tmp_path / "h5py.py").write_text("raise ModuleNotFoundError(\"No module named 'h5py'\", name='h5py')\n")
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "x"],
        env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("rfem_plot: error: Python has no module h5py; install what is needed with ")
    assert done.stderr.count("\n") == 1


def test_help(capsys):
    with pytest.raises(SystemExit) as left:
        rfem_plot.main(["--help"])
    assert left.value.code == 0
    text = capsys.readouterr().out
    for option in (
        "--field",
        "--frame",
        "--time",
        "--scale",
        "--animate",
        "--history",
        "--compare",
        "--format",
        "--output",
    ):
        assert option in text

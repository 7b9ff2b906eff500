#!/usr/bin/env python3
"""Draw the results of an rfem run.

rfem_plot.py JOB draws what one wants to see first: the deformed mesh with its cracks at the last frame, and
the load-displacement curve of the first monitor, as PNG. See README.md beside this file, or --help.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from rfem_command import leave_without

try:
    import rfem_curves
    import rfem_figures
    from rfem_results import Results, ResultsError, open_results
    from rfem_style import save
except ModuleNotFoundError as missing:
    leave_without("rfem_plot", missing)

EXAMPLES = """examples:
  rfem_plot.py beam                                  deformed mesh at the end, load-displacement curve
  rfem_plot.py out/beam --field utilisation --frame 0
  rfem_plot.py beam --field element:stress_xx --time 0.5 --scale 1
  rfem_plot.py beam --field opening --animate beam.gif
  rfem_plot.py beam --history time max_utilisation --format pdf
  rfem_plot.py beam --compare beam_edge              both meshes, and both curves in one diagram

fields: displacement, displacement_x, stress_xx, element:stress_xx, sigma1, sigma3, tau_max, utilisation,
material, fragment, opening, slip, mode ...: --field ? lists those of a frame, --history ? ? the columns.
"""

PICTURES = (".png", ".pdf", ".svg", ".gif", ".jpg", ".jpeg", ".eps", ".ps", ".tif", ".tiff")


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, like all of ours."""

    def error(self, message: str) -> NoReturn:
        """Leave with the message and status 2."""
        fail(f"{message} (see {self.prog} --help)")


def fail(message: str) -> NoReturn:
    """Leave with one line on standard error and status 2."""
    sys.stderr.write(f"rfem_plot: error: {' '.join(message.split())}\n")
    sys.exit(2)


def note(message: str) -> None:
    """Say something that is no error, on standard error."""
    sys.stderr.write(f"rfem_plot: note: {message}\n")


def make_parser() -> Parser:
    """The command line."""
    parser = Parser(
        prog="rfem_plot.py",
        description="Draw the results of an rfem run: by default the deformed mesh with its cracks at the "
        "last frame, and the load-displacement curve of the first monitor.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument(
        "job", metavar="JOB", help="job name, with its directory; one of its files will do as well"
    )
    parser.add_argument(
        "--field", metavar="NAME", help="colour the mesh, or the cracks, by a field; ? lists them"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="N", help="frame: 0 is the first, -1 (default) the last")
    which.add_argument(
        "--time", type=float, metavar="T", help="frame nearest to a time, the last one of that time"
    )
    parser.add_argument(
        "--scale", type=float, metavar="S", help="factor on displacements (default: automatic; 0: none)"
    )
    parser.add_argument("--animate", metavar="FILE.gif", help="draw all frames as an animation")
    parser.add_argument(
        "--history", nargs=2, metavar=("X", "Y"), help="draw two columns of the history; ? ? lists them"
    )
    parser.add_argument(
        "--compare", metavar="JOB2", help="draw a second job beside the first, in the same colours"
    )
    parser.add_argument(
        "--format", choices=("png", "pdf", "svg"), default="png", help="of pictures (default: png)"
    )
    parser.add_argument(
        "--output", metavar="DIR", default=".", help="where pictures go (default: working directory)"
    )
    return parser


def check_options(options: argparse.Namespace) -> None:
    """What argparse cannot say: combinations and values; ResultsError for what is wrong."""
    if options.animate is not None:
        for name, value in (
            ("--frame", options.frame),
            ("--time", options.time),
            ("--compare", options.compare),
        ):
            if value is not None:
                raise ResultsError(f"--animate draws all frames of one job: it does not go with {name}")
        if Path(options.animate).suffix.lower() != ".gif":
            raise ResultsError(f"--animate writes GIF: {options.animate} must end in .gif")
    output = Path(options.output)
    if output.suffix.lower() in PICTURES and not output.is_dir():
        raise ResultsError(
            f"--output names a folder, {output} looks like a picture: pictures get names that say what is in "
            "them, --format says of which kind they are"
        )
    for name, value in (("--time", options.time), ("--scale", options.scale)):
        if value is not None and not abs(value) < float("inf"):
            raise ResultsError(f"{name} must be a finite number, not {value}")


def wanted(options: argparse.Namespace) -> tuple[bool, bool]:
    """Whether a picture of the mesh and a curve are wanted: both, unless options ask for one of them."""
    mesh_options = (options.field, options.frame, options.time, options.scale)
    mesh = any(value is not None for value in mesh_options)
    curve = options.history is not None
    if options.animate is not None:
        return False, curve
    if not mesh and not curve:
        return True, True
    return mesh, curve


def frame_number(results: Results, options: argparse.Namespace) -> int:
    """Number of the frame that --frame or --time ask for; the last without them."""
    frames = results.frames
    if options.time is None:
        return frames.number(-1 if options.frame is None else options.frame)
    number = frames.at_time(options.time)
    found = float(frames.times[number])
    if abs(found - options.time) > 1e-6 * max(abs(found), abs(options.time)):
        note(
            f"{results.job} has no frame at time {options.time:g}: the nearest is frame {number} at {found:g}"
        )
    return number


def file_part(name: str) -> str:
    """A field's name as a part of a file name."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name)


def draw_mesh(jobs: Sequence[Results], options: argparse.Namespace, directory: Path) -> Path:
    """Draw the mesh of one or two jobs, in the scale that the one that moves more asks for."""
    asked = [
        rfem_figures.MeshOptions(options.field or "", frame_number(results, options), options.scale)
        for results in jobs
    ]
    views = [rfem_figures.make_view(results, choice) for results, choice in zip(jobs, asked)]
    scale = rfem_figures.common_scale(views)
    if len(views) > 1 and options.scale is None:
        views = [rfem_figures.make_view(results, choice, scale) for results, choice in zip(jobs, asked)]
    rfem_curves.common_units(jobs)
    name = "_vs_".join(results.job for results in jobs) + "_" + file_part(options.field or "mesh")
    if options.frame is not None or options.time is not None:
        name += f"_frame{views[0].frame.index}"
    return save(rfem_figures.mesh_figure(views), directory / f"{name}.{options.format}")


def draw_curve(jobs: Sequence[Results], options: argparse.Namespace, directory: Path) -> Path:
    """Draw the load-displacement curve, or any two columns, of one or two jobs."""
    if options.history is not None:
        curves = [rfem_curves.history_curve(results, *options.history) for results in jobs]
        ending = f"{curves[0].y}_over_{curves[0].x}"
    else:
        curves = [rfem_curves.load_displacement_curve(results) for results in jobs]
        ending = "curve"
    name = "_vs_".join(results.job for results in jobs) + "_" + file_part(ending)
    return save(rfem_curves.curve_figure(curves), directory / f"{name}.{options.format}")


def draw_animation(results: Results, options: argparse.Namespace, directory: Path) -> Path:
    """Draw all frames of a job as a GIF."""
    choice = rfem_figures.MeshOptions(options.field or "", -1, options.scale)
    return rfem_figures.animate(results, choice, directory / options.animate)


def draw_all(tasks: Sequence[Callable[[], Path]], needed: int) -> None:
    """Draw, and say what was written. Fewer than `needed` is an error; else what failed is worth a note."""
    errors = []
    for task in tasks:
        try:
            print(f"wrote {task()}")
        except ResultsError as error:
            errors.append(error)
    if len(tasks) - len(errors) < needed:
        raise errors[0]
    for error in errors:
        note(str(error))


def list_names(results: Results, options: argparse.Namespace) -> bool:
    """Answer --field ? and --history ? ?; whether one of them was asked."""
    if options.field == "?":
        print("\n".join(rfem_figures.names_of_fields(results, frame_number(results, options))))
    if options.history and "?" in options.history:
        print("\n".join(results.history.names))
    return options.field == "?" or bool(options.history and "?" in options.history)


def run(options: argparse.Namespace) -> None:
    """Draw what the options ask for and say which files were written."""
    check_options(options)
    jobs = [open_results(job) for job in (options.job, options.compare) if job is not None]
    if list_names(jobs[0], options):
        return
    mesh, curve = wanted(options)
    directory = Path(options.output)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultsError(f"{directory} cannot be created: {error.strerror or error}") from error
    tasks: list[Callable[[], Path]] = []
    if mesh:
        tasks.append(lambda: draw_mesh(jobs, options, directory))
    if options.animate is not None:
        tasks.append(lambda: draw_animation(jobs[0], options, directory))
    if curve:
        tasks.append(lambda: draw_curve(jobs, options, directory))
    both_by_default = mesh and curve and options.history is None
    draw_all(tasks, needed=1 if both_by_default else len(tasks))
    for results in jobs:
        for reason in results.unreadable:
            note(f"{reason} (what {results.job}_history.csv and the frames have is drawn)")
        if results.unfinished:
            files = ", ".join(results.unfinished)
            note(f"{files}: not closed (the run goes on, or was killed); what is there is drawn")
        results.close()


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns 0, or leaves with status 2 and one line on standard error."""
    options = make_parser().parse_args(arguments)
    try:
        run(options)
    except ResultsError as error:
        fail(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(main())

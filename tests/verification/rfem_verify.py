"""What a verification case works with: runs of rfem, rows of the table, figures and notes of the report.

A case is a folder input/verification/NAME with decks, a README.md and a check.py, which has

    TITLE = "Kirsch hole"       shown in the report
    SECTION = "elastic"         one of SECTIONS
    def check(case): ...        case is a Case; case.quick is True under --quick: leave out the long meshes

`./run verify NAME` runs check(case) in a process of its own:

    result = case.run("kirsch.inp", set={"N": 24}, name="n24")       what rfem_results.open_results returns
    case.value("hoop stress", computed, expected, tolerance=0.02, kind="exact", unit="MPa")
    case.at_most("nodal error / largest displacement", computed, 1e-9, kind="exact")
    case.order("hoop stress", sizes, errors, at_least=0.8)
    case.figure("field", figure, "caption")                          a figure of matplotlib

A row passes only if its comparison is true, so NaN never passes.
"""

import importlib.util
import json
import math
import os
import re
import shutil
import subprocess
import sys
import traceback
from pathlib import Path

import numpy as np

PROJECT = Path(__file__).resolve().parents[2]
CASES = PROJECT / "input" / "verification"
SECTIONS = {
    "elastic": "Elastic, dynamic, relaxation",
    "contact": "Contact",
    "strength": "Strength",
    "cracked": "Cracked bodies",
    "invariance": "Invariances and bookkeeping",
}
KINDS = {
    "exact": "a closed form, or what must hold exactly",
    "invariant": "two runs, or two ways, that must give the same",
    "code": "an independent program",
    "own": "our own converged figure",
    "trend": "experience: the right order of magnitude and the right sequence",
}
FIGURE_DPI = 110
FIGURE_BYTES = 80_000  # the report is committed
# what a crash looks like: never an exit status that was expected
CRASH = re.compile(r"Fortran runtime error|Backtrace for this error|Sanitizer|runtime error:|Error termination")

for folder in ("postproc", "tests/verification", "tests/support"):
    if str(PROJECT / folder) not in sys.path:
        sys.path.append(str(PROJECT / folder))


class VerifyError(Exception):
    """A check cannot be made; the text says why."""


def program():
    """The path of rfem: RFEM, which `./run verify` and CMake set."""
    return Path(os.environ.get("RFEM", PROJECT / "build" / "release" / "bin" / "rfem")).resolve()


def observed_order(sizes, errors):
    """Slope of log(error) over log(size) by least squares; NaN where an error is not a positive number."""
    sizes, errors = np.asarray(sizes, dtype=float), np.asarray(errors, dtype=float)
    if sizes.shape != errors.shape or len(sizes) < 2:
        raise VerifyError("an order needs as many errors as sizes, at least two")
    if not (np.isfinite(errors) & (errors > 0)).all():
        return math.nan
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


class Case:
    """One case while it is checked: collects rows, figures and notes."""

    def __init__(self, source, work, quick=False):
        self.source, self.work, self.quick = Path(source), Path(work), quick
        self.name = self.source.name
        self.rows, self.figures, self.notes = [], [], []
        self._logs = {}

    # ------------------------------------------------------------------------------------------ runs
    def run(self, deck, set=None, name=None, exit=0, threads=1, arguments=(), timeout=1800):  # noqa: A002
        """Run a deck of the case's folder (or any path); the results, opened.

        `set`: values of *PARAMETER; `name`: job name (the deck's without it); `exit`: the exit status that is expected.
        Where nothing is written (exit 2), None is returned.
        """
        import rfem_results

        job = name or Path(deck).stem
        command = [str(program()), str(deck), "--job", job, "--output", str(self.work), "--quiet"]
        command += [word for key, value in (set or {}).items() for word in ("--set", f"{key}={value}")]
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "OMP_WAIT_POLICY": "passive"}
        done = subprocess.run(
            [*command, *map(str, arguments)],
            cwd=self.work,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
        self._logs[job] = (done.stdout, done.stderr)
        if CRASH.search(done.stderr) or done.returncode != exit:
            raise VerifyError(
                f"{' '.join(command[1:2] + command[6:])}: exit status {done.returncode}, expected {exit}\n"
                f"{done.stdout[-1000:]}{done.stderr[-2000:]}"
            )
        try:
            return rfem_results.open_results(self.work / job)
        except rfem_results.ResultsError:
            if exit == 0:
                raise
            return None

    def tool(self, name, *arguments, timeout=1800):
        """What a program of tests/property prints; it stands in the build of rfem. Its exit status must be 0."""
        path = program().parents[1] / "tests" / "property" / name
        if not path.exists():
            raise VerifyError(f"{path} is not built (cmake --build FOLDER --target {name})")
        done = subprocess.run(
            [str(path), *map(str, arguments)],
            cwd=self.work,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
        if done.returncode != 0:
            raise VerifyError(f"{name}: exit status {done.returncode}\n{done.stdout[-1000:]}{done.stderr[-1000:]}")
        return done.stdout

    def log(self, name):
        """Standard output of the run of this job name."""
        return self._logs[name][0]

    def messages(self, name):
        """Standard error of the run of this job name: warnings and notes."""
        return self._logs[name][1]

    def digests(self, name):
        """Digests of the final displacements and topology of a run, from its log."""
        found = re.search(r"^digest displacements=([0-9A-F]{16}) topology=([0-9A-F]{16})$", self.log(name), re.M)
        if not found:
            raise VerifyError(f"the log of {name} has no digest")
        return found.groups()

    def edited(self, deck, *edits, name=None):
        """A copy of a deck in the work folder with words replaced: pairs (old, new), each old in the deck; its path."""
        text = (self.work / deck).read_text()
        for old, new in edits:
            if old not in text:
                raise VerifyError(f"{deck} has no {old!r}: the check must follow the deck")
            text = text.replace(old, new)
        path = self.work / (name or f"{Path(deck).stem}_edited.inp")
        path.write_text(text)
        return path

    # ------------------------------------------------------------------------------------------ rows
    def value(self, quantity, computed, expected, tolerance, kind, unit="", absolute=False):
        """A row: |computed - expected| <= tolerance, relative to |expected| unless `absolute`."""
        computed, expected = float(computed), float(expected)
        error = abs(computed - expected)
        if not absolute:
            if expected == 0:
                raise VerifyError(f"{quantity}: a relative error needs an expected value that is not 0; absolute=True")
            error /= abs(expected)
        limit = text_of_limit(tolerance, unit, absolute)
        shown = text_of_limit(error, unit, absolute)
        self._row(quantity, computed, number_text(expected), error <= tolerance, kind, unit, shown, limit)

    def at_most(self, quantity, computed, limit, kind, unit=""):
        """A row: computed <= limit."""
        self._row(quantity, float(computed), f"<= {number_text(limit)}", float(computed) <= limit, kind, unit)

    def at_least(self, quantity, computed, limit, kind, unit=""):
        """A row: computed >= limit."""
        self._row(quantity, float(computed), f">= {number_text(limit)}", float(computed) >= limit, kind, unit)

    def within(self, quantity, computed, low, high, kind, unit=""):
        """A row: low <= computed <= high."""
        passed = low <= float(computed) <= high
        self._row(quantity, float(computed), f"{number_text(low)} to {number_text(high)}", passed, kind, unit)

    def equal(self, quantity, computed, expected, kind="exact"):
        """A row for things that are equal or not: counts, words, digests."""
        self._row(quantity, str(computed), str(expected), bool(computed == expected), kind, "")

    def order(self, quantity, sizes, errors, at_least, kind="exact", unit="", label=None):
        """A row with the observed order of errors over element sizes, a note with the errors, a log-log figure."""
        slope = observed_order(sizes, errors)
        self.at_least(f"observed order: {quantity}", slope, at_least, kind)
        pairs = ", ".join(f"{error:.3g} at h = {size:.4g}" for size, error in zip(sizes, errors))
        self.note(f"Errors of {quantity}: {pairs}{' ' + unit if unit else ''}.")
        if math.isfinite(slope):
            self._order_figure(quantity, sizes, errors, slope, label)
        return slope

    def _row(self, quantity, computed, expected, passed, kind, unit, error="", tolerance=""):
        if kind not in KINDS:
            raise VerifyError(f"{quantity}: kind {kind!r} is none of {', '.join(KINDS)}")
        if any(row["quantity"] == quantity for row in self.rows):
            raise VerifyError(f"two rows are named {quantity!r}")
        text = computed if isinstance(computed, str) else number_text(computed)
        row = {"quantity": quantity, "computed": text, "expected": expected, "unit": unit}
        row.update(error=error, tolerance=tolerance, kind=kind, passed=bool(passed))
        self.rows.append(row)

    # ------------------------------------------------------------------------------------------ figures, notes
    def note(self, text):
        """A remark under the case's table."""
        self.notes.append(" ".join(text.split()))

    def figure(self, name, figure, caption, first=False):
        """Write a figure of matplotlib for the report; `first`: it stands at the top of the page as well."""
        path = self.work / f"{self.name}_{name}.png"
        figure.savefig(path, dpi=FIGURE_DPI, bbox_inches="tight", pad_inches=0.05)
        slim(path)
        self.figures.append({"file": path.name, "caption": " ".join(caption.split()), "first": first})
        import matplotlib.pyplot as plt

        plt.close(figure)

    def _order_figure(self, quantity, sizes, errors, slope, label):
        import matplotlib.pyplot as plt

        sizes, errors = np.asarray(sizes, dtype=float), np.asarray(errors, dtype=float)
        figure, axes = plt.subplots(figsize=(3.6, 2.8))
        axes.loglog(sizes, errors, "o-", label=f"rfem, order {slope:.2f}")
        for power, style in ((1, ":"), (2, "--")):
            axes.loglog(sizes, errors[-1] * (sizes / sizes[-1]) ** power, style, color="0.5", label=f"order {power}")
        axes.set_xticks(sizes, [f"{size:.3g}" for size in sizes])  # the default labels run into each other
        axes.xaxis.set_minor_locator(plt.NullLocator())
        axes.set_xlabel("element size h")
        axes.set_ylabel(label or f"error of {quantity}")
        axes.legend(fontsize=7)
        slug = re.sub(r"[^a-z0-9]+", "_", quantity.lower())[:30].strip("_")
        self.figure(f"order_{slug}", figure, f"Convergence of {quantity}.")


def number_text(value):
    """A number of the table: up to six digits."""
    return short(f"{float(value):.6g}")


def short(text):
    """Exponents without leading zeros: 1e-9, not 1e-09."""
    return re.sub(r"e([+-])0(?=\d)", r"e\1", text).replace("e+", "e")


def text_of_limit(value, unit, absolute):
    """An error or a tolerance: relative ones as per cent where that reads well."""
    if absolute:
        return short(f"{value:.3g}{' ' + unit if unit else ''}")
    if 1e-4 <= value < 1e4:
        return f"{100 * value:.3g} %"
    return short(f"{value:.3g}")


def slim(path):
    """Make a PNG small: a palette, then fewer pixels."""
    from PIL import Image

    colours = 256
    while path.stat().st_size > FIGURE_BYTES:
        image = Image.open(path).convert("RGB")
        if colours < 32:
            image = image.resize([int(0.8 * side) for side in image.size], Image.LANCZOS)
        image.quantize(max(colours, 32), dither=Image.Dither.NONE).save(path, optimize=True)
        colours //= 2


# ---------------------------------------------------------------------------------------------- one case
def load_check(source):
    """The module of a case's check.py; its title and section are looked at."""
    spec = importlib.util.spec_from_file_location(f"check_{source.name}", source / "check.py")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(source))
    spec.loader.exec_module(module)
    if getattr(module, "SECTION", None) not in SECTIONS:
        raise VerifyError(f"check.py of {source.name}: SECTION must be one of {', '.join(SECTIONS)}")
    if not isinstance(getattr(module, "TITLE", None), str):
        raise VerifyError(f"check.py of {source.name}: TITLE is missing")
    return module


def failed_row(message):
    """The row of a check that did not come to its end."""
    lines = [line for line in message.strip().splitlines() if line.strip()] or ["no message"]
    row = {"quantity": "check ran", "computed": lines[-1][:120], "expected": "no error", "unit": "", "error": ""}
    return {**row, "tolerance": "", "kind": "exact", "passed": False}


def check_case(source, work, quick):
    """Run one case; what is known of it, as written to rows.json."""
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(source, work, ignore=shutil.ignore_patterns("__pycache__"))
    case = Case(source, work, quick)
    record = {"case": case.name, "title": case.name, "section": "elastic", "quick": quick, "skipped": False}
    try:
        module = load_check(Path(source))
        record.update(title=module.TITLE, section=module.SECTION)
        record["skipped"] = quick and not getattr(module, "QUICK", True)
        if not record["skipped"]:
            module.check(case)
            if not case.rows:
                raise VerifyError("the check made no row")
    except Exception:  # a check that breaks is a row that fails
        message = traceback.format_exc()
        print(message, file=sys.stderr)
        case.rows.append(failed_row(message))
        record["message"] = message
    return {**record, "rows": case.rows, "figures": case.figures, "notes": case.notes}


def main():
    """rfem_verify.py SOURCE WORK [--quick]: one case in this process; `run` starts it."""
    source, work = Path(sys.argv[1]), Path(sys.argv[2])
    os.environ.setdefault("MPLBACKEND", "Agg")
    sys.modules["rfem_verify"] = sys.modules["__main__"]  # a check that imports it gets this one
    record = check_case(source, work, "--quick" in sys.argv[3:])
    (work / "rows.json").write_text(json.dumps(record, indent=1))


if __name__ == "__main__":
    main()

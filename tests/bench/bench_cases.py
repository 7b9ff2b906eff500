"""The parts of the benchmark. Each takes the Bench and returns figures (SI units of time and memory) for JSON."""

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ORDERINGS = ("HILBERT", "METIS", "NONE", "SHUFFLED")
FIRST_EVENTS = "rough block, first 20 events"


def step(bench):
    """Complete relaxation steps: sizes, threads, numberings; with 10 % of the nodes in contact pairs, all lone; with
    cracks that cross in one corner."""
    rows = []
    for size in bench.sizes:
        for threads in (1, 2):
            for ordering in ORDERINGS if threads == 1 else ORDERINGS[:2]:
                rows.append({"size": size, "threads": threads, "ordering": ordering, "cracked": ""})
            for cracked in ("CRACKED", "CROSSED"):
                rows.append({"size": size, "threads": threads, "ordering": "HILBERT", "cracked": cracked})
    for row in rows:
        words = "step", row["size"], row["ordering"], row["threads"], row["cracked"]
        row.update(bench.measure(*words))
        if row["threads"] == 1:
            continue
        others = 2 if row["cracked"] else 4
        again = [bench.measure(*words) for _ in range(others)]  # where a process's memory lies in the caches is luck
        row["steps"] = [row["step"], *[other["step"] for other in again]]
        if "whole_step" in row:
            row["ratios"] = [one["step"] / one["whole_step"] for one in (row, *again)]
        row["step"] = min(row["steps"])
    return rows


def look(bench):
    """Looks at the criterion, in units of steps measured in the same process."""
    return [
        {"size": size, "threads": threads} | bench.measure("look", size, threads)
        for size in bench.sizes
        for threads in (1, 2)
    ]


def event(bench):
    """Split events, without the relaxation."""
    events = 100 if bench.quick else 300
    return [
        {"size": size, "cracked": cracked} | bench.measure("event", size, events, cracked)
        for size in bench.sizes
        for cracked in ("", "CRACKED")
    ]


def growth(bench):
    """Steps before and after a mesh has grown by splitting, and after it was numbered anew."""
    return [{"size": size} | bench.measure("growth", size, 5) for size in bench.sizes[1:]]


def memory(bench):
    """Memory per element of the largest size, at work."""
    size = bench.sizes[-1]
    return {kind: bench.measure("memory", size, kind) for kind in ("elastic", "all")} | {"size": size}


# ---------------------------------------------------------------------------------------------- files
def grid(columns, rows):
    """Nodes and triangles of a rectangle 4 x 1 of cells cut by their diagonals."""
    i, j = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    points = np.column_stack([4 * i.ravel() / columns, j.ravel() / rows])
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    first = (i + j * (columns + 1)).ravel()
    lower = np.column_stack([first, first + 1, first + columns + 2])
    upper = np.column_stack([first, first + columns + 2, first + columns + 1])
    return points, np.stack([lower, upper], axis=1).reshape(-1, 3)


DECK = """*HEADING
A beam 4 x 1 of {elements} elements, held at its left end, pressed sideways on its right one
{mesh}*MATERIAL, NAME=ROCK
*ELASTIC
27400., 0.25
*SOLID SECTION, ELSET=ROCK, MATERIAL=ROCK
*NSET, NSET=FIXED, BOX
0., 0., 0., 1.
*NSET, NSET=END, BOX
4., 4., 0., 1.
*BOUNDARY
FIXED, 1, 2
*STEP, NAME=BEND
*STATIC
1., 1.
*RELAXATION, TOLERANCE={tolerance}, MAX ITERATIONS={limit}, CONTINUE=YES
*BOUNDARY
END, 2, 2, -1.E-4
*MONITOR, NAME=END, NSET=END
*END STEP
"""


def write_deck(bench, name, columns, rows, kind, tolerance="1.E-6", limit=2):
    """A deck with its mesh listed in it, or generated (*MESH)."""
    if kind == "generated":
        mesh = f"*MESH, SHAPE=RECTANGLE, TYPE=CPE3, ELSET=ROCK, PATTERN=DIAGONAL\n0., 0., 4., 1., {columns}, {rows}\n"
    else:
        points, triangles = grid(columns, rows)
        nodes = "\n".join(f"{n}, {x:.9g}, {y:.9g}" for n, (x, y) in enumerate(points.tolist(), 1))
        cells = "\n".join(f"{e}, {a}, {b}, {c}" for e, (a, b, c) in enumerate((triangles + 1).tolist(), 1))
        mesh = f"*NODE\n{nodes}\n*ELEMENT, TYPE=CPE3, ELSET=ROCK\n{cells}\n"
    path = bench.work / f"{name}.inp"
    text = DECK.format(elements=2 * columns * rows, mesh=mesh, tolerance=tolerance, limit=limit)
    path.write_text(text, encoding="utf-8")
    return path


def files(bench):
    """Read a large deck and write frames of it; times as the log tells them."""
    rows_up = 111 if bench.quick else 354
    figures = {"elements": 2 * 4 * rows_up * rows_up}
    for kind in ("listed", "generated"):
        deck = write_deck(bench, f"large_{kind}", 4 * rows_up, rows_up, kind)
        result = min((bench.run(deck) for _ in range(2)), key=lambda run: run["seconds"])
        model = re.search(r"read in (\S+) s", result["log"])
        figures[kind] = {
            "deck_bytes": deck.stat().st_size,
            "read": float(model.group(1)),
            "seconds": result["seconds"],
            "peak_bytes_per_element": result["memory"] / figures["elements"],
        } | phases(result["log"])
        for path in (bench.work / "runs").glob(f"large_{kind}*.vtkhdf"):
            figures[kind]["file_bytes"] = path.stat().st_size
    (bench.work / "large_listed.inp").unlink()
    figures["frame"] = figures["generated"]["output"] / 2  # of the start and of the end
    return figures


def phases(log):
    """The profile in the log: seconds of each phase; `of it contact after the step` is part of the relaxation."""
    line = re.search(r"^time: (.*)$", log, re.MULTILINE)
    words = line.group(1).replace(" (of it ", ", ").replace(")", "")
    found = re.findall(r"([a-z ]+?) (\S+) s(?:,|$)", words)
    return {name.strip(): float(value) for name, value in found}


# ---------------------------------------------------------------------------------------------- whole runs
def runs(bench):
    """The paper's beam and rough block, with the profile that the log tells."""
    cases = [("beam", "three_point_bending", 8 if bench.quick else 2, threads) for threads in (1, 2)]
    cases += [("rough block", "uniaxial_compression", 5 if bench.quick else 3, 2)]
    if bench.options.long:
        cases += [("beam", "three_point_bending", 1, 2), ("rough block", "uniaxial_compression", 2, 2)]
        cases += [(FIRST_EVENTS, "uniaxial_compression", 1, 2)]
    figures = []
    for name, deck, h, threads in cases:
        path = bench.root / "input" / "paper" / f"{deck}.inp"
        if not has_mesh(path.parent / "mesh", deck, h):
            figures.append({"name": name, "h": h, "threads": threads, "missing": True})
            continue
        if name == FIRST_EVENTS:
            path = cut_short(path, bench.work)
        result = bench.run(path, "--set", f"H={h}", "--job", f"{deck}_h{h}", threads=threads)
        log = result.pop("log")
        row = {"name": name, "h": h, "threads": threads} | result | {"phases": phases(log)}
        row["elements"] = int(re.search(r"model: \d+ nodes, (\d+) elements", log).group(1))
        row["events"] = int(re.search(r"^events: (\d+)", log, re.MULTILINE).group(1))
        row["iterations"] = last_iterations(log)
        row["updates_per_second"] = float(re.search(r"(\S+) element updates per second", log).group(1))
        row["digest"] = re.search(r"^digest (.*)$", log, re.MULTILINE).group(1)
        figures.append(row)
    return figures


def cut_short(path, folder):
    """A copy of a deck in a folder that ends its step after the first events: the whole run would take hours."""
    text = path.read_text()
    if "STOP DROP=0.3" not in text or "INPUT=mesh/" not in text:
        sys.exit(f"bench: {path} is not what bench_cases.py takes it for")
    text = text.replace("STOP DROP=0.3", "STOP DROP=0.3, MAX EVENTS=20")
    copy = folder / path.name
    copy.write_text(text.replace("INPUT=mesh/", f"INPUT={path.parent}/mesh/"))
    return copy


def has_mesh(folder, deck, h):
    """Whether there is a mesh of that size; one that is not shipped is made, where Gmsh is installed."""
    path = folder / f"{deck}_h{h}.inp"
    if not path.exists() and shutil.which("gmsh"):
        subprocess.run(["sh", "make_meshes.sh", deck, str(h)], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return path.exists()


def last_iterations(log):
    """Iterations of all rows of the log's table."""
    total = 0
    for line in log.splitlines():
        words = line.split()
        if len(words) > 12 and words[0].isdigit() and words[1].isdigit():
            total += int(words[6])
    return total


# ---------------------------------------------------------------------------------------------- equilibrium from rest
def stiffness(points, triangles):
    """Sparse stiffness of plane strain triangles, E = 27400, nu = 0.25, thickness 1."""
    from scipy.sparse import coo_matrix

    young, poisson = 27400.0, 0.25
    factor = young / ((1 + poisson) * (1 - 2 * poisson))
    law = factor * np.array([[1 - poisson, poisson, 0], [poisson, 1 - poisson, 0], [0, 0, (1 - 2 * poisson) / 2]])
    corner = points[triangles]
    after, before = np.roll(corner, -1, axis=1), np.roll(corner, 1, axis=1)
    b, c = after[:, :, 1] - before[:, :, 1], before[:, :, 0] - after[:, :, 0]
    area = 0.5 * np.abs(np.einsum("ei,ei->e", corner[:, :, 0], b))
    strain = np.zeros((len(triangles), 3, 6))
    strain[:, 0, 0::2], strain[:, 1, 1::2] = b, c
    strain[:, 2, 0::2], strain[:, 2, 1::2] = c, b
    strain /= 2 * area[:, None, None]
    blocks = np.einsum("eki,kl,elj,e->eij", strain, law, strain, area, optimize=True)
    unknown = np.stack([2 * triangles, 2 * triangles + 1], axis=2).reshape(-1, 6)
    i = np.repeat(unknown, 6, axis=1).ravel()
    j = np.tile(unknown, (1, 6)).ravel()
    n = 2 * len(points)
    return coo_matrix((blocks.ravel(), (i, j)), shape=(n, n)).tocsc()


def solve_directly(columns, rows):
    """Reaction of the right end and time of a sparse direct solution (SuperLU), assembly apart [s]."""
    from scipy.sparse.linalg import splu

    start = time.perf_counter()
    points, triangles = grid(columns, rows)
    k = stiffness(points, triangles)
    left = np.flatnonzero(points[:, 0] == 0)
    right = np.flatnonzero(points[:, 0] == 4)
    u = np.zeros(2 * len(points))
    u[2 * right + 1] = -1e-4
    held = np.concatenate([2 * left, 2 * left + 1, 2 * right + 1])
    free = np.setdiff1d(np.arange(len(u)), held)
    force = -(k @ u)[free]
    inner = k[free][:, free].tocsc()
    assembled = time.perf_counter()
    u[free] = splu(inner, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0).solve(
        force
    )
    solved = time.perf_counter()
    return {"reaction": (k @ u)[2 * right + 1].sum(), "assembly": assembled - start, "solve": solved - assembled}


def direct(bench):
    """Equilibrium of a beam from rest by relaxation and by direct solvers."""
    figures = []
    for rows in [18, 35] if bench.quick else [35, 79, 158]:
        deck = write_deck(bench, "rest", 4 * rows, rows, "generated", limit=1000000)
        row = {"elements": 8 * rows * rows} | solve_directly(4 * rows, rows)
        result = bench.run(deck)
        monitor = [line for line in result["log"].splitlines() if line.rstrip().endswith("settled")][-1].split()
        row["relaxation"] = phases(result["log"])["relaxation"]
        row["iterations"] = int(monitor[6])
        row["difference"] = abs(float(monitor[12]) / row["reaction"] - 1)
        figures.append(row | calculix(bench, rows))
    return figures


def calculix(bench, rows):
    """Time of CalculiX on the same beam, if it is there; it builds three-dimensional elements from plane ones."""
    name = "ccx_rest"
    points, triangles = grid(4 * rows, rows)
    nodes = "\n".join(f"{n}, {x:.9g}, {y:.9g}" for n, (x, y) in enumerate(points.tolist(), 1))
    cells = "\n".join(f"{e}, {a}, {b}, {c}" for e, (a, b, c) in enumerate((triangles + 1).tolist(), 1))
    left = "\n".join(str(n + 1) for n in np.flatnonzero(points[:, 0] == 0))
    right = "\n".join(str(n + 1) for n in np.flatnonzero(points[:, 0] == 4))
    text = f"*NODE\n{nodes}\n*ELEMENT, TYPE=CPE3, ELSET=ROCK\n{cells}\n"
    text += f"*NSET, NSET=FIXED\n{left}\n*NSET, NSET=END\n{right}\n"
    text += "*MATERIAL, NAME=ROCK\n*ELASTIC\n27400., 0.25\n*SOLID SECTION, ELSET=ROCK, MATERIAL=ROCK\n1.\n"
    text += (
        "*STEP\n*STATIC\n*BOUNDARY\nFIXED, 1, 2\nEND, 2, 2, -1.E-4\n*NODE PRINT, NSET=END, TOTALS=ONLY\nRF\n*END STEP\n"
    )
    (bench.work / f"{name}.inp").write_text(text, encoding="utf-8")
    start = time.perf_counter()
    try:
        done = subprocess.run(["ccx", name], cwd=bench.work, capture_output=True, check=False, timeout=300)
    except (OSError, subprocess.TimeoutExpired):
        return {}
    return {"calculix": time.perf_counter() - start} if done.returncode == 0 else {}


# ---------------------------------------------------------------------------------------------- peers
def peers(bench):
    """Akantu in an environment of its own; why not, if it cannot be had."""
    python = bench.work / "venv" / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(python.parents[1])], check=True)
    if subprocess.run([str(python), "-c", "import akantu"], capture_output=True, check=False).returncode != 0:
        command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "akantu", "meshio"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return {"missing": "not in the package index for this Python"}
    done = subprocess.run(
        [str(python), str(HERE / "peer_akantu.py"), *[str(size) for size in bench.sizes]],
        cwd=bench.work,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        return {"missing": "Akantu does not run here: " + (done.stderr.strip().splitlines() or ["?"])[-1]}
    rates = {
        words[1]: float(words[2])
        for words in (line.split() for line in done.stdout.splitlines())
        if words[:1] == ["akantu"]
    }
    return {"akantu": rates}


PARTS = {
    "step": step,
    "look": look,
    "event": event,
    "growth": growth,
    "memory": memory,
    "files": files,
    "runs": runs,
    "direct": direct,
}

"""What a split must keep, after thousands of random ones; JOB.mac read back."""

import re
import sys

import numpy as np
from rfem_verify import PROJECT, VerifyError

sys.path.append(str(PROJECT / "tests" / "results"))
import read_apdl

TITLE = "Bookkeeping of splits; the ANSYS file read back"
SECTION = "invariance"

BEAM = PROJECT / "input" / "paper" / "three_point_bending.inp"
PLAIN = "*OUTPUT, FIELD, FREQUENCY=10, EVENTS=1\n"


def check(case):
    """Random splits, then a broken beam in two formats."""
    wanted = 2000 if case.quick else 20000
    said = case.tool("random_splits", wanted)
    found = re.search(
        r"(\d+) random splits of (\d+) bodies.*types I, II, III, edge (\d+), (\d+), (\d+), (\d+); every invariant", said
    )
    if not found:
        raise VerifyError(f"random_splits does not say what it did: {said}")
    quantity = "random splits, all invariants kept after each"
    case.at_least(quantity, int(found[1]), wanted, kind="invariant")
    jump = re.search(r"largest force: (\S+)", said)
    quantity = "nodal forces just after a split against just before: largest jump / largest force"
    case.at_most(quantity, float(jump[1]), 1e-10, kind="invariant")
    case.note(
        f"{found[2]} random bodies; {found[3]}, {found[4]} and {found[5]} splits of type I, II and III, "
        f"{found[6]} along edges."
    )
    read_back(case)


def read_back(case):
    """Every frame of JOB.mac against the same frame of JOB.vtkhdf."""
    text = BEAM.read_text().replace("INPUT=mesh/", f"INPUT={BEAM.parent}/mesh/")
    (case.work / "beam.inp").write_text(text.replace(PLAIN, PLAIN.replace("EVENTS=1", "EVENTS=1, FORMAT=BOTH")))
    result = case.run("beam.inp", set={"H": 8}, name="beam")
    worst, stresses, same, interfaces = 0.0, 0.0, True, 0
    for index, frame in enumerate(result.frames):
        model = read_apdl.read(case.work / "beam.mac", index + 1)
        ids = frame.point_data["node_id"]
        same = same and list(model.nodes) == ids.tolist()
        same = same and np.array_equal(list(model.nodes.values()), frame.points)
        same = same and np.array_equal(list(model.triangles().values()), ids[frame.cells])
        crack = result.crack_frame(index)
        segments = 0 if crack is None else len(crack.cells)
        interfaces = len(model.interfaces("CRACK_TENSION"))
        same = same and interfaces == segments
        u, stress = np.array(list(model.displacement.values())), np.array(list(model.stress.values()))
        if np.abs(frame.displacement).max() > 0:
            worst = max(worst, np.abs(u - frame.displacement).max() / np.abs(frame.displacement).max())
            exact = frame.cell_data["stress"]
            stresses = max(stresses, np.abs(stress - exact).max() / np.abs(exact).max())
    quantity = f"JOB.mac, {len(result.frames)} frames: nodes, triangles, interfaces"
    case.equal(quantity, "as in JOB.vtkhdf" if same else "others", "as in JOB.vtkhdf", kind="invariant")
    case.at_most("JOB.mac: largest difference of displacements / largest", worst, 1e-12, kind="invariant")
    case.at_most("JOB.mac: largest difference of stresses / largest", stresses, 1e-6, kind="invariant")
    case.at_least("JOB.mac: broken interfaces in the last frame", interfaces, 10, kind="invariant")

"""Patch test with closed cracks that stick, through the body and inside it: the field of the body without them."""

import numpy as np

TITLE = "Patch test with closed cracks"
SECTION = "contact"

MODULUS, POISSON = 27400.0, 0.25
MESHES = [(8, 1), (11, 2), (5, 3)]  # cells along a side, seed
STATES = {"plane strain": "CPE3", "plane stress": "CPS3"}
STRESS = (-1.0, -0.5, 0.0)


def exact(points, state):
    """Displacements of the uniform field that is held at (0, 0) and, along y, at (100, 0)."""
    sxx, syy, _ = STRESS
    if state == "plane strain":
        e, nu = MODULUS / (1 - POISSON**2), POISSON / (1 - POISSON)
    else:
        e, nu = MODULUS, POISSON
    return points * np.array([(sxx - nu * syy) / e, (syy - nu * sxx) / e])


def check(case):
    """The worst of three meshes: nodes, stresses, tractions of the cracks."""
    for state, element in STATES.items():
        deck = case.edited("patch_closed_crack.inp", ("CPE3", element), name=f"closed_{element}.inp")
        errors, stresses, tractions, openings, results = [], [], [], [], []
        for n, seed in MESHES:
            result = case.run(deck, set={"N": n, "SEED": seed}, name=f"{element}_{n}")
            results.append(result)
            frame, cracks = result.frames[-1], result.cracks[-1]
            u = exact(frame.points, state)
            errors.append(np.abs(frame.displacement - u).max() / np.hypot(*u.T).max())
            stresses.append(np.abs(frame.cell_data["stress"][:, [0, 1, 3]] - STRESS).max())
            along = np.diff(cracks.points[cracks.cells], axis=1)[:, 0, :2]
            nx, ny = along[:, 1] / np.hypot(*along.T), -along[:, 0] / np.hypot(*along.T)
            tractions.append(
                np.abs(cracks.cell_data["normal_traction"] - (STRESS[0] * nx**2 + STRESS[1] * ny**2)).mean()
            )
            openings.append(np.abs(cracks.cell_data["slip"]).max() + cracks.cell_data["opening"].max())
        case.at_most(f"{state}: nodal error / largest displacement", max(errors), 1e-9, kind="exact")
        case.at_most(f"{state}: error of stresses / stress", max(stresses), 1e-6, kind="exact")
        largest = np.hypot(*u.T).max()
        case.at_most(f"{state}: opening and slip / largest displacement", max(openings) / largest, 1e-9, kind="exact")
    case.note(
        f"Mean error of the normal tractions along the cracks: {max(tractions):.2g} of the larger pressure. A pair of"
        " nodes at a bend or a crossing has one normal for all its edges, which mixes tractions there."
    )
    draw(case, results[:2])


def draw(case, results):
    """The cracks in two meshes, deformed."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(6.4, 3.0))
    for ax, result in zip(axes, results):
        frame, cracks = result.frames[-1], result.cracks[-1]
        scale = 8 / np.abs(frame.displacement).max()
        ax.triplot(*(frame.points + scale * frame.displacement).T, frame.cells, color="0.6", linewidth=0.6)
        place = cracks.points[:, :2]
        place = place + scale * exact(place, "plane stress")
        for line in cracks.cells:
            ax.plot(*place[line].T, color="k", linewidth=1.4)
        ax.set_aspect("equal")
        ax.axis("off")
    caption = "Two of the meshes, deformed (enlarged), with the cracks in them: nothing has opened or slipped."
    case.figure("meshes", figure, caption)

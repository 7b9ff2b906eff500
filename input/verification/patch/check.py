"""Patch test on three irregular meshes, both plane states, biaxial traction and shear."""

import numpy as np

TITLE = "Patch test"
SECTION = "elastic"

MODULUS, POISSON = 27400.0, 0.25
MESHES = [(8, 1), (11, 2), (5, 3)]  # cells along a side, seed
STATES = {"plane strain": "CPE3", "plane stress": "CPS3"}
LOADS = {"biaxial": (1.0, 0.5, 0.0), "shear": (0.0, 0.0, 0.3)}  # sxx, syy, sxy [MPa]


def exact(points, stress, state):
    """Displacements of the linear field that is held at (0, 0) and, along y, at (100, 0)."""
    sxx, syy, sxy = stress
    if state == "plane strain":
        e, nu = MODULUS / (1 - POISSON**2), POISSON / (1 - POISSON)
    else:
        e, nu = MODULUS, POISSON
    exx, eyy, gamma = (sxx - nu * syy) / e, (syy - nu * sxx) / e, 2 * (1 + nu) * sxy / e
    return np.column_stack([exx * points[:, 0] + gamma * points[:, 1], eyy * points[:, 1]])


def check(case):
    """Nodal errors relative to the largest displacement, the worst of three meshes."""
    meshes = []
    for load, stress in LOADS.items():
        for state, element in STATES.items():
            deck = case.edited(f"patch_{load}.inp", ("CPE3", element), name=f"{load}_{element}.inp")
            errors, stresses = [], []
            for n, seed in MESHES:
                values = {"N": n, "SEED": seed}
                if load == "shear":
                    values.update(F=30 / n, F_CORNER=15 / n)
                result = case.run(deck, set=values, name=f"{load}_{element}_{n}")
                frame = result.frames[-1]
                u = exact(frame.points, stress, state)
                errors.append(np.abs(frame.displacement - u).max() / np.hypot(*u.T).max())
                found = frame.cell_data["stress"][:, [0, 1, 3]]
                stresses.append(np.abs(found - stress).max() / max(map(abs, stress)))
                if load == "shear" and element == "CPS3":
                    meshes.append(frame)
            quantity = f"{load}, {state}: nodal error / largest displacement"
            case.at_most(quantity, max(errors), 1e-9, kind="exact")
            case.at_most(f"{load}, {state}: error of stresses / stress", max(stresses), 1e-6, kind="exact")
    draw(case, meshes)


def draw(case, frames):
    """The three meshes under shear."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(6.6, 2.3))
    for ax, frame in zip(axes, frames):
        scale = 10 / np.abs(frame.displacement).max()
        ax.triplot(*(frame.points + scale * frame.displacement).T, frame.cells, color="C0", linewidth=0.7)
        ax.set_aspect("equal")
        ax.axis("off")
    caption = "The three meshes under shear, displacements enlarged: all triangles are deformed alike."
    case.figure("meshes", figure, caption)

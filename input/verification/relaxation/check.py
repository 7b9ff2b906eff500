"""Relaxed beams against a sparse direct solution of the same triangles; iterations of ADAPTIVE."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

TITLE = "Dynamic relaxation against a direct solution"
SECTION = "elastic"

MODULUS, POISSON = 27400.0, 0.25
# elements: cells of the mesh, iterations from rest to 1e-6 that ADAPTIVE may take
MESHES = {"2k": (60, 15, 1700), "10k": (136, 34, 3500), "50k": (304, 76, 7800)}
DAMPINGS = ("ADAPTIVE", "KINETIC", "LOCAL", "VISCOUS")


def direct(points, cells):
    """Displacements (nodes, 2) of the supported beam, by a sparse factorisation."""
    corners = points[cells]
    b = np.roll(corners[:, :, 1], -1, 1) - np.roll(corners[:, :, 1], 1, 1)
    c = np.roll(corners[:, :, 0], 1, 1) - np.roll(corners[:, :, 0], -1, 1)
    area = 0.5 * (c[:, 2] * b[:, 1] - c[:, 1] * b[:, 2])
    strain = np.zeros((len(cells), 3, 6))
    strain[:, 0, 0::2], strain[:, 1, 1::2] = b, c
    strain[:, 2, 0::2], strain[:, 2, 1::2] = c, b
    strain /= (2 * area)[:, None, None]
    law = MODULUS / (1 - POISSON**2) * np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, (1 - POISSON) / 2]])
    stiffness = np.einsum("eki,kl,elj,e->eij", strain, law, strain, np.abs(area))
    dofs = (2 * cells[:, :, None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(dofs, 6, axis=1).ravel(), np.tile(dofs, (1, 6)).ravel()
    matrix = coo_matrix((stiffness.ravel(), (rows, columns))).tocsr()
    u = np.zeros(2 * len(points))
    fixed = np.zeros(2 * len(points), dtype=bool)
    pin, roller = (np.hypot(*(points - at).T).argmin() for at in ((50, 0), (350, 0)))
    load = np.flatnonzero((points[:, 1] == 100) & (np.abs(points[:, 0] - 200) <= 10.1))
    fixed[[2 * pin, 2 * pin + 1, 2 * roller + 1, *(2 * load + 1)]] = True
    u[2 * load + 1] = -0.05
    free = ~fixed
    u[free] = spsolve(matrix[free][:, free].tocsc(), -matrix[free][:, fixed] @ u[fixed])
    return u.reshape(-1, 2)


def check(case):
    """Errors at a tolerance of 1e-8 for every DAMPING; iterations to 1e-6."""
    iterations = {}
    for size in ("2k", "10k") if case.quick else MESHES:
        nx, ny, limit = MESHES[size]
        values, u = {"NX": nx, "NY": ny}, None
        for damping in ("ADAPTIVE",) if case.quick and size != "2k" else DAMPINGS:
            deck = case.edited("relaxation.inp", ("ADAPTIVE", damping), name=f"{damping}.inp".lower())
            result = case.run(deck, set=values, name=f"{damping}_{size}".lower(), timeout=1500)
            frame = result.frames[-1]
            if u is None:
                u = direct(frame.points, frame.cells)
            error = np.abs(frame.displacement - u).max() / np.hypot(*u.T).max()
            quantity = f"{damping}, {size} elements: largest error / largest displacement"
            case.at_most(quantity, error, 2e-6, kind="exact")
            iterations.setdefault(damping, {})[len(frame.cells)] = int(result.history["iterations"].sum())
        deck = "relaxation.inp"
        count = case.run(deck, set={**values, "TOLERANCE": 1e-6}, name=f"count_{size}").history["iterations"].sum()
        case.at_most(f"ADAPTIVE, {size} elements: iterations from rest to 1e-6", int(count), limit, kind="own")
    if not case.quick:
        draw(case, iterations)


def draw(case, iterations):
    """Iterations to 1e-8 over the number of elements."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(3.8, 2.8))
    for (damping, counts), style in zip(iterations.items(), ("o-", "s-", "^-", "v--")):
        axes.loglog(list(counts), list(counts.values()), style, label=damping, markersize=4)
    axes.set_xticks(list(counts), [f"{count:,}" for count in counts])
    axes.xaxis.set_minor_locator(plt.NullLocator())
    axes.set(xlabel="elements", ylabel="iterations from rest to 1e-8")
    axes.legend(fontsize=7)
    case.figure("iterations", figure, "Iterations from rest to a residual of 1e-8 on three meshes of the beam.")

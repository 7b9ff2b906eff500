"""Stiffness of a block cut by 0, 1, 2, 4, 8 closed cracks: contact adds no compliance."""

import re

import numpy as np

TITLE = "Block cut by closed cracks"
SECTION = "contact"

MODULUS, POISSON, WIDTH, HEIGHT, SHORTENING = 27400.0, 0.25, 50.0, 100.0, 0.01
EXPECTED = MODULUS / (1 - POISSON**2) * SHORTENING / HEIGHT * WIDTH  # force on the platen [N]
RULE = 1.24


def check(case):
    """Force on the platen against that of the uncut block."""
    text = (case.work / "closed_cracks.inp").read_text()
    blocks = re.findall(r"\*CRACK, NAME=C\d\n.*\n.*\n", text)
    counts, stiffness = [0, 1, 2, 4, 8], []
    for n in counts:
        deck = case.edited("closed_cracks.inp", *((block, "") for block in blocks[n:]), name=f"cracks_{n}.inp")
        result = case.run(deck, name=f"cracks_{n}")
        stiffness.append(-result.history["PLATEN_rf2"][-1] / EXPECTED)
        if n == 0:
            lost = constant_of(result.frames[-1])
            case.value("uncut block: stiffness / exact", stiffness[0], 1, tolerance=1e-9, kind="exact")
        else:
            quantity = f"{n} crack{'s' if n > 1 else ''}: stiffness / that of the uncut block"
            case.value(quantity, stiffness[-1] / stiffness[0], 1, tolerance=1e-9, kind="exact")
    draw(case, counts, np.array(stiffness), lost)


def constant_of(frame):
    """c of E_cut/E = 1/(1 + c/pf) if every edge of this mesh were a joint of stiffness pf E/h that gives along its
    normal only: h/A sum of L n_y^4, with h the mean edge length, L and n length and normal of the inner edges."""
    edges = np.sort(np.vstack([frame.cells[:, [0, 1]], frame.cells[:, [1, 2]], frame.cells[:, [2, 0]]]), axis=1)
    edges, times = np.unique(edges, axis=0, return_counts=True)
    along = np.diff(frame.points[edges][:, :, :2], axis=1)[:, 0]
    length = np.hypot(*along.T)
    inside = times == 2
    return (
        length.mean() / (WIDTH * HEIGHT) * (along[inside, 0] ** 4 / length[inside] ** 3).sum() * (1 - POISSON**2) ** -1
    )


def draw(case, counts, stiffness, lost):
    """Against joints with a penalty stiffness."""
    import matplotlib.pyplot as plt

    factor = np.logspace(0, 2, 100)
    figure, (left, right) = plt.subplots(1, 2, figsize=(6.6, 2.8), sharey=True)
    left.plot(counts, stiffness, "o-", label="rfem")
    left.set_xlabel("closed cracks through the block")
    left.set_ylabel("stiffness / that of the uncut block")
    left.set_xticks(counts)
    left.legend(fontsize=7)
    right.semilogx(factor, 1 / (1 + RULE / factor), color="C3", label="penalty joints, 1/(1 + 1.24/pf)")
    right.semilogx(factor, 1 / (1 + lost / factor), ":", color="C1", label=f"the same for this mesh, c = {lost:.2f}")
    right.axhline(1, color="C0", label="rfem")
    right.set_xlabel("penalty factor pf")
    right.set_ylim(0, 1.08)
    right.legend(fontsize=7)
    case.figure(
        "stiffness",
        figure,
        "Stiffness of the block. Left: rfem with more and more closed cracks. Right: what programs lose that put joints"
        " of stiffness pf E/h on the edges of a triangle mesh.",
        first=True,
    )
    loss = [100 * (1 - 1 / (1 + RULE / pf)) for pf in (2.5, 40)]
    case.note(
        f"1/(1 + 1.24/pf) loses {loss[0]:.0f} % at pf = 2.5 and {loss[1]:.0f} % at pf = 40; rfem loses nothing at any"
        " number of cracks."
    )

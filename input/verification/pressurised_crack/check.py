"""Opening of a crack under inner pressure against Sneddon's ellipse."""

import numpy as np

TITLE = "Pressurised crack"
SECTION = "contact"

BULK, SHEAR, PRESSURE = 16.7e9, 10e9, 2e6
YOUNG = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
POISSON = (3 * BULK - 2 * SHEAR) / (6 * BULK + 2 * SHEAR)
LARGEST = 4 * (1 - POISSON**2) * PRESSURE / YOUNG  # [m], a = 1 m


def openings(frame):
    """Places along the crack and the distance of its faces there [m]."""
    x, y = frame.points.T
    on = np.flatnonzero((np.abs(y) < 1e-9) & (np.abs(x) < 1 + 1e-9))
    places = np.unique(np.round(x[on], 6))
    uy = [frame.displacement[on[np.abs(x[on] - place) < 1e-5], 1] for place in places]
    return places, np.array([u.max() - u.min() for u in uy])


def check(case):
    """Largest opening, and the profile, on two meshes."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(5, 3))
    x = np.linspace(-1, 1, 201)
    axes.plot(x, 1e3 * LARGEST * np.sqrt(1 - x**2), "k-", linewidth=1, label="exact")
    errors = []
    for h in ("0.1", "0.05"):
        frame = case.run("pressurised.inp", set={"H": h}, name=f"h{h}").frames[-1]
        places, gap = openings(frame)
        errors.append(abs(gap.max() / LARGEST - 1))
        axes.plot(places, 1e3 * gap, "o", markersize=3, label=f"rfem, {h} m")
    case.value("largest opening, 40 edges along the crack", 1e3 * gap.max(), 1e3 * LARGEST, 0.03, kind="exact", unit="mm")
    case.order("largest opening", [0.1, 0.05], errors, at_least=0.8)
    axes.set(xlabel="x [m]", ylabel="opening [mm]")
    axes.legend(fontsize=7)
    figure.tight_layout()
    case.figure("opening", figure, "Opening of the crack under pressure.")

"""Stiffness of an elastic beam on three meshes."""

TITLE = "Elastic beam in three-point bending"
SECTION = "elastic"

FORCE = 1000.0  # N
HEIGHTS = [8, 16, 32]  # elements over the height of 40 mm


def timoshenko():
    """Stiffness [MN/m]: bending and shear, kappa = 5/6."""
    modulus, poisson, span, height, width = 26000.0, 0.2, 315.0, 40.0, 20.0
    inertia, area, shear_modulus = width * height**3 / 12, width * height, modulus / (2 * (1 + poisson))
    return 1e-3 / (span**3 / (48 * modulus * inertia) + span / (4 * 5 / 6 * shear_modulus * area))


def check(case):
    """The deflection of the neutral axis under the load, against that above the supports."""
    expected, errors = timoshenko(), {}
    for n in HEIGHTS[:2] if case.quick else HEIGHTS:
        history = case.run("beam.inp", set={"NX": 16 * n, "NY": n}, name=f"ny{n}").history
        stiffness = 1e-3 * FORCE / (history["ENDS_u2"][-1] - history["AXIS_u2"][-1])
        errors[40 / n] = abs(stiffness / expected - 1)
        if n == 16:
            case.value("stiffness, 16 elements over the height", stiffness, expected, 0.03, kind="exact", unit="MN/m")
    sizes = sorted(errors, reverse=True)
    falls = max(errors[fine] / errors[coarse] for coarse, fine in zip(sizes, sizes[1:]))
    case.at_most("error of a mesh / error of the next coarser one", falls, 1.0, kind="exact")
    case.note("Errors of the stiffness: " + ", ".join(f"{errors[h]:.2%} at h = {h:g} mm" for h in sizes) + ".")

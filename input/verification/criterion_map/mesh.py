"""Writes criterion_map_bodies.inp: hundreds of bodies of one triangle, every one with a stress state of its own.

A state is a polar angle a in the plane of the principal stresses, (s1, s3) = r (cos a, sin a), compression positive,
and a direction of the s1 axis. All nodes of a body are prescribed: displacements grow linearly, so its stress goes
along its ray from the origin, and reaches the envelope at a load factor of its own, (k - 1/2)/N for body k of N. The
order is shuffled.
"""

from pathlib import Path

import numpy as np

YOUNG, POISSON = 27400.0, 0.25
TENSILE, COHESION, PHI = 4.5, 10.0, np.radians(30)
CRITERIA = ("GRIFFITH", "CUTOFF")
STATES = [-130, -120, -110, -100, -90, -80, -70, -60, -50, -40, -30, -25, -20, -19, -18, -15, -10, -5, 0, 5, 10, 15]
DIRECTIONS = [3.0 + 30.0 * i for i in range(6)]  # degrees from x to the s1 axis; none along an edge of the triangle
SPACING = 3.0
CORNERS = np.array([[0.0, 0.0], [1.0, 0.1], [0.4, 0.95]])


def tension_radius(a):
    """r at which -s3 = sigma_t."""
    return TENSILE / -np.sin(a) if np.sin(a) < 0 else np.inf


def shear_radius(a):
    """r at which (s1 - s3)/2 = c cos phi + sin phi (s1 + s3)/2."""
    growth = (np.cos(a) - np.sin(a)) / 2 - np.sin(PHI) * (np.cos(a) + np.sin(a)) / 2
    return COHESION * np.cos(PHI) / growth if growth > 0 else np.inf


def envelope(criterion, a):
    """(r at first failure, its mode) on the ray of angle a."""
    tension, shear = tension_radius(a), shear_radius(a)
    if criterion == "GRIFFITH":  # Qiu & Ding 2007, eq. 2: tension where s1 < -3 s3, else shear
        return (tension, "tension") if np.cos(a) < -3 * np.sin(a) else (shear, "shear")
    return (tension, "tension") if tension <= shear else (shear, "shear")


def bodies():
    """Every body in order of its failure: a dictionary of what it is."""
    found = [
        {"criterion": criterion, "state": state, "direction": direction}
        for criterion in CRITERIA
        for state in STATES
        for direction in DIRECTIONS
    ]
    order = np.random.default_rng(1).permutation(len(found))
    for k, i in enumerate(order):
        body = found[i]
        body["factor"] = (k + 0.5) / len(found)
        body["r"], body["mode"] = envelope(body["criterion"], np.radians(body["state"]))
        body["corner"] = SPACING * np.array([i % 32, i // 32])
    return found


def displacements(body):
    """Of the three nodes at load factor 1 (plane strain)."""
    a, t = np.radians(body["state"]), np.radians(body["direction"])
    axes = np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]])
    stress = -axes @ np.diag(body["r"] * np.array([np.cos(a), np.sin(a)])) @ axes.T  # tension positive
    strain = (1 + POISSON) / YOUNG * (stress - POISSON * np.trace(stress) * np.eye(2))
    return CORNERS @ strain / body["factor"]


def write(folder):
    """Nodes, elements, sets of the two criteria, displacements; the number of bodies."""
    found = bodies()
    nodes, elements, held = ["*NODE"], {c: [] for c in CRITERIA}, ["*BOUNDARY"]
    for i, body in enumerate(found):
        elements[body["criterion"]].append(f"{i + 1}, {3 * i + 1}, {3 * i + 2}, {3 * i + 3}")
        for k, (point, u) in enumerate(zip(body["corner"] + CORNERS, displacements(body)), 3 * i + 1):
            nodes.append(f"{k}, {point[0]:.15g}, {point[1]:.15g}")
            held += [f"{k}, {dof}, {dof}, {u[dof - 1]:.17g}" for dof in (1, 2)]
    lines = nodes
    for criterion in CRITERIA:
        lines += [f"*ELEMENT, TYPE=CPE3, ELSET={criterion}", *elements[criterion]]
    (folder / "criterion_map_bodies.inp").write_text("\n".join(lines) + "\n")
    (folder / "criterion_map_displacements.inp").write_text("\n".join(held) + "\n")
    return len(found)


if __name__ == "__main__":
    print(write(Path.cwd()), "bodies")

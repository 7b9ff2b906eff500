"""The same deck in rfem and in CalculiX."""

import ccx_case

TITLE = "CalculiX: plane stress"
SECTION = "elastic"


def check(case):
    """Displacements node by node."""
    ccx_case.check(case, tolerance=0.02)

"""The same deck in rfem and in CalculiX."""

import ccx_case

TITLE = "CalculiX: plate with a hole"
SECTION = "elastic"


def check(case):
    """Displacements node by node."""
    ccx_case.check(case, tolerance=1e-5)

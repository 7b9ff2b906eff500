"""What the commands of this folder share."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NoReturn


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, like all of ours."""

    def error(self, message: str) -> NoReturn:
        """Leave with the message and status 2."""
        name = Path(self.prog).stem
        sys.stderr.write(f"{name}: error: {' '.join(message.split())} (see {self.prog} --help)\n")
        sys.exit(2)


def leave_without(command: str, missing: ModuleNotFoundError) -> NoReturn:
    """Leave with one line on how to get a Python package that is not there, and status 2."""
    packages = Path(__file__).resolve().parent / "requirements.txt"
    sys.stderr.write(
        f"{command}: error: Python has no module {missing.name}; install what is needed with "
        f"'{sys.executable} -m pip install -r {packages}', or let RFEM_PYTHON name a Python that has it "
        f"({command.replace('_', '-')} asks for it)\n"
    )
    sys.exit(2)

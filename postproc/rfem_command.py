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

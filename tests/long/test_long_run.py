"""The quick part of the long runs: ./run long is the whole of it."""

import os
import subprocess
import sys
from pathlib import Path


def test_first_events(tmp_path):
    script = Path(os.environ["RFEM_SOURCE_DIR"]) / "tests" / "long" / "long_run.py"
    done = subprocess.run(
        [sys.executable, script, "--quick", "--output", tmp_path], capture_output=True, text=True, timeout=1000
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tmp_path / "long_run.png").stat().st_size > 10000

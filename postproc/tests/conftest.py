import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
sys.path.insert(0, str(Path(__file__).resolve().parent))

import pytest
import synthetic


@pytest.fixture(scope="session")
def beam_directory(tmp_path_factory):
    """Results of a beam with a crack (job beam) and of a coarser one (job coarse); do not write there."""
    directory = tmp_path_factory.mktemp("results")
    synthetic.write_beam(directory, "beam", nx=40, ny=10)
    synthetic.write_beam(directory, "coarse", nx=20, ny=6)
    return directory


@pytest.fixture
def beam(beam_directory):
    import rfem_results

    with rfem_results.open_results(beam_directory / "beam") as results:
        yield results

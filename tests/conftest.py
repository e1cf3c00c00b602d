"""Fixtures shared by all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Matrices in tests are small. Where several programs run, the waiting threads of BLAS would fight for the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# How long an example takes depends on what else the machine does; speed is measured in benchmarks/.
settings.register_profile("chladni", deadline=None)
settings.load_profile("chladni")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured logs; tests that need it are skipped with a reason where it is absent."""
    beside_the_project = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("CHLADNI_DATA", beside_the_project))
    # A folder that may not be looked into counts as absent, where is_dir would raise.
    if not os.access(folder, os.R_OK | os.X_OK):
        pytest.skip(f"measured logs not found in {folder}; set CHLADNI_DATA to their folder")
    return folder

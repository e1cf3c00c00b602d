"""Fixtures shared by all tests."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

# Matrices in tests are small. Where several programs run, the waiting threads of BLAS would fight for the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# How long an example takes depends on what else the machine does; speed is measured in benchmarks/.
# Few inputs of each property in the gate; beside the nightly tests, `--hypothesis-profile=many`.
settings.register_profile("chladni", deadline=None, max_examples=25)
settings.register_profile("many", deadline=None)
settings.load_profile("chladni")


@pytest.fixture(scope="session", autouse=True)
def one_thread_a_worker(request: pytest.FixtureRequest) -> Iterator[None]:
    """Where tests run on all cores already, a diagnosis takes one; tests of its threads ask for them."""
    with pytest.MonkeyPatch.context() as patch:
        if hasattr(request.config, "workerinput"):
            patch.setattr("chladni.gap.side_by_side.threads", lambda: 1)
        yield


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured logs; tests that need it are skipped with a reason where it is absent."""
    beside_the_project = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("CHLADNI_DATA", beside_the_project))
    # A folder that may not be looked into counts as absent, where is_dir would raise.
    if not os.access(folder, os.R_OK | os.X_OK):
        pytest.skip(f"measured logs not found in {folder}; set CHLADNI_DATA to their folder")
    return folder

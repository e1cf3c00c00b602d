"""Fixtures shared by all tests."""

import gc
import os
import signal
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest
from _pytest.doctest import DoctestModule
from hypothesis import settings

# Matrices in tests are small. Where several programs run, the waiting threads of BLAS would fight for the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

TESTS = Path(__file__).parent

# How long an example takes depends on what else the machine does; speed is measured in benchmarks/.
# Few inputs of each property in the gate; beside the nightly tests, `--hypothesis-profile=many`.
settings.register_profile("chladni", deadline=None, max_examples=12)
settings.register_profile("many", deadline=None)
settings.load_profile("chladni")


class Examples:
    """Modules without an example are not searched for one: that would take a tenth of the collection."""

    @pytest.hookimpl(wrapper=True)
    def pytest_collect_file(self, file_path: Path) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
        """Leave out what could collect nothing; no test module has examples in its docstrings."""
        return [one for one in (yield) if not (isinstance(one, DoctestModule) and _has_no_example(file_path))]


def _has_no_example(path: Path) -> bool:
    return path.is_relative_to(TESTS) or b">>>" not in path.read_bytes()


def pytest_configure(config: pytest.Config) -> None:
    """Heed that outside of this folder, too."""
    config.pluginmanager.register(Examples())
    # A shell has it ignored in what runs in its background, and Ctrl-C would be in all that tests start.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What is collected is no garbage, which isn't searched for meanwhile."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Each worker begins elsewhere in a folder, and finds compiled what another one met before it."""
    report = yield
    worker = getattr(collector.config, "workerinput", None)
    if worker and isinstance(collector, pytest.Dir) and report.passed:
        first = len(report.result) * int(worker["workerid"].removeprefix("gw")) // worker["workercount"]
        report.result = [*report.result[first:], *report.result[:first]]
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Workers agree on one order, whichever they collected in."""
    items.sort(key=lambda item: item.path.parts)


def pytest_collection_finish() -> None:
    """Tests and modules live to the end: each page that is closed would look through a million objects of theirs."""
    gc.collect()
    gc.freeze()


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

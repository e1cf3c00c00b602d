"""Linear algebra works in one thread where it is asked to, and gives the others back."""

import os
import subprocess
import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import chladni
from chladni.signals.linear_algebra import in_one_thread
from tests import made_diagnosis as made


def threads() -> list[int]:
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]


class StoppedError(Exception):
    """Ends a diagnosis at its first step."""


def test_a_diagnosis_takes_one_thread_and_gives_the_others_back_when_it_fails() -> None:
    np.linalg.norm(np.eye(2))
    seen: list[list[int]] = []

    def stop(_step: str, _share: float) -> None:
        seen.append(threads())
        raise StoppedError

    with threadpool_limits(limits=2, user_api="blas"):
        before = threads()
        with pytest.raises(StoppedError):
            chladni.diagnose_gap(made.arm_model(), made.log_series(), progress=stop)
        assert threads() == before
    assert [set(one) for one in seen] == [{1}]
    assert 2 in before


def test_it_is_a_decorator_as_often_as_it_is_called() -> None:
    told = in_one_thread()(threads)
    with threadpool_limits(limits=2, user_api="blas"):
        assert set(told()) == set(told()) == {1}
        assert 2 in threads()


def test_the_library_that_scipy_brings_is_limited_too_though_nobody_has_loaded_it_yet() -> None:
    script = (
        "import sys\n"
        "from threadpoolctl import threadpool_info\n"
        "from chladni.signals.linear_algebra import in_one_thread\n"
        "assert 'scipy.linalg' not in sys.modules\n"
        "with in_one_thread():\n"
        "    import scipy.linalg\n"
        "    print(*{pool['num_threads'] for pool in threadpool_info() if pool['user_api'] == 'blas'})\n"
    )
    environment = dict(os.environ, OPENBLAS_NUM_THREADS="2")
    told = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert told.stdout.split() == ["1"]

"""A process that keeps its memory doesn't ask the system for pages again and again."""

import platform
import subprocess
import sys

import pytest

COUNT = """
import resource
import sys
import numpy as np
from chladni.gap.kept_memory import keep_memory

if sys.argv[1] == "keep":
    assert keep_memory()
np.ones(200_000).sum()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(100):
    # Two at a time, as expressions have them.
    first = np.ones(200_000)
    (first + 1.0).sum()
    del first
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(how: str) -> int:
    done = subprocess.run([sys.executable, "-c", COUNT, how], check=True, capture_output=True, text=True)
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="glibc's malloc")
def test_arrays_take_the_memory_of_those_before() -> None:
    # An array has 391 pages: two are asked for at first, then none.
    assert faults("keep") < 2000 < faults("leave")

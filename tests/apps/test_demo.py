import numpy as np
import pytest
from scipy.signal import find_peaks

from chladni.apps.demo import _local_maxima, _prominence


@pytest.mark.parametrize("seed", range(5))
def test_peaks_and_their_prominences_are_those_of_scipy(seed):
    level = np.cumsum(np.random.default_rng(seed).standard_normal(300))
    lines, shape = find_peaks(level, prominence=0)
    assert _local_maxima(level) == lines.tolist()
    np.testing.assert_array_equal([_prominence(level, line) for line in lines], shape["prominences"])

"""Windows against SciPy's and against the literature."""

import numpy as np
import pytest
from scipy.signal import get_window

from chladni.signals.errors import SetupError
from chladni.spectral.windows import noise_bandwidth_bins, window_name, window_samples

OURS = ["boxcar", "hann", "hamming", "blackman", "blackmanharris", "nuttall", "flattop", "rectangular", "hanning"]


@pytest.mark.parametrize("samples", [7, 64, 1023])
@pytest.mark.parametrize("name", OURS)
def test_own_windows_are_scipys(name, samples):
    scipys = get_window({"rectangular": "boxcar", "hanning": "hann"}.get(name, name), samples)
    # Sums of up to five cosines whose arguments, up to 8 pi, are rounded too.
    np.testing.assert_allclose(window_samples(name, samples), scipys, rtol=0, atol=16 * np.finfo(float).eps)


@pytest.mark.parametrize("window", ["bartlett", ("kaiser", 8.6), ("tukey", 0.25), ("gaussian", 12.0), "parzen"])
def test_any_other_window_comes_from_scipy(window):
    np.testing.assert_array_equal(window_samples(window, 100), get_window(window, 100))


@pytest.mark.parametrize(
    ("window", "bandwidth"),
    [("boxcar", 1.0), ("hann", 1.5), ("hamming", 1.36), ("blackmanharris", 2.0), ("flattop", 3.77)],
)
def test_noise_bandwidths_are_harris(window, bandwidth):
    # Harris (1978), table 1, gives two decimals.
    assert noise_bandwidth_bins(window_samples(window, 4096)) == pytest.approx(bandwidth, abs=0.01)


@pytest.mark.parametrize("window", ["hnan", ("kaiser",), ("kaiser", "wide"), "", ()])
def test_a_window_that_is_none_is_named(window):
    with pytest.raises(SetupError, match="can't be used"):
        window_samples(window, 64)


def test_a_misspelt_window_gets_a_hint():
    with pytest.raises(SetupError, match="did you mean hann"):
        window_samples("hnan", 64)


def test_a_window_that_sums_to_nothing_is_refused():
    with pytest.raises(SetupError, match="no finite, non-zero sum"):
        window_samples(("kaiser", float("nan")), 64)


def test_names_are_written_plainly():
    assert window_name("rect") == "boxcar"
    assert window_name(("tukey", 0.25)) == "tukey 0.25"


def test_parameters_may_stand_behind_the_name():
    np.testing.assert_array_equal(window_samples("kaiser 8.6", 64), window_samples(("kaiser", 8.6), 64))
    with pytest.raises(SetupError, match="'force \\+ 5/s' can't be used"):
        window_samples("force + 5/s", 64)


@pytest.mark.parametrize("window", ["kaiser", ("kaiser", "wide")])
def test_a_window_without_its_parameters_says_how_they_are_given(window):
    with pytest.raises(SetupError, match=r"such as 'kaiser 8\.6'"):
        window_samples(window, 64)

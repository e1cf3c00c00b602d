"""Random errors of frequency responses in closed form."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.frf_error import periodic_response_std, response_std
from tests.spectral.made_signals import noise, series


def test_one_reference_is_bendat_and_piersols_error():
    # eps = sqrt(1 - c) / (sqrt(c) sqrt(2 n)) of |H|, with n - 1 for n.
    c, g_xx, g_yy, averages = 0.8, 2.0, 5.0, 21.0
    magnitude = np.sqrt(c * g_yy / g_xx)
    std = response_std(np.array((1 - c) * g_yy), np.array(1 / g_xx), averages=averages, references=1)
    assert float(std) / magnitude == pytest.approx(np.sqrt(1 - c) / np.sqrt(c * 2 * 20), rel=1e-12)


def test_too_few_averages_leave_the_error_open():
    one = np.ones(3)
    assert np.all(np.isinf(response_std(one, one, averages=2.0, references=2)))


def test_the_scatter_of_periods_needs_periods():
    spectra = cross_spectra(series(noise(2, 1000)), resolution_hz=10.0)
    with pytest.raises(EstimateError, match="periodic averages only"):
        periodic_response_std(spectra, np.ones((1, 51), dtype=complex), 0, [1])

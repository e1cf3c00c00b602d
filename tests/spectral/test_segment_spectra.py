"""Transforms of segments against one transform at a time."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.signal import detrend as scipy_detrend

from chladni.spectral import segment_spectra as module
from chladni.spectral.segment_spectra import run_all, segment_spectra
from chladni.spectral.segmentation import Segmentation
from tests.spectral.made_signals import noise


@pytest.mark.parametrize("samples", [32, 33])
@pytest.mark.parametrize("detrend", ["none", "constant", "linear"])
@pytest.mark.parametrize("group_samples", [1, 100, 1 << 18])
def test_each_segment_is_detrended_windowed_and_transformed(samples, detrend, group_samples, monkeypatch):
    monkeypatch.setattr(module, "GROUP_SAMPLES", group_samples)
    values = noise(2, 500) + np.linspace(3, 8, 500)
    window = np.hanning(samples)
    plan = Segmentation(samples=samples, hop=10, detrend=detrend)
    with ThreadPoolExecutor(2) as executor:
        spectra = segment_spectra(values, plan, window, executor)
    assert spectra.shape == (samples // 2 + 1, plan.count(500), 2)
    for segment in range(plan.count(500)):
        piece = values[:, 10 * segment : 10 * segment + samples]
        flat = piece if detrend == "none" else scipy_detrend(piece, type=detrend)
        np.testing.assert_allclose(spectra[:, segment].T, np.fft.rfft(flat * window), rtol=0, atol=1e-12)


def test_single_precision_is_computed_in_double():
    values = noise(1, 64).astype(np.float32)
    plan = Segmentation(samples=64, hop=64)
    expected = segment_spectra(values.astype(np.float64), plan, np.ones(64))
    np.testing.assert_array_equal(segment_spectra(values, plan, np.ones(64)), expected)


def test_errors_in_a_thread_are_raised():
    def fail(start):
        raise ZeroDivisionError(start)

    with ThreadPoolExecutor(1) as executor, pytest.raises(ZeroDivisionError):
        run_all(fail, [1, 2], executor)

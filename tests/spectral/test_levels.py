"""Levels against closed forms and SciPy."""

import numpy as np
import pytest
from scipy import stats

from chladni.signals.errors import EstimateError
from chladni.spectral.levels import MOST_WINDOWS, levels
from tests.spectral.made_signals import blocks, noise, series

NAMES = ("mean", "rms", "peak", "peak_to_peak", "crest_factor", "skewness", "kurtosis")


def sine(samples=20_000, *, rate_hz=1000.0, frequency_hz=25.0):
    return 2.0 * np.sin(2 * np.pi * frequency_hz * np.arange(samples) / rate_hz)


def test_levels_of_a_sine_and_of_a_square_wave_are_the_closed_forms():
    square = np.where(np.arange(20_000) // 10 % 2, 5.0, -1.0)
    found = levels(series([9.81 + sine(), square]))
    expected = {
        "mean": (9.81, 2.0),
        "rms": (np.sqrt(2), 3.0),
        "peak": (2.0, 3.0),
        "peak_to_peak": (4.0, 6.0),
        "crest_factor": (np.sqrt(2), 1.0),
        "skewness": (0.0, 0.0),
        "kurtosis": (1.5, 1.0),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(getattr(found, name)[:, 0], values, rtol=1e-9, atol=1e-9, err_msg=name)
    assert found.bands_hz == ((0.0, 500.0),)
    assert found.samples.tolist() == [[20_000], [20_000]]


def test_moments_are_those_of_scipy_however_the_stream_is_cut():
    # Lopsided and heavy-tailed, far from zero: what one-pass sums of powers lose their digits on.
    values = np.exp(noise(2, 40_000)) + 1e4
    whole = series(values)
    for found in (levels(whole), levels(blocks(whole, [1, 63, 64, 130, 9000]))):
        np.testing.assert_allclose(found.rms[:, 0], values.std(axis=1), rtol=1e-10)
        np.testing.assert_allclose(found.skewness[:, 0], stats.skew(values, axis=1), rtol=1e-9)
        np.testing.assert_allclose(found.kurtosis[:, 0], stats.kurtosis(values, axis=1, fisher=False), rtol=1e-9)


def test_running_levels_follow_the_signal_in_bounded_memory():
    rate_hz = 200.0
    values = sine(400_000, rate_hz=rate_hz) * np.repeat([1.0, 3.0], 200_000)
    found = levels(series(values, rate_hz=rate_hz)).running
    assert MOST_WINDOWS / 2 < found.time_s.size <= MOST_WINDOWS
    # 64 samples, joined until 400 000 fit.
    assert found.window_s == 512 / rate_hz
    assert found.time_s[0] == pytest.approx(256 / rate_hz)
    first, second = found.time_s < 990, found.time_s > 1010
    np.testing.assert_allclose(found.rms[0, 0, first], np.sqrt(2), rtol=1e-9)
    np.testing.assert_allclose(found.rms[0, 0, second], 3 * np.sqrt(2), rtol=1e-9)
    np.testing.assert_allclose(found.peak[0, 0, second], 6.0, rtol=1e-2)
    asked = levels(series(values[:4000], rate_hz=rate_hz), running_s=1.0).running
    assert (asked.window_s, asked.time_s.size) == (1.0, 20)


def test_the_stated_error_of_the_rms_is_its_scatter():
    found = [levels(series(noise(4, 5000, seed=seed))) for seed in range(20)]
    rms, std = (np.concatenate([getattr(one, name)[:, 0] for one in found]) for name in ("rms", "rms_std"))
    # Of 80 records: the scatter's own relative error is 1 / sqrt(160).
    assert rms.std() == pytest.approx(1 / np.sqrt(2 * 5000), rel=0.3)
    assert np.sqrt(np.mean(std**2)) == pytest.approx(rms.std(), rel=0.3)


def test_bands_of_white_noise_hold_what_the_filters_bandwidth_passes():
    found = levels(series(noise(1, 200_000)), bands_hz=[(20.0, 100.0), (100.0, 200.0)])
    # Noise bandwidth of a Butterworth band-pass of order n: B (pi / 2n) / sin(pi / 2n) (Bendat & Piersol 2010, 8.6).
    widths = np.array([80.0, 100.0]) * (np.pi / 6) / np.sin(np.pi / 6)
    np.testing.assert_allclose(found.rms[0], np.sqrt(widths / 500), atol=5 * found.rms_std[0].max())
    assert found.rms.shape == (1, 2)
    assert [note.partition(":")[0] for note in found.notes] == ["band 20 to 100 Hz", "band 100 to 200 Hz"]


def test_a_gap_costs_its_own_channel_only_and_a_still_one_has_no_shape():
    values = np.stack([sine(), np.full(20_000, 0.1), sine()])
    valid = np.ones(values.shape, dtype=bool)
    valid[0, 40:80], values[0, 40:80] = False, np.nan
    found = levels(series(values, valid=valid))
    assert found.samples[:, 0].tolist() == [19_960, 20_000, 20_000]
    # One period of 40 samples is missing.
    np.testing.assert_allclose(found.rms[[0, 2], 0], np.sqrt(2), rtol=1e-9)
    assert (found.rms[1, 0], found.peak[1, 0]) == (0.0, 0.0)
    assert all(np.isnan(getattr(found, name)[1, 0]) for name in ("crest_factor", "skewness", "kurtosis"))
    valid[0] = False
    none = levels(series(values, valid=valid))
    assert none.samples[0, 0] == 0
    assert all(np.isnan(getattr(none, name)[0, 0]) for name in NAMES)
    assert np.isnan(none.running.rms[0]).all()


def test_levels_scale_with_the_signal_and_shapes_do_not():
    found, scaled = levels(series(noise(1, 5000))), levels(series(noise(1, 5000) * 1e50))
    for name in NAMES:
        size = 1e50 if name in ("mean", "rms", "peak", "peak_to_peak") else 1.0
        np.testing.assert_allclose(getattr(scaled, name), size * getattr(found, name), rtol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("values", "options", "words"),
    [
        (noise(1, 100), {"bands_hz": []}, "no band is given"),
        (noise(1, 100), {"integrations": 1}, "begins above 0 Hz"),
        (noise(1, 100), {"running_s": 0.01}, r"64 samples, 0\.064 s, are the least"),
        (np.full((1, 100), np.nan), {}, "without being marked invalid"),
        (np.full((1, 100), 1e100), {}, "is the most that can be worked with"),
        (np.full((1, 100), 1e-100), {}, "is the least that can be worked with"),
        (np.empty((1, 0)), {}, "there is no sample"),
    ],
)
def test_what_has_no_levels_is_refused(values, options, words):
    with pytest.raises(EstimateError, match=words):
        levels(series(values), **options)


def test_a_record_without_a_valid_sample_is_refused():
    with pytest.raises(EstimateError, match="no sample is a number"):
        levels(series(np.full((1, 100), np.nan), valid=np.zeros((1, 100), dtype=bool)))

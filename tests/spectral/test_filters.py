"""Filters against the closed form of their designs, and their transients against what they leave."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from chladni.signals.errors import EstimateError
from chladni.spectral.filters import bandpass, bandstop, highpass, lowpass
from tests.spectral.made_signals import noise, series

RATE_HZ = 1000.0


def butterworth(frequency_hz, corner_hz, order):
    """Squared gain of a low-pass by the bilinear transform: 1 / (1 + (tan(pi f/fs) / tan(pi fc/fs))^(2 n))."""
    warped = np.tan(np.pi * frequency_hz / RATE_HZ) / np.tan(np.pi * corner_hz / RATE_HZ)
    return 1 / (1 + warped ** (2 * order))


def of_tone(x, frequency_hz):
    """Complex amplitude of a tone of whole periods in samples 2000 to 8000."""
    t = np.arange(2000, 8000) / RATE_HZ
    return 2 * np.mean(x[2000:8000] * np.exp(-2j * np.pi * frequency_hz * t))


def tone(frequency_hz):
    return series(np.cos(2 * np.pi * frequency_hz * np.arange(10_000) / RATE_HZ))


@pytest.mark.parametrize("frequency_hz", [10.0, 40.0, 50.0, 80.0])
def test_without_phase_shift_a_tone_has_the_squared_gain_of_the_design(frequency_hz):
    found = lowpass(tone(frequency_hz), high_hz=50.0).series.values[0]
    assert of_tone(found, frequency_hz) == pytest.approx(butterworth(frequency_hz, 50.0, 4), abs=1e-9)


def test_a_causal_filter_has_the_gain_of_the_design_and_its_delay():
    found = of_tone(lowpass(tone(50.0), high_hz=50.0, causal=True).series.values[0], 50.0)
    # At its corner a Butterworth filter of order n is 3 dB down and n times 45 degrees late.
    assert found == pytest.approx(np.sqrt(0.5) * np.exp(-1j * np.pi), abs=1e-9)


@pytest.mark.parametrize("causal", [False, True])
def test_kinds_and_corners_are_those_of_scipy(causal):
    x = noise(1, 4000)
    sections = butter(3, [100.0, 200.0], btype="bandpass", output="sos", fs=RATE_HZ)
    expected = (sosfilt if causal else sosfiltfilt)(sections, x[0])
    found = bandpass(series(x), band_hz=(100.0, 200.0), order=3, causal=causal)
    np.testing.assert_allclose(found.series.values[0, 1000:-1000], expected[1000:-1000], atol=1e-9)
    assert found.band_hz == (100.0, 200.0)


def test_what_one_lets_pass_the_other_stops():
    both = series(sum(np.cos(2 * np.pi * f * np.arange(10_000) / RATE_HZ) for f in (10.0, 100.0)))
    assert abs(of_tone(highpass(both, low_hz=40.0).series.values[0], 10.0)) < 1e-4
    assert abs(of_tone(highpass(both, low_hz=40.0).series.values[0], 100.0)) == pytest.approx(1, abs=1e-3)
    stopped = bandstop(both, band_hz=(80.0, 120.0)).series.values[0]
    assert abs(of_tone(stopped, 100.0)) < 1e-4
    assert abs(of_tone(stopped, 10.0)) == pytest.approx(1, abs=1e-3)


def test_a_step_overshoots_behind_butterworth_and_not_behind_bessel():
    step = series(np.repeat([0.0, 1.0], 2000))
    highest = {
        design: lowpass(step, high_hz=20.0, design=design, causal=True).series.values.max()
        for design in ("butterworth", "bessel")
    }
    # Order 4: 10.8 % and 0.8 % (Zverev 1967, Handbook of Filter Synthesis, figures of step responses).
    assert highest["butterworth"] == pytest.approx(1.108, abs=0.003)
    assert highest["bessel"] == pytest.approx(1.008, abs=0.002)


@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("design", ["butterworth", "bessel"])
def test_past_the_told_edges_what_was_before_hardly_matters(design, causal):
    x = noise(1, 20_000)
    whole = lowpass(series(x), high_hz=5.0, design=design, causal=causal)
    cut = lowpass(series(x[:, 10_000:]), high_hz=5.0, design=design, causal=causal)
    apart = np.abs(whole.series.values[0, 10_000:] - cut.series.values[0])
    start, end = (round(edge * RATE_HZ) for edge in whole.edges_s)
    assert (end == 0) == causal
    largest = np.abs(x).max()
    # Twice: what was there and what the filter made up instead are both as large as the samples at most.
    assert apart[start : x.shape[1] - 10_000 - end].max() < 0.02 * largest
    # Told isn't far more than true: halfway through the edge it does matter.
    assert apart[: start // 2].max() > 0.02 * largest * 0.5


def test_nothing_is_carried_across_a_gap_and_a_short_run_is_left_out():
    x = noise(1, 9000)
    valid = np.ones(x.shape, dtype=bool)
    valid[0, [30, 5000]] = False
    gapped = np.where(valid, x, np.nan)
    for one in (series(gapped, valid=valid), series(gapped)):
        found = lowpass(one, high_hz=20.0)
        assert not found.series.valid[0, [*range(31), 5000]].any()
        assert np.isnan(found.series.values[0, [*range(31), 5000]]).all()
        alone = lowpass(series(x[:, 5001:]), high_hz=20.0)
        np.testing.assert_array_equal(found.series.values[0, 5001:], alone.series.values[0])
        assert "30 samples in runs shorter than" in found.notes[-1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"band_hz": (0.0, 100.0)}, "between 0 and half the sample rate, 500 Hz"),
        ({"band_hz": (200.0, 100.0)}, "must rise"),
        ({"band_hz": (100.0, 500.0)}, "between 0 and half"),
        ({"band_hz": (100.0, np.nan)}, "between 0 and half"),
        ({"band_hz": (100.0, 200.0), "order": 0}, "order is 0"),
        ({"band_hz": (100.0, 200.0), "design": "cauer"}, "none of butterworth, bessel"),
        ({"band_hz": (0.01, 0.02)}, "no unbroken run lasts"),
    ],
)
def test_what_cannot_be_filtered_is_refused(options, words):
    with pytest.raises(EstimateError, match=words):
        bandpass(series(noise(1, 1000)), **options)

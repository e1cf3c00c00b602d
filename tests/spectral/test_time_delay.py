"""Correlation against SciPy, and delays against noise that is shifted by known times."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.fft

from chladni.signals.errors import EstimateError
from chladni.spectral.time_delay import time_delay
from tests.spectral.made_signals import noise, series

RATE_HZ = 1000.0


def delayed(x, delay_s):
    """Shift a periodic record by any time, exactly."""
    frequency_hz = np.fft.rfftfreq(x.size, 1 / RATE_HZ)
    spectrum = np.fft.rfft(x) * np.exp(-2j * np.pi * frequency_hz * delay_s)
    return np.fft.irfft(spectrum, x.size)


def smooth_noise(samples, seed=0):
    """Noise up to 300 Hz: nothing at half the sample rate, where a shift can't be told."""
    spectrum = np.fft.rfft(noise(1, samples, seed=seed)[0])
    spectrum[np.fft.rfftfreq(samples, 1 / RATE_HZ) > 300] = 0
    return np.fft.irfft(spectrum, samples)


@pytest.mark.parametrize("delay_s", [0.0, 0.0123456, -0.2, 0.00037])
@pytest.mark.parametrize("sign", [1.0, -3.0])
def test_a_delay_is_found_between_samples_within_its_error(delay_s, sign):
    x = smooth_noise(30_000)
    late = sign * delayed(x, delay_s) + 0.3 * noise(1, x.size, seed=9)[0]
    found = time_delay(series(np.stack([x, late]), rate_hz=RATE_HZ), references="a", longest_delay_s=0.5)
    assert found.inverted == (sign < 0,)
    assert abs(found.delay_s[0] - delay_s) < 4 * found.std_s[0]
    assert 0 < found.std_s[0] < 2e-5
    assert found.notes == ()


def test_the_error_bar_is_the_scatter():
    x = smooth_noise(8000)
    noisy = [delayed(x, 0.01) + 0.5 * noise(1, x.size, seed=20 + trial)[0] for trial in range(40)]
    one = series(np.stack([x, *noisy]), rate_hz=RATE_HZ, names=[f"c{row}" for row in range(41)], units=["m/s^2"] * 41)
    found = time_delay(one, references="c0", longest_delay_s=0.05)
    # A standard deviation of 40 trials scatters by 1/sqrt(80): three of them, and as much for the bars' own scatter.
    assert np.std(found.delay_s) / found.std_s.mean() == pytest.approx(1, abs=0.4)


def test_a_band_without_the_disturbance_tells_the_delay_that_the_whole_does_not():
    x = smooth_noise(30_000)
    loud = 30 * np.sin(2 * np.pi * 50 * np.arange(x.size) / RATE_HZ)
    pair = series(np.stack([x + loud, delayed(x, 0.007) + np.roll(loud, 3)]), rate_hz=RATE_HZ)
    found = time_delay(pair, references="a", band_hz=(100.0, 250.0), longest_delay_s=0.1)
    assert found.delay_s[0] == pytest.approx(0.007, abs=1e-5)
    whole = time_delay(pair, references="a", longest_delay_s=0.1)
    assert "the delay may be that one" in whole.notes[0]


def test_a_resonance_is_no_delay_and_is_told():
    x = smooth_noise(30_000)
    ratio = np.fft.rfftfreq(x.size, 1 / RATE_HZ) / 80
    swinging = np.fft.irfft(np.fft.rfft(x) / (1 - ratio**2 + 0.1j * ratio), x.size)
    found = time_delay(series(np.stack([x, swinging]), rate_hz=RATE_HZ), references="a", longest_delay_s=0.1)
    assert "resonances or several paths: choose a band without" in found.notes[-1]
    assert found.std_s[0] > 1e-5


def test_over_a_gap_nothing_is_correlated():
    x = smooth_noise(12_000)
    pair = np.stack([x, delayed(x, 0.02)])
    pair[1, 3000:3100] = np.nan
    found = time_delay(series(pair, rate_hz=RATE_HZ), references="a", longest_delay_s=0.1, band_hz=(10.0, 250.0))
    assert found.delay_s[0] == pytest.approx(0.02, abs=1e-6)


def test_a_delay_beyond_the_longest_is_refused_with_where_it_is():
    x = smooth_noise(8000)
    pair = series(np.stack([x, delayed(x, 0.005)]), rate_hz=RATE_HZ)
    with pytest.raises(EstimateError, match=r"no peak .* within 0.001 s, and the highest, 1.00, lies at 0.005 s"):
        time_delay(pair, references="a", longest_delay_s=0.001, band_hz=(10.0, 250.0))
    found = time_delay(pair, references="a", longest_delay_s=0.006, band_hz=(10.0, 250.0))
    assert found.delay_s[0] == pytest.approx(0.005, abs=1e-6)


def test_a_weaker_path_is_found_where_a_stronger_one_is_excluded():
    x = smooth_noise(20_000)
    both = 0.5 * delayed(x, 0.01) + delayed(x, 0.2)
    found = time_delay(
        series(np.stack([x, both]), rate_hz=RATE_HZ), references="a", longest_delay_s=0.05, band_hz=(10.0, 250.0)
    )
    assert found.delay_s[0] == pytest.approx(0.01, abs=3e-4)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"references": "z"}, "no channel 'z'"),
        ({"references": "a", "responses": "a"}, "no channel but a is there"),
        ({"references": "a", "band_hz": (300.0, 100.0)}, "isn't one within 0 to 500 Hz"),
        ({"references": "a", "longest_delay_s": 60.0}, "must lie within the record, 4 s without a gap"),
        ({"references": "a", "longest_delay_s": 0.0}, "the longest lag is 0 s"),
        ({"references": "a", "responses": "c"}, "c never changes"),
    ],
)
def test_what_has_no_delay_is_refused(options, words):
    x = np.stack([*noise(2, 4000), np.ones(4000)])
    with pytest.raises(EstimateError, match=words):
        time_delay(series(x, rate_hz=RATE_HZ), **({"responses": "b"} | options))


def test_the_reference_is_transformed_once_and_anew_where_other_samples_count(monkeypatch):
    x = smooth_noise(4000, seed=3)
    rows = np.stack([x, *(delayed(x, shift) for shift in (0.004, 0.007, 0.011))])
    valid = np.ones(rows.shape, dtype=bool)
    valid[2, 3000:] = False
    record = replace(series(rows, rate_hz=RATE_HZ), valid=valid)
    names = [channel.name for channel in record.channels]
    alone = [time_delay(record, references=names[0], responses=name) for name in names[1:]]
    lengths = []
    transform = scipy.fft.rfft

    def counted(x, n=None, **how):
        # Those of segments, for the phase, state no length.
        lengths.extend([] if n is None else [n])
        return transform(x, n, **how)

    monkeypatch.setattr(scipy.fft, "rfft", counted)
    together = time_delay(record, references=names[0])
    np.testing.assert_array_equal(together.delay_s, np.concatenate([one.delay_s for one in alone]))
    np.testing.assert_allclose(together.delay_s, (0.004, 0.007, 0.011), atol=1e-5)
    # Of the reference and of its response; the second response has fewer samples, the third has all again.
    assert len(lengths) == 6
    lengths.clear()
    time_delay(replace(record, valid=None), references=names[0])
    assert len(lengths) == 4

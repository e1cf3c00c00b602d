import numpy as np
import pytest

from chladni.modal.operational import narrow_band_kurtosis
from chladni.modal.operational.narrow_band_kurtosis import chance_of_kurtosis, independent_samples, narrow_bands
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from tests.modal.truth import ModalTruth, ambient_record

LIGHT = ModalTruth(frequency_hz=np.array([1.0]), damping_ratio=np.array([0.003]), shapes=np.ones((1, 1)))


def series_of(*rows, rate_hz=100.0, valid=None):
    channels = tuple(Channel(name=f"a{row}", unit="m/s^2") for row in range(len(rows)))
    return TimeSeries(values=np.stack(rows), sample_rate_hz=rate_hz, channels=channels, valid=valid)


@pytest.mark.nightly
@pytest.mark.parametrize("samples", [16, 32, 128])
@pytest.mark.parametrize("chance", [1e-2, 1e-3])
def test_the_chance_of_a_low_kurtosis_is_never_understated(samples, chance):
    rng = np.random.default_rng(samples)
    powers = rng.exponential(size=(200_000, samples))
    # As `narrow_bands` frees it of its bias.
    kurtosis = 1.5 * (samples + 1) / samples * np.mean(powers**2, axis=1) / np.mean(powers, axis=1) ** 2
    share = np.mean(chance_of_kurtosis(kurtosis, np.float64(samples)) <= chance)
    # Three sigma of a count of rare events, and the factor 1.4 that is promised.
    assert share <= 1.4 * chance + 3 * np.sqrt(chance / 200_000)
    # It isn't overstated so much that the test could not find anything.
    assert share >= 0.2 * chance


def test_the_chance_falls_with_the_kurtosis_and_is_one_half_or_more_at_noise():
    chances = chance_of_kurtosis(np.array([1.5, 1.6, 2.0, 2.5, 3.0, 4.0, np.nan]), np.full(7, 50.0))
    assert np.all(np.diff(chances) >= 0)
    assert chances[-1] == 1.0
    assert chances[4] == chances[5] == 0.5


def test_a_sine_has_the_kurtosis_of_a_sine_and_noise_that_of_noise():
    rng = np.random.default_rng(3)
    time_s = np.arange(40_000) / 100
    bands = narrow_bands(series_of(np.sin(2 * np.pi * 12.5 * time_s), rng.standard_normal(time_s.size)), 400)
    # 199 segments: (n + 1)/n on top of the sine's 1.5.
    np.testing.assert_allclose(bands.kurtosis[0, 50], 1.5 * 200 / 199, rtol=1e-9)
    # Variance of mean(u^2)/mean(u)^2 is 4/n for exponential u; 190 lines are averaged.
    inner = bands.kurtosis[1, 5:-1]
    assert abs(inner.mean() - 3.0) < 4 * 3 / np.sqrt(199 * inner.size / 2)


def test_a_light_mode_gives_as_few_independent_samples_as_its_kurtosis_scatters():
    rng = np.random.default_rng(4)
    found = []
    for _ in range(200):
        record = ambient_record(LIGHT, cycles=2000, rng=rng)
        bands = narrow_bands(record, 320)
        line = int(np.argmin(np.abs(bands.frequency_hz - 1.0)))
        found.append(bands.kurtosis[0, line])
    told = independent_samples(bands, 0.003)[line]
    # The variance of the kurtosis is (3/2)^2 4/n; from 200 runs its own relative error is 2/sqrt(200) and more, for
    # the kurtosis itself is skewed. And it's well below the number of segments.
    assert 9 / np.var(found) == pytest.approx(told, rel=0.5)
    assert told < 0.6 * bands.segments


def test_the_bands_of_a_record_are_the_same_in_one_piece_and_in_many(monkeypatch):
    series = series_of(*np.random.default_rng(5).standard_normal((2, 4000)))
    whole = narrow_bands(series, 100)
    monkeypatch.setattr(narrow_band_kurtosis, "SAMPLES_TOGETHER", 1000)
    parts = narrow_bands(series, 100)
    # The same terms in another order of summation.
    np.testing.assert_allclose(parts.kurtosis, whole.kurtosis, rtol=1e-12)
    assert parts.segments == whole.segments == 79


def test_segments_that_touch_invalid_samples_are_left_out():
    values = np.random.default_rng(6).standard_normal((1, 4000))
    valid = np.ones(values.shape, dtype=bool)
    valid[0, 1950:2050] = False
    values[~valid] = np.nan
    bands = narrow_bands(series_of(*values, valid=valid), 100)
    assert bands.segments == 2 * 38
    assert np.all(np.isfinite(bands.kurtosis))


def test_a_record_without_two_segments_is_refused():
    with pytest.raises(EstimateError, match="no run of valid samples holds two segments of 100"):
        narrow_bands(series_of(np.ones(120)), 100)

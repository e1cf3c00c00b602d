import numpy as np
import pytest
from scipy.signal import welch

from chladni.models.effects.band_noise import BandNoise
from chladni.signals.errors import ModelError

NOISE = BandNoise(level=0.3, low_hz=5.0, high_hz=60.0, seed=7)
RATE_HZ = 400.0
TIMES_S = np.arange(24_000) / RATE_HZ


def test_level_and_band_are_those_asked_for() -> None:
    found = NOISE(TIMES_S)
    # 55 Hz over 60 s: 3300 independent squares, so the RMS scatters by 1/(2 sqrt(3300)) = 0.9 %; four sigma.
    assert np.std(found) == pytest.approx(0.3, rel=0.035)
    frequency_hz, density = welch(found, RATE_HZ, nperseg=800)
    inside = (frequency_hz > 7) & (frequency_hz < 58)
    outside = (frequency_hz < 3) | (frequency_hz > 62)
    assert np.sum(density[outside]) < 1e-4 * np.sum(density[inside])
    assert np.median(density[inside]) == pytest.approx(0.09 / 55.0, rel=0.15)


def test_the_same_time_always_gives_the_same_value() -> None:
    whole = NOISE(TIMES_S)
    np.testing.assert_allclose(NOISE(TIMES_S[9000:9700]), whole[9000:9700], atol=1e-10)
    scattered = TIMES_S[[3, 77, 12_000, 23_999]]
    np.testing.assert_allclose(NOISE(scattered), whole[[3, 77, 12_000, 23_999]], atol=1e-10)
    np.testing.assert_allclose(NOISE(TIMES_S[:1]), whole[:1], atol=1e-12)


def test_it_is_the_sum_of_its_lines() -> None:
    frequency_hz, phase = NOISE.lines()
    t = 3.217
    wanted = 0.3 * np.sqrt(2 / frequency_hz.size) * np.cos(2 * np.pi * frequency_hz * t + phase).sum()
    assert NOISE(np.array([t]))[0] == pytest.approx(wanted, rel=1e-10)
    assert np.all((frequency_hz >= 5.0) & (frequency_hz <= 60.0))


def test_another_seed_is_another_noise() -> None:
    other = BandNoise(level=0.3, low_hz=5.0, high_hz=60.0, seed=8)
    correlation = np.corrcoef(NOISE(TIMES_S), other(TIMES_S))[0, 1]
    assert abs(correlation) < 4 / np.sqrt(3300)


def test_it_is_normally_distributed() -> None:
    found = NOISE(TIMES_S)
    kurtosis = np.mean(found**4) / np.mean(found**2) ** 2
    # Of 3300 independent values the kurtosis scatters by sqrt(24/3300) = 0.085.
    assert kurtosis == pytest.approx(3.0, abs=0.35)


def test_a_rate_too_low_for_the_band_is_refused() -> None:
    with pytest.raises(ModelError, match=r"up to 60 Hz would alias at 100 Hz: simulate at 120 Hz or more"):
        NOISE(np.arange(50) / 100.0)


def test_hours_are_summed_in_pieces_without_a_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = NOISE(TIMES_S)
    monkeypatch.setattr("chladni.models.effects.band_noise._BLOCKS", 3)
    np.testing.assert_allclose(NOISE(TIMES_S), whole, rtol=1e-12, atol=1e-12)

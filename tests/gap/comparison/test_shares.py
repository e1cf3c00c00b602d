from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.gap.comparison.shares import Variable, band_shares, channel_gaps, gap_map, pooled_gap, regime_shares
from chladni.signals.errors import EstimateError
from tests.gap.made_log import white_floor

RATE_HZ, SAMPLES = 200.0, 8000


def tone(frequency_hz: float, samples: int = SAMPLES) -> np.ndarray:
    return np.asarray(np.sqrt(2) * np.sin(2 * np.pi * frequency_hz * np.arange(samples) / RATE_HZ))


def test_the_gap_of_a_channel_is_over_what_was_measured() -> None:
    rng = np.random.default_rng(1)
    measured = np.array([[2.0], [5e-3]]) * rng.standard_normal((2, SAMPLES))
    residual = np.array([[0.1], [0.5]]) * measured
    noise = white_floor(0.01 * measured.std(axis=1))
    first, second = channel_gaps(residual, measured, noise, output_names=("a", "b"))
    assert (first.name, second.name) == ("a", "b")
    assert (first.gap, second.gap) == (pytest.approx(0.1), pytest.approx(0.5))
    assert not first.noise_at_most
    assert not second.noise_at_most
    sure = replace(noise, upper_bound=np.array([True, False]))
    told = channel_gaps(residual, measured, sure, output_names=("a", "b"))
    assert [one.noise_at_most for one in told] == [True, False]
    assert (first.noise, second.noise) == (pytest.approx(0.01, rel=1e-3), pytest.approx(0.01, rel=1e-3))
    assert pooled_gap(residual, measured) == pytest.approx(np.sqrt((0.01 + 0.25) / 2))


def test_an_output_that_was_zero_does_not_divide_by_it() -> None:
    assert pooled_gap(np.full((1, 10), 3.0), np.zeros((1, 10))) == pytest.approx(3.0)


def test_shapes_that_differ_are_refused() -> None:
    with pytest.raises(EstimateError, match=r"\(1, 5\).*\(1, 6\)"):
        pooled_gap(np.zeros((1, 5)), np.zeros((1, 6)))


@given(samples=st.integers(40, 400), outputs=st.integers(1, 3), seed=st.integers(0, 99))
def test_bands_fill_the_spectrum_and_add_up(samples: int, outputs: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    residual, measured = rng.standard_normal((2, outputs, samples))
    bands = band_shares(residual, measured, sample_rate_hz=RATE_HZ)
    assert bands[0].low_hz == 0.0
    assert bands[-1].high_hz == pytest.approx(RATE_HZ / 2 if samples % 2 == 0 else RATE_HZ / 2 * (1 - 1 / samples))
    assert all(band.high_hz > band.low_hz for band in bands)
    assert all(one.high_hz == other.low_hz for one, other in pairwise(bands))
    assert sum(band.share for band in bands) == pytest.approx(1.0)


def test_the_share_of_a_band_is_its_power_with_outputs_on_one_scale() -> None:
    # 1 of the first output's power at 10 Hz, 3 of the second's at 40 Hz, whatever their units.
    measured = np.array([1e3 * tone(20.0), 1e-3 * tone(20.0)])
    residual = np.array([1e3 * 0.1 * tone(10.0), 1e-3 * 0.1 * np.sqrt(3) * tone(40.0)])
    bands = band_shares(residual, measured, sample_rate_hz=RATE_HZ)
    held = {
        tone_hz: sum(one.share for one in bands if one.low_hz <= tone_hz < one.high_hz) for tone_hz in (10, 20, 40)
    }
    assert held == {10: pytest.approx(0.25), 20: pytest.approx(0.0, abs=1e-9), 40: pytest.approx(0.75)}


def test_without_modes_bands_follow_where_power_is() -> None:
    rng = np.random.default_rng(2)
    narrow = np.fft.rfft(rng.standard_normal((1, SAMPLES)))
    frequency_hz = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
    narrow[:, (frequency_hz < 5) | (frequency_hz > 20)] = 0
    signal = np.fft.irfft(narrow, SAMPLES)
    bands = band_shares(signal, signal, sample_rate_hz=RATE_HZ)
    assert 8 <= len(bands) <= 12
    inside = [band for band in bands if band.low_hz >= 4.9 and band.high_hz <= 20.1]
    assert len(inside) >= 8
    assert sum(band.share for band in inside) > 0.99


def test_no_gap_has_no_shares() -> None:
    measured = tone(20.0)[None]
    bands = band_shares(np.zeros_like(measured), measured, sample_rate_hz=RATE_HZ)
    assert all(band.share == 0.0 for band in bands)
    assert regime_shares(np.zeros_like(measured), measured, {"elbow.velocity": Variable(measured[0])}) == ()


@pytest.mark.parametrize("samples", [SAMPLES, SAMPLES + 1])
def test_in_each_band_it_is_told_how_much_of_the_gap_noise_can_be(samples: int) -> None:
    rng = np.random.default_rng(11)
    measured = np.array([[1e3], [1e-3]]) * np.array([tone(20.0, samples), tone(20.0, samples)])
    # White noise, and a tone at 10 Hz of the same power.
    white = 0.1 * np.array([[1e3], [1e-3]]) * rng.standard_normal((2, samples))
    noise = white_floor(white.std(axis=1))
    residual = white + 0.1 * np.array([1e3 * tone(10.0, samples), 1e-3 * tone(10.0, samples)])
    bands = band_shares(residual, measured, sample_rate_hz=RATE_HZ, noise=noise)
    wide = [one for one in bands if one.high_hz - one.low_hz > 5.0]
    assert len(wide) > 3
    for one in wide:
        # Powers of a band, of two hundred lines at least, scatter by 7 %; the noise has the tone's power in all.
        part = (one.high_hz - one.low_hz) / 100.0
        expected = part / (1 + part) if one.low_hz <= 10.0 < one.high_hz else 1.0
        assert one.noise == pytest.approx(expected, rel=0.2)


def test_without_a_floor_or_without_a_gap_no_noise_is_told() -> None:
    rng = np.random.default_rng(12)
    measured = rng.standard_normal((1, 400))
    assert {one.noise for one in band_shares(measured, measured, sample_rate_hz=RATE_HZ)} == {None}
    noise = white_floor(measured.std(axis=1))
    gone = band_shares(np.zeros_like(measured), measured, sample_rate_hz=RATE_HZ, noise=noise)
    assert {one.noise for one in gone} == {None}
    # Ten times less than the floor says: all of it can be noise.
    less = band_shares(0.1 * measured, measured, sample_rate_hz=RATE_HZ, noise=noise)
    assert {one.noise for one in less} == {1.0}


def test_outputs_without_motion_have_one_band() -> None:
    (band,) = band_shares(np.zeros((1, 50)), np.full((1, 50), 3.0), sample_rate_hz=RATE_HZ)
    assert (band.low_hz, band.high_hz, band.share) == (0.0, 100.0, 0.0)


def motion(seed: int) -> np.ndarray:
    return np.asarray(np.convolve(np.random.default_rng(seed).standard_normal(SAMPLES), np.hanning(20), "same"))


def test_a_gap_around_zero_velocity_is_found_there() -> None:
    rng = np.random.default_rng(3)
    velocity, displacement = motion(1), motion(2)
    near = np.abs(velocity) < np.quantile(np.abs(velocity), 0.2)
    residual = np.where(near, 1.0, 0.1)[None] * rng.standard_normal((1, SAMPLES))
    found = regime_shares(
        residual,
        np.ones((1, SAMPLES)),
        {"elbow.velocity": Variable(velocity), "elbow.displacement": Variable(displacement)},
    )
    assert found[0].variable == "elbow.velocity"
    assert found[0].low == pytest.approx(-found[0].high)
    assert found[0].high == pytest.approx(np.quantile(np.abs(velocity), 0.2))
    # 20 % of the time at power 1, the rest at 0.01.
    assert found[0].share == pytest.approx(0.2 / (0.2 + 0.8 * 0.01), abs=0.02)
    assert all(regime.variable == "elbow.velocity" for regime in found)


def test_a_one_sided_gap_is_found_on_its_side() -> None:
    rng = np.random.default_rng(4)
    displacement = motion(5)
    beyond = displacement > np.quantile(displacement, 0.9)
    residual = np.where(beyond, 1.0, 0.1)[None] * rng.standard_normal((1, SAMPLES))
    found = regime_shares(residual, np.ones((1, SAMPLES)), {"d": Variable(displacement)})
    assert found[0].low == pytest.approx(np.quantile(displacement, 0.9))
    assert found[0].high == displacement.max()
    assert found[0].share > 0.85


def test_a_gap_that_does_not_depend_on_the_motion_has_no_regime() -> None:
    found = [
        regime_shares(
            np.random.default_rng(seed).standard_normal((1, SAMPLES)),
            np.ones((1, SAMPLES)),
            {"v": Variable(motion(seed + 100))},
        )
        for seed in range(20)
    ]
    assert found == [()] * 20


def test_a_gap_that_only_grows_with_the_motion_is_told_by_no_amplitude() -> None:
    rng = np.random.default_rng(8)
    envelope = 1.5 + np.sin(2 * np.pi * np.arange(SAMPLES) / 800)
    measured = envelope * rng.standard_normal((1, SAMPLES))
    alike = 0.1 * envelope * rng.standard_normal((1, SAMPLES))
    amplitude = {"hand.amplitude": Variable(envelope)}
    assert regime_shares(alike, measured, amplitude)[0].low > 1.5
    assert regime_shares(alike, measured, amplitude, beyond_motion=True) == ()
    # A cubic spring's is larger than that, and what rubs is so where little moves.
    (grown, *_) = regime_shares(alike * envelope**2, measured, amplitude, beyond_motion=True)
    assert grown.low > 2.0
    assert grown.time == pytest.approx(np.mean((envelope >= grown.low) & (envelope <= grown.high)))
    (faded, *_) = regime_shares(alike / envelope**2, measured, amplitude, beyond_motion=True)
    assert faded.high < 1.0


def test_at_most_six_regimes_are_told_and_none_overlap() -> None:
    rng = np.random.default_rng(6)
    variables = {f"joint{place}.velocity": Variable(motion(place)) for place in range(8)}
    # Loud where all move slowly.
    power = sum(np.exp(-((one.values / one.values.std()) ** 2)) for one in variables.values())
    found = regime_shares(power[None] ** 2 * rng.standard_normal((1, SAMPLES)), np.ones((1, SAMPLES)), variables)
    assert 0 < len(found) <= 6
    for one in found:
        for other in found:
            if one is not other and one.variable == other.variable:
                assert one.high <= other.low or other.high <= one.low


def test_a_variable_of_another_length_is_refused() -> None:
    with pytest.raises(EstimateError, match=r"'v' has 5 samples, the residual 9"):
        regime_shares(np.ones((1, 9)), np.ones((1, 9)), {"v": Variable(np.arange(5.0))})


@pytest.mark.parametrize("samples", [15, 1000, 8001, 30000])
def test_the_map_integrates_to_the_gap(samples: int) -> None:
    rng = np.random.default_rng(7)
    measured = np.array([[3.0], [0.2]]) * rng.standard_normal((2, samples))
    residual = 0.1 * np.array([[3.0], [0.4]]) * rng.standard_normal((2, samples))
    time_s, frequency_hz, density = gap_map(residual, measured, RATE_HZ)
    assert density.shape == (time_s.size, frequency_hz.size)
    assert np.all(np.diff(time_s) > 0)
    assert 0 < time_s[0] <= time_s[-1] < samples / RATE_HZ
    whole = density.sum(axis=1).mean() * (frequency_hz[1] - frequency_hz[0])
    # Squares of noise over half of the samples at least, twice the window's loss of them; five sigma.
    assert whole == pytest.approx(pooled_gap(residual, measured) ** 2, rel=5 * np.sqrt(4 / samples))


def test_the_map_shows_when_and_where() -> None:
    measured = np.ones((1, SAMPLES))
    residual = np.where(np.arange(SAMPLES) < SAMPLES // 2, tone(20.0), tone(60.0))[None]
    time_s, frequency_hz, density = gap_map(residual, measured, RATE_HZ)
    loudest = frequency_hz[np.argmax(density, axis=1)]
    half = SAMPLES / RATE_HZ / 2
    np.testing.assert_allclose(loudest[time_s < 0.9 * half], 20.0, atol=frequency_hz[1])
    np.testing.assert_allclose(loudest[time_s > 1.1 * half], 60.0, atol=frequency_hz[1])

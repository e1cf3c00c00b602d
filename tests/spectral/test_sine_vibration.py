"""Sine sweep tools against closed forms: breakpoints, crossovers, and sweeps whose amplitude is known."""

import numpy as np
import pytest

from chladni.signals.errors import EstimateError, SetupError
from chladni.spectral.sine_vibration import check_sine, sine_limits, sine_profile
from tests.spectral.made_signals import series

G = 9.80665
RATE_HZ = 2000.0


def test_a_profile_is_straight_on_logarithmic_axes():
    profile = sine_profile([(5, 0.5), (10, 2.0), (100, 2.0)])
    grid = np.array([5.0, 7.0, 10.0, 60.0])
    # From 0.5 to 2 g within an octave: the square of the frequency, a constant displacement.
    np.testing.assert_allclose(profile.at(grid) / G, [0.5, 0.5 * 1.4**2, 2.0, 2.0])
    np.testing.assert_allclose(profile.displacement_m(grid[:3]), 2 * G / (2 * np.pi * 10) ** 2)
    np.testing.assert_allclose(profile.velocity_m_s(grid), profile.at(grid) / (2 * np.pi * grid))
    assert np.isnan(profile.at(np.array([4.9, 101.0]))).all()


def test_limits_hand_over_where_they_cross():
    # 0.75 mm and 10 g cross at 57.6 Hz, as IEC 60068-2-6 and every handbook has it (57 to 62 Hz, rounded).
    two = sine_limits((10, 500), displacement_m=0.75e-3, acceleration_m_s2=10 * G)
    assert two.frequency_hz[1] == pytest.approx(np.sqrt(10 * G / 0.75e-3) / (2 * np.pi), rel=1e-12)
    three = sine_limits((5, 500), displacement_m=5e-3, velocity_m_s=0.5, acceleration_m_s2=10 * G)
    np.testing.assert_allclose(three.frequency_hz, [5, 0.5 / (2 * np.pi * 5e-3), 10 * G / (2 * np.pi * 0.5), 500])
    grid = np.geomspace(5, 500, 301)
    assert np.max(three.displacement_m(grid)) <= 5e-3 * (1 + 1e-12)
    assert np.max(three.velocity_m_s(grid)) <= 0.5 * (1 + 1e-12)
    assert np.max(three.at(grid)) <= 10 * G * (1 + 1e-12)
    # A velocity that is never reached makes no corner.
    idle = sine_limits((10, 500), displacement_m=0.75e-3, velocity_m_s=5.0, acceleration_m_s2=10 * G)
    np.testing.assert_allclose(idle.frequency_hz, two.frequency_hz)


def sweep(gain=1.0, *, up=True):
    """An exponential sweep from 10 to 200 Hz, 2 octaves a minute x 10, that keeps 2 g; with harmonics and noise."""
    t = np.arange(int(26 * RATE_HZ)) / RATE_HZ
    growth = np.log(20) / t[-1]
    phase = 2 * np.pi * 10 * np.expm1(growth * t) / growth
    hertz = 10 * np.exp(growth * t)
    gains = np.where((hertz > 60) & (hertz < 90), gain, 1.0)
    clean = gains * 2 * G * np.sin(phase)
    rng = np.random.default_rng(4)
    rough = clean + 2 * np.sin(2 * phase) + 2 * np.sin(3 * phase) + 0.5 * rng.standard_normal(t.size)
    both = np.stack([rough, 0.5 * clean])
    return series(both if up else both[:, ::-1], rate_hz=RATE_HZ, units=["m/s^2"] * 2)


@pytest.mark.parametrize("up", [True, False])
def test_the_tracked_amplitude_is_that_of_the_sine_alone(up):
    record = sweep(up=up)
    found = check_sine(
        record, sine_profile([(10, 2), (200, 2)], upper_db=0.5, lower_db=0.5), drive=record.channels[0].name
    )
    inside = (found.frequency_hz > 12) & (found.frequency_hz < 180)
    assert inside.sum() > 200
    # Harmonics of a tenth and noise of 0.5 m/s^2 would be 1 dB of a peak detector.
    assert np.nanmax(np.abs(found.deviation_db[0, inside])) < 0.25
    assert found.outside[0] < 0.02
    late_s = found.time_s if up else 26 - found.time_s
    np.testing.assert_allclose(found.frequency_hz, 10 * np.exp(np.log(20) / 26 * late_s), rtol=0.01)


def test_what_leaves_the_tolerance_is_told_where_it_does():
    record = sweep(gain=1.3)
    names = [channel.name for channel in record.channels]
    found = check_sine(record, sine_profile([(10, 2), (200, 2)]), drive=names[0], channels=names)
    bad = found.deviation_db[0] > 1.0
    assert found.frequency_hz[bad].min() == pytest.approx(60, rel=0.05)
    assert found.frequency_hz[bad].max() == pytest.approx(90, rel=0.05)
    middle = (found.frequency_hz > 65) & (found.frequency_hz < 85)
    np.testing.assert_allclose(found.deviation_db[0, middle], 20 * np.log10(1.3), atol=0.15)
    # The other channel has half the level everywhere.
    assert found.outside[1] > 0.9


def test_what_cannot_be_judged_is_refused():
    with pytest.raises(EstimateError, match="10 Hz follows 20 Hz"):
        sine_profile([(20, 1), (10, 1)])
    with pytest.raises(SetupError, match="no accelerations"):
        sine_profile([(10, 1), (20, 1)], unit="mm")
    with pytest.raises(EstimateError, match="give a peak displacement"):
        sine_limits((10, 20))
    with pytest.raises(EstimateError, match="rises, above 0 Hz"):
        sine_limits((20, 10), velocity_m_s=1.0)
    record = series(np.ones((1, 4000)), rate_hz=RATE_HZ, units=["N"])
    with pytest.raises(EstimateError, match="is in N, the profile in"):
        check_sine(record, sine_profile([(10, 1), (20, 1)]), drive=record.channels[0].name)


def test_a_check_has_a_picture_and_a_table():
    record = sweep()
    found = check_sine(record, sine_profile([(10, 2), (200, 2)]), drive=record.channels[0].name)
    axes = found.plot()
    assert axes.get_xscale() == "log"
    assert {line.get_label() for line in axes.lines} >= {"profile", "tolerance"}
    assert found.profile.plot().get_ylabel().endswith("[m/s²]")

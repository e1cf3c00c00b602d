"""Integration and differentiation against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.spectral.integration import differentiate, differentiate_density, integrate, integrate_density

RATE_HZ = 200.0
UNITS = ("m", "m/s", "m/s^2")


def series(values, unit="m/s^2", valid=None):
    values = np.atleast_2d(values)
    channels = tuple(Channel(name=f"a{row}", unit=unit, overload=50.0) for row in range(len(values)))
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels, valid=valid, start_time_ns=7)


def times_s(seconds=40.0):
    return np.arange(round(seconds * RATE_HZ)) / RATE_HZ


def inner(result):
    edge = int(np.ceil(result.edges_s[0] * RATE_HZ))
    return slice(edge, -edge)


def burst(t, derivative):
    """Derivatives of the real part of a Gaussian times e^{j phase}, whose frequency sweeps from 8 to 22 Hz."""
    middle, width, sweep = 20.0, 3.0, 2 * np.pi * 0.8
    tau = t - middle
    exponent = -(tau**2) / (2 * width**2) + 1j * (2 * np.pi * 15.0 * tau + sweep * tau**2 / 2)
    first = -tau / width**2 + 1j * (2 * np.pi * 15.0 + sweep * tau)
    second = -1 / width**2 + 1j * sweep
    polynomial = {0: 1.0, 1: first, 2: first**2 + second}[derivative]
    return (polynomial * np.exp(exponent)).real


@pytest.mark.parametrize("times", [1, 2])
def test_a_chirp_that_dies_at_both_ends_is_integrated_to_its_closed_form(times):
    t = times_s()
    result = integrate(series(burst(t, 2)), low_hz=0.5, times=times)
    truth = burst(t, 2 - times)
    assert result.series.channels[0].unit == UNITS[2 - times]
    # What the Gaussian envelope leaves at the ends, exp(-22), and below low_hz sets the limit.
    np.testing.assert_allclose(result.series.values[0], truth, atol=1e-5 * np.abs(truth).max())


@pytest.mark.parametrize("times", [1, 2])
def test_a_chirp_is_differentiated_to_its_closed_form(times):
    t = times_s()
    result = differentiate(series(burst(t, 0), "m"), times=times)
    truth = burst(t, times)
    assert result.series.channels[0].unit == UNITS[times]
    np.testing.assert_allclose(result.series.values[0], truth, atol=1e-5 * np.abs(truth).max())


@given(frequency_hz=st.floats(1.0, 90.0), phase=st.floats(0, 6.28), times=st.sampled_from([1, 2]))
def test_a_sine_is_right_away_from_the_ends(frequency_hz, phase, times):
    low_hz, omega = 1.0, 2 * np.pi * frequency_hz
    angle = omega * times_s() + phase
    result = integrate(series(np.sin(angle)), low_hz=low_hz, times=times)
    error = result.series.values[0] - (np.exp(1j * angle) / (1j * omega) ** times).imag
    # The bound that the docstring states.
    bound = 0.015 * omega**-times * (frequency_hz / low_hz) ** (times - 1)
    assert np.abs(error[inner(result)]).max() < bound


@given(frequency_hz=st.floats(0.0, 80.0), phase=st.floats(0, 6.28))
def test_the_derivative_of_a_sine_is_right_away_from_the_ends(frequency_hz, phase):
    omega = 2 * np.pi * frequency_hz
    result = differentiate(series(np.sin(omega * times_s() + phase), "m"), high_hz=80.0)
    error = result.series.values[0] - omega * np.cos(omega * times_s() + phase)
    # The ends leave a remainder near the Nyquist frequency, of 0.5 % of what a tone there would have.
    assert np.abs(error[inner(result)]).max() < 0.005 * 2 * np.pi * 80.0


def test_drift_and_offset_do_not_pass_and_the_limit_is_said():
    t = times_s()
    drift = 5.0 + 0.3 * t + 0.2 * np.sin(2 * np.pi * 0.2 * t)
    result = integrate(series(drift), low_hz=1.0)
    assert np.abs(result.series.values[0][inner(result)]).max() < 0.015 * 0.2 / (2 * np.pi * 0.2)
    assert result.band_hz == (1.0, 100.0)
    assert "above 1 Hz" in result.notes[0]
    assert "3 s" in result.notes[0]
    assert result.series.channels[0].overload is None
    assert result.series.start_time_ns == 7


def test_nothing_is_carried_across_a_gap():
    t = times_s()
    x = np.vstack([np.sin(2 * np.pi * 5 * t)] * 2)
    valid = np.ones(x.shape, dtype=bool)
    valid[0, 4000:4010] = False
    gapped = x.copy()
    gapped[0, 4000:4010] = np.nan
    result = integrate(series(gapped, valid=valid), low_hz=1.0)
    np.testing.assert_array_equal(result.series.valid, valid)
    np.testing.assert_array_equal(np.isnan(result.series.values), ~valid)
    alone = integrate(series(x[0, 4010:]), low_hz=1.0)
    np.testing.assert_array_equal(result.series.values[0, 4010:], alone.series.values[0])
    whole = integrate(series(x[1]), low_hz=1.0)
    np.testing.assert_array_equal(result.series.values[1], whole.series.values[0])


def test_runs_too_short_for_the_band_are_left_out_and_counted():
    x = np.sin(2 * np.pi * 5 * times_s())
    valid = np.ones((1, x.size), dtype=bool)
    valid[0, 500] = False
    result = integrate(series(x, valid=valid), low_hz=1.0)
    assert np.isnan(result.series.values[0, :501]).all()
    assert np.isfinite(result.series.values[0, 501:]).all()
    assert any(note.startswith("500 samples in runs shorter than 6 s") for note in result.notes)


def test_a_record_too_short_for_the_band_is_refused():
    with pytest.raises(EstimateError, match=r"no unbroken run lasts 6 s"):
        integrate(series(np.ones(1000)), low_hz=1.0)


@pytest.mark.parametrize("low_hz", [0.0, -1.0, 100.0, np.nan])
def test_low_hz_must_lie_inside_the_band(low_hz):
    with pytest.raises(EstimateError, match="low_hz"):
        integrate(series(np.ones(1000)), low_hz=low_hz)


@pytest.mark.parametrize("high_hz", [0.0, 100.0, np.nan])
def test_high_hz_must_lie_inside_the_band(high_hz):
    with pytest.raises(EstimateError, match="high_hz"):
        differentiate(series(np.ones(1000)), high_hz=high_hz)


@pytest.mark.parametrize(
    "convert", [lambda x: integrate(x, low_hz=1.0, times=0), lambda x: differentiate(x, times=0)]
)
def test_at_least_one_step(convert):
    with pytest.raises(EstimateError, match="at least once"):
        convert(series(np.ones(4000)))


def test_a_force_has_no_integral():
    with pytest.raises(SetupError, match="N"):
        integrate(series(np.ones(4000), "N"), low_hz=1.0)


def density(unit):
    frequency_hz = np.arange(0, 101) * 1.0
    values = np.vstack([np.full(101, 3.0), 1.0 + frequency_hz])
    return PowerSpectralDensity(
        frequency_hz=frequency_hz,
        values=values,
        std=values / 10,
        channels=(Channel(name="a", unit=unit), Channel(name="b", unit=unit)),
        bandwidth_hz=1.5,
        provenance=Provenance(estimator="PSD", segment_s=1.0),
    )


def test_a_density_is_divided_by_omega_squared_and_begins_above_zero():
    displacement = integrate_density(density("m/s^2"), times=2)
    assert displacement.units[0] == density("m").units[0]
    assert displacement.frequency_hz[0] == 1.0
    omega = 2 * np.pi * displacement.frequency_hz
    np.testing.assert_allclose(displacement.values[0], 3.0 / omega**4, rtol=1e-14)
    np.testing.assert_allclose(displacement.std, displacement.values / 10, rtol=1e-14)
    assert "begins at 1 Hz" in displacement.provenance.notes[0]


def test_differentiation_undoes_integration_of_a_density():
    start = density("m/s^2")
    back = differentiate_density(integrate_density(start, low_hz=4.0, times=2), times=2)
    np.testing.assert_allclose(back.values, start.values[:, 4:], rtol=1e-14)
    assert back.units == start.units


def test_the_density_of_a_sine_and_of_its_integral_agree():
    t = times_s()
    x = np.sin(2 * np.pi * 10 * t)
    velocity = integrate(series(x), low_hz=1.0).series.values[0]
    power = np.mean(velocity[800:-800] ** 2)
    line = PowerSpectralDensity(
        frequency_hz=np.array([10.0]),
        values=np.array([[0.5]]),
        std=np.array([[0.1]]),
        channels=(Channel(name="a", unit="m/s^2"),),
        bandwidth_hz=1.0,
        provenance=Provenance(),
    )
    np.testing.assert_allclose(power, integrate_density(line).values[0, 0], rtol=0.002)


def test_no_line_left_is_refused():
    with pytest.raises(EstimateError, match="above the last line at 100 Hz"):
        integrate_density(density("m/s^2"), low_hz=200.0)

"""Values in the unit that people ask for."""

import numpy as np
import pytest

import chladni
from chladni.signals.errors import SetupError
from chladni.signals.shown_units import all_in_units, in_units
from chladni.signals.time_series import TimeSeries

G = 9.80665


@pytest.fixture(scope="module")
def series() -> TimeSeries:
    rng = np.random.default_rng(7)
    named = {"tip": rng.standard_normal(8192), "base": rng.standard_normal(8192), "force": rng.standard_normal(8192)}
    return TimeSeries.from_arrays(named, sample_rate_hz=200.0, units={"tip": "m/s^2", "base": "m/s", "force": "N"})


def in_g(series: TimeSeries) -> TimeSeries:
    """The same counted in g, mm/s and kN: what every estimate of it must be."""
    scale = np.array([[1 / G], [1e3], [1e-3]])
    return TimeSeries.from_arrays(
        {one.name: row for one, row in zip(series.channels, series.values * scale, strict=True)}, sample_rate_hz=200.0
    )


UNITS = ("g", "mm/s", "kN")


def test_densities(series: TimeSeries) -> None:
    shown, counted = in_units(chladni.psd(series), UNITS), chladni.psd(in_g(series))
    assert shown.units == ("g^2/Hz", "(mm/s)^2/Hz", "kN^2/Hz")
    np.testing.assert_allclose(shown.values, counted.values, rtol=1e-9)
    np.testing.assert_allclose(shown.std, counted.std, rtol=1e-9)


def test_frequency_responses(series: TimeSeries) -> None:
    shown = in_units(chladni.frf(series, references="force"), UNITS)
    counted = chladni.frf(in_g(series), references="force")
    assert [shown.unit(row, 0) for row in range(2)] == ["g/kN", "(mm/s)/kN"]
    np.testing.assert_allclose(shown.values, counted.values, rtol=1e-9)
    np.testing.assert_allclose(shown.std, counted.std, rtol=1e-9)
    np.testing.assert_array_equal(shown.coherence, chladni.frf(series, references="force").coherence)


def test_waterfalls_and_levels(series: TimeSeries) -> None:
    shown, counted = in_units(chladni.waterfall(series), "g"), chladni.waterfall(in_g(series))
    np.testing.assert_allclose(shown.values[0], counted.values[0], rtol=1e-6)
    np.testing.assert_array_equal(shown.values[2], chladni.waterfall(series).values[2])
    levels, other = in_units(chladni.levels(series), UNITS), chladni.levels(in_g(series))
    for name in ("rms", "rms_std", "mean", "peak", "peak_to_peak", "kurtosis", "crest_factor"):
        np.testing.assert_allclose(getattr(levels, name), getattr(other, name), rtol=1e-9, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(levels.running.rms, other.running.rms, rtol=1e-9)
    assert [channel.unit for channel in levels.running.channels] == list(UNITS)


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ("mm", "--unit mm is one of m, and no channel is in m; what fits: g, m/s^2 or mm/s^2; m/s or mm/s; N, kN or"),
        ("Pa", "--unit Pa: no channel is in Pa; what fits: "),
        (("g", "mm/s^2"), "--unit g and --unit mm/s^2 are of one quantity; give one of them"),
        ("gravitons", "unit 'gravitons'"),
    ],
)
def test_what_does_not_fit_is_refused(series: TimeSeries, units: str, message: str) -> None:
    with pytest.raises(SetupError) as caught:
        in_units(chladni.psd(series), units)
    assert message in str(caught.value)


def test_a_unit_has_to_fit_one_of_several_values(series: TimeSeries) -> None:
    tip, base = (chladni.psd(series, channels=name) for name in ("tip", "base"))
    assert [one.units for one in all_in_units([tip, base], "g")] == [("g^2/Hz",), ("(m/s)^2/Hz",)]


def test_a_log_without_units_is_told_how_to_state_them() -> None:
    with pytest.raises(SetupError, match="the log gives no unit of its channels; state it in a setup file"):
        in_units(chladni.psd(np.random.default_rng(1).standard_normal(4096), sample_rate_hz=9.0), "g")

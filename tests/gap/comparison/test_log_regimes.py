"""Regimes that a log tells by itself."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.comparison.log_regimes import amplitude, cycles_of, measured_variables
from chladni.gap.comparison.shares import regime_shares
from chladni.gap.records.diagnosis import RegimeShare
from chladni.gap.records.measurement import Measurement
from tests.gap.comparison import made_measurements as made

SAMPLES = 16000


def swelling() -> Measurement:
    """A sine at 20 Hz that swells and fades eight times, and an output that doesn't."""
    t = np.arange(SAMPLES) / made.RATE_HZ
    sine = np.sin(2 * np.pi * 20.0 * t)
    swells = (1.5 - np.cos(2 * np.pi * 0.25 * t)) * sine
    return replace(made.measurement(sine, np.array([swells, sine])), output_units=("m", "1"))


def log_regimes(residual: np.ndarray, measured: Measurement) -> tuple[RegimeShare, ...]:
    return regime_shares(residual, measured.outputs, measured_variables(measured), beyond_motion=True)


def test_the_amplitude_of_a_sine_is_its_own() -> None:
    sine = 3.0 + 2.0 * np.sin(2 * np.pi * 20.0 * np.arange(SAMPLES) / 500.0)
    assert cycles_of(sine, 500.0) == 100
    found = amplitude(sine, 100)
    # Four cycles are a whole number of samples here.
    np.testing.assert_allclose(found[100:-100], 2.0, rtol=1e-9)
    assert not amplitude(np.full(100, 5.0), cycles_of(np.full(100, 5.0), 500.0)).any()


def test_a_gap_that_grows_faster_than_the_motion_is_told_with_its_amplitude() -> None:
    measured = swelling()
    residual = np.array([0.1 * measured.outputs[0] ** 3, np.zeros(SAMPLES)])
    found = log_regimes(residual, measured)
    loud, *_ = (one for one in found if one.variable == "amplitude of acc1")
    # The upper tenth of 1.5 - cos begins at 1.5 + cos(18 deg), and holds that share of its sixth power.
    swell = np.sort((1.5 - np.cos(np.linspace(0, 2 * np.pi, 4000))) ** 6)
    assert (loud.low, loud.high, loud.unit) == (pytest.approx(2.45, abs=0.01), pytest.approx(2.5, abs=0.01), "m")
    assert loud.share == pytest.approx(swell[-400:].sum() / swell.sum(), abs=0.01)


def test_a_gap_of_constant_share_has_no_regime() -> None:
    measured = swelling()
    assert log_regimes(np.array([0.1, 0.0])[:, None] * measured.outputs, measured) == ()


def test_a_gap_around_zero_displacement_is_told() -> None:
    measured = swelling()
    inside = np.abs(measured.outputs[0]) < 0.2
    found = log_regimes(np.array([inside * 0.1, np.zeros(SAMPLES)]), measured)
    near = [one for one in found if one.variable == "acc1"]
    assert near[0].low < 0 < near[0].high
    assert (near[0].share > 0.9, near[0].unit) == (True, "m")

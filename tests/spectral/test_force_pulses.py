"""Pulses and clipped crests, on shapes of known form."""

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.spectral.force_pulses import find_pulses, is_clipped


def crest(width, cut=2.0):
    x = np.zeros(5 * width)
    x[2 * width : 3 * width] = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    return np.minimum(x, cut)


@pytest.mark.parametrize("width", [3, 4, 5, 9, 10, 50, 500])
def test_a_whole_half_sine_is_not_clipped(width):
    x = crest(width)
    assert not is_clipped(x, int(np.argmax(x)))


@pytest.mark.parametrize("width", [10, 50, 500])
@pytest.mark.parametrize("cut", [0.3, 0.6, 0.85])
def test_a_cut_half_sine_is_clipped_wherever_its_top_is_pointed_at(width, cut):
    x = crest(width, cut)
    top = np.flatnonzero(x == x.max())
    assert is_clipped(x, int(top[0]))
    assert is_clipped(x, int(top[-1]))
    assert is_clipped(3e4 * x, int(top[0]))


def test_silence_and_a_crest_at_the_edge_are_not_clipped():
    assert not is_clipped(np.zeros(1000), 0)
    assert not is_clipped(np.concatenate([np.ones(5), np.zeros(100)]), 0)


def test_pulses_are_turned_upwards_and_measured():
    x = 4.0 - 80 * np.concatenate([crest(20), crest(20)])
    series = TimeSeries(values=x[np.newaxis], sample_rate_hz=100.0, channels=(Channel(name="f", unit="N"),))
    pulses = find_pulses(series, "f", level=None)
    assert pulses.sign == -1.0
    assert pulses.unit == "N"
    assert pulses.noise == 0.0
    assert pulses.level == pytest.approx(8.0, rel=0.01)
    np.testing.assert_allclose(pulses.force[pulses.peaks], 80.0, rtol=0.01)
    # A half sine is above half its height for two thirds of its width.
    np.testing.assert_allclose(pulses.widths, 14, atol=1)

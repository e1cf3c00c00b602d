"""Banks of oscillators against SciPy's filters, one line and one channel at a time."""

import numpy as np
from scipy.signal import lfilter

from chladni.spectral.oscillator_bank import OscillatorBank

RATE_HZ, LINES_HZ = 1000.0, np.array([7.0, 21.0, 24.0])


def bank(channels, numerators, denominators):
    return OscillatorBank(channels, LINES_HZ, RATE_HZ, 1, numerators=numerators, denominators=denominators)


def test_extremes_are_those_of_each_filter_with_a_period_of_ringing():
    rng = np.random.default_rng(5)
    numerators = rng.standard_normal((3, 3))
    poles = 0.97 * np.exp(2j * np.pi * LINES_HZ / RATE_HZ)
    denominators = np.stack([np.ones(3), -2 * poles.real, np.abs(poles) ** 2], axis=1)
    x = rng.standard_normal((4, 300))
    oscillators = bank(4, numerators, denominators)
    # In pieces, and not every channel from the beginning.
    oscillators.feed(np.array([0, 1, 3]), x[[0, 1, 3], :100])
    oscillators.feed(np.arange(4), x[:, 100:])
    oscillators.end(np.arange(4))
    for channel, start in enumerate((0, 0, 100, 0)):
        for line, line_hz in enumerate(LINES_HZ):
            rung = np.append(x[channel, start:], np.zeros(int(np.ceil(RATE_HZ / line_hz))))
            expected = lfilter(numerators[line], denominators[line], rung)
            np.testing.assert_allclose(oscillators.highest[channel, line], max(expected.max(), 0), rtol=1e-12)
            np.testing.assert_allclose(oscillators.lowest[channel, line], min(expected.min(), 0), rtol=1e-12)


def test_after_its_end_a_channel_begins_at_rest():
    numerators, denominators = np.tile([1.0, 0.0, 0.0], (3, 1)), np.tile([1.0, -0.5, 0.0], (3, 1))
    oscillators = bank(1, numerators, denominators)
    row = np.zeros(1, dtype=np.intp)
    oscillators.feed(row, np.full((1, 1), 3.0))
    oscillators.end(row)
    oscillators.feed(row, np.full((1, 1), 4.0))
    # What was left of 3 would make it 4 and a half.
    np.testing.assert_array_equal(oscillators.highest, np.full((1, 3), 4.0))

"""Tones are found to a fraction of a line."""

import numpy as np
import pytest

from chladni.models.effects.tones import strongest_tones


def test_a_tone_in_noise_is_found() -> None:
    t = np.arange(8000) / 1000.0
    signal = np.sin(2 * np.pi * 50.037 * t) + 0.5 * np.random.default_rng(2).standard_normal(t.size)
    # A line is 0.125 Hz wide; the parabola is good to some hundredths of it.
    assert strongest_tones(signal, 1000.0)[0] == pytest.approx(50.037, abs=0.01)


def test_a_motor_that_wanders_stands_behind_no_spike() -> None:
    t = np.arange(8000) / 512.0
    rng = np.random.default_rng(5)
    wander = 0.5 * np.cumsum(rng.standard_normal(t.size)) / np.sqrt(t.size)
    motor = 5.0 * np.sin(2 * np.pi * 22.29 * t + wander)
    spikes = sum(0.1 * np.sin(2 * np.pi * at_hz * t) for at_hz in (61.0, 120.0, 159.6))
    noise = 1e-3 * rng.standard_normal(t.size)
    assert min(abs(one - 22.29) for one in strongest_tones(motor + spikes + noise, 512.0)) < 0.1

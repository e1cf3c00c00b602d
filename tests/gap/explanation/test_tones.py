"""Tones and resonances are found to a fraction of a line."""

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.explanation.tones import strongest_resonances, strongest_tones


def test_a_tone_in_noise_is_found() -> None:
    t = np.arange(8000) / 1000.0
    signal = np.sin(2 * np.pi * 50.037 * t) + 0.5 * np.random.default_rng(2).standard_normal(t.size)
    # A line is 0.125 Hz wide; the parabola is good to some hundredths of it.
    assert strongest_tones(signal, 1000.0)[0] == pytest.approx(50.037, abs=0.01)


def test_an_oscillator_between_two_signals_is_found() -> None:
    rng = np.random.default_rng(3)
    motion = rng.standard_normal(16_000)
    # Poles at 38.4 Hz with half a per cent of damping, 1000 samples a second.
    angle, radius = 2 * np.pi * 0.0384, np.exp(-0.005 * 2 * np.pi * 0.0384)
    force = lfilter([1.0], [1.0, -2 * radius * np.cos(angle), radius**2], motion)
    hum = 30.0 * np.sin(2 * np.pi * 0.1 * np.arange(motion.size))
    assert strongest_resonances(motion, force + hum, 1000.0)[0] == pytest.approx(38.4, abs=0.3)


def test_a_motor_that_wanders_stands_behind_no_spike() -> None:
    t = np.arange(8000) / 512.0
    rng = np.random.default_rng(5)
    wander = 0.5 * np.cumsum(rng.standard_normal(t.size)) / np.sqrt(t.size)
    motor = 5.0 * np.sin(2 * np.pi * 22.29 * t + wander)
    spikes = sum(0.1 * np.sin(2 * np.pi * at_hz * t) for at_hz in (61.0, 120.0, 159.6))
    noise = 1e-3 * rng.standard_normal(t.size)
    assert min(abs(one - 22.29) for one in strongest_tones(motor + spikes + noise, 512.0)) < 0.1

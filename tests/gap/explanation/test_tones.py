"""Tones are found to a fraction of a line."""

import numpy as np
import pytest

from chladni.gap.explanation.tones import strongest_tones


def test_a_tone_in_noise_is_found() -> None:
    t = np.arange(8000) / 1000.0
    signal = np.sin(2 * np.pi * 50.037 * t) + 0.5 * np.random.default_rng(2).standard_normal(t.size)
    # A line is 0.125 Hz wide; the parabola is good to some hundredths of it.
    assert strongest_tones(signal, 1000.0)[0] == pytest.approx(50.037, abs=0.01)

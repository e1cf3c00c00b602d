"""An oscillator that answers a motion is told from their spectra, though it swings at the start and at the end."""

import numpy as np
import pytest
from scipy.signal import lsim

from chladni.gap.plant.record_lines import all_lines
from chladni.models.effects.resonances import resonances

RATE_HZ, SAMPLES = 500.0, 6000
FREQUENCY_HZ, DAMPING = 10.07, 0.008


def spectra(noise: float):
    rng = np.random.default_rng(4)
    time_s = np.arange(SAMPLES) / RATE_HZ
    # Sampled finely, so that straight lines between samples do for the oscillator.
    drive = np.interp(time_s, time_s[::5], rng.standard_normal(SAMPLES // 5))
    omega = 2 * np.pi * FREQUENCY_HZ
    system = ([2 * DAMPING * omega, omega**2], [1.0, 2 * DAMPING * omega, omega**2])
    # A first second that isn't looked at leaves it swinging.
    lead = np.concatenate([rng.standard_normal(int(RATE_HZ)), drive])
    answer = 0.3 * lsim(system, lead, np.arange(lead.size) / RATE_HZ)[1][int(RATE_HZ) :]
    answer = answer + noise * np.std(answer) * rng.standard_normal(SAMPLES)
    lines = all_lines(SAMPLES, RATE_HZ)
    return lines.spectrum(answer)[0], lines.spectrum(drive)[0], np.ones(lines.index.size), lines.frequency_hz


def test_the_last_step_tells_frequency_and_damping() -> None:
    frequency, damping = np.exp(list(resonances(*spectra(0.0), (0.5, 40.0)))[-1])
    assert frequency == pytest.approx(FREQUENCY_HZ, rel=2e-3)
    assert damping == pytest.approx(DAMPING, rel=0.05)


def test_noise_of_ten_per_cent_leaves_the_frequency() -> None:
    frequency, _ = np.exp(list(resonances(*spectra(0.1), (0.5, 40.0)))[-1])
    assert frequency == pytest.approx(FREQUENCY_HZ, rel=0.02)


def test_too_few_lines_tell_nothing() -> None:
    assert not list(resonances(*spectra(0.0), (10.0, 10.5)))

"""A stop that is touched between two stages of a step, where the motion turns."""

import math

import numpy as np
import pytest

from chladni.models.integrator.integrator import Integrator, integrate
from tests.models.integrator import systems
from tests.models.integrator.systems import compiled_structure, law, oscillator

RATE_HZ = 100.0
AMPLITUDE = 5e-3


def stopped(clearance):
    return compiled_structure(
        oscillator(damping=0.0), force_at="body", laws=(law(0, systems.one_sided_stop, 5e4, clearance),)
    )


@pytest.mark.parametrize("scheme", ["automatic", "explicit", "implicit"])
@pytest.mark.parametrize("turn_at", [0.25, 0.4, 0.8])
def test_a_touch_between_two_stages_is_seen(scheme, turn_at):
    # Ten samples a cycle; the first turn comes at a share of a sample interval, 0.6 % of the way behind the stop. The
    # contact takes 0.035 cycles, a third of a sample interval, and falls between stages of one scheme or the other.
    phase = 2 * math.pi * (2 + turn_at) / 10
    omega = 2 * math.pi * 10
    start = {"x_body": AMPLITUDE * math.cos(phase), "v_body": AMPLITUDE * omega * math.sin(phase)}
    compiled = stopped(0.994 * AMPLITUDE)
    found = Integrator(compiled, RATE_HZ, scheme=scheme).run(np.zeros((1, 9)), initial=start)
    fine = integrate(compiled, np.zeros((1, 8 * 32 + 1)), 32 * RATE_HZ, initial=start, tolerance=1e-12).states[
        :, ::32
    ]
    free = integrate(stopped(1.0), np.zeros((1, 9)), RATE_HZ, initial=start).states
    assert systems.relative_rms(free, fine) >= 1e-3
    assert systems.relative_rms(found.states, fine) <= 1e-6


def test_halving_the_step_changes_little_where_noise_drives_a_body_against_a_stop():
    # Among some twenty contacts there's one of a third of a sample interval.
    spectrum = np.fft.rfft(np.random.default_rng(1).standard_normal(200))
    frequency_hz = np.fft.rfftfreq(200, 1 / RATE_HZ)
    spectrum[(frequency_hz < 1) | (frequency_hz > 20)] = 0
    signals = np.fft.irfft(spectrum, 200)[None]
    signals *= 10 / signals.std()
    compiled = compiled_structure(oscillator(), force_at="body", laws=(law(0, systems.one_sided_stop, 5e4, 5e-3),))
    whole = integrate(compiled, signals, RATE_HZ).states
    half = integrate(compiled, systems.refined(signals, 2), 2 * RATE_HZ).states[:, ::2]
    assert systems.relative_rms(whole, half) <= 1e-4

"""Laws of the catalogue against SciPy's Radau at a tolerance of 1e-10, which calls the same laws as Python."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chladni.models.effects import (
    backlash,
    coulomb_friction,
    dead_zone,
    hardening_stiffness,
    hysteresis,
    one_sided_stop,
    saturation,
)
from chladni.models.integrator.integrator import integrate
from tests.models.integrator.systems import compiled_structure, law, oscillator, plain_model, relative_rms

RATE_HZ = 40.0
SPRING = (2 * math.pi * 10) ** 2


def at_joint(chosen):
    return compiled_structure(oscillator(), force_at="body", laws=(chosen,))


def at_command(chosen):
    """Position loop around a damped axis, what acts on its command at the port."""
    return plain_model(
        [[0, 1], [-400, -8]], [[0], [400]], [[1, 0]], [[0]], g=[[0], [1]], h=[[0]],
        motion=([[-400, 0]], [[400]], [[0]]), laws=(chosen,),
    )  # fmt: skip


SHARP = {
    "backlash": (at_joint(law(0, backlash.spring, SPRING, 1e-3)), 20.0),
    "backlash, contact damping": (at_joint(law(0, backlash.contact_damping, SPRING, 1e-3, 1.0)), 20.0),
    "one-sided stop": (at_joint(law(0, one_sided_stop.stop, 5e4, 2e-3, 1.0, 1.0, 1.0, 0.5)), 20.0),
    "coulomb friction": (at_joint(law(0, coulomb_friction.regularised, 5.0, 0.0, 1e-4)), 20.0),
    "bristles": (at_joint(law(0, coulomb_friction.bristle, 5.0, 0.0, 1e-4, state=(0.0,))), 20.0),
    "hysteresis": (at_joint(law(0, hysteresis.bouc_wen, 5.0, 2e-3, 1.0, state=(0.0,))), 20.0),
    "saturation": (at_command(law(0, saturation.clipped, 1.0)), 0.02),
    "dead zone": (at_command(law(0, dead_zone.dead_zone, 1.0)), 0.02),
}
SMOOTH = {
    "hardening stiffness": (at_joint(law(0, hardening_stiffness.cubic, 2e6)), 20.0),
    "smooth saturation": (at_command(law(0, saturation.smooth, 1.0)), 0.02),
}
# SciPy takes 1 s for these, up to 7 s for the others, whose laws tests/models/effects holds against it in short runs.
QUICK = ("saturation", "dead zone", "smooth saturation")


def named(laws):
    return [pytest.param(name, marks=() if name in QUICK else pytest.mark.nightly) for name in laws]


def tones(amplitude):
    """Ten cycles of the lower tone."""
    times = np.arange(81) / RATE_HZ
    return amplitude * (np.sin(2 * math.pi * 5 * times) + 0.5 * np.sin(2 * math.pi * 8.3 * times))


def by_radau(compiled, signal):
    """``[state, sample]``, a run from sample to sample: at each the straight line of the input ends."""
    (chosen,) = compiled.laws
    n, parameters = len(compiled.states), chosen.parameters
    a, b, g = compiled.a, compiled.b[:, 0], compiled.g[:, 0]
    row_d, row_s, column = (
        compiled.displacement_state[0],
        compiled.velocity_state[0],
        compiled.displacement_column[0, 0],
    )
    law_rates = [0.0] * len(chosen.state)
    found = [np.concatenate([np.zeros(n), chosen.state])]
    for first, last in pairwise(signal):

        def rates(t, y, first=first, last=last):
            u = first + (last - first) * t * RATE_HZ
            x = y[:n]
            force = chosen.function(row_d @ x + column * u, row_s @ x, t, parameters, y[n:], law_rates)
            return np.concatenate([a @ x + b * u + g * force, law_rates])

        run = solve_ivp(rates, (0, 1 / RATE_HZ), found[-1], method="Radau", rtol=1e-10, atol=1e-13)
        assert run.success
        found.append(run.y[:, -1])
    return np.array(found).T[:n]


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("name", named(SHARP))
def test_sharp_laws_agree_over_ten_cycles(name):
    compiled, amplitude = SHARP[name]
    signal = tones(amplitude)
    found = integrate(compiled, signal[None], RATE_HZ)
    assert found.refined_steps > 0
    assert relative_rms(found.states, by_radau(compiled, signal)) <= 1e-4


@pytest.mark.nightly
@pytest.mark.parametrize("name", named(SMOOTH))
def test_smooth_laws_agree_over_ten_cycles(name):
    compiled, amplitude = SMOOTH[name]
    signal = tones(amplitude)
    found = integrate(compiled, signal[None], RATE_HZ).states
    assert relative_rms(found, by_radau(compiled, signal)) <= 1e-5

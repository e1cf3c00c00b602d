"""Loops in time: a limit that acts, against SciPy on equations written out, and a loop that runs away."""

import numpy as np
from scipy.integrate import solve_ivp

from chladni.models.integrator.simulate import simulate
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.models.structures.made_models import GAIN, KP, KV, LIMIT, MASS, VISCOUS, axis

RATE_HZ, STEP_M = 500.0, 0.02


def command(*, samples: int, pulse_v: float = 0.0) -> TimeSeries:
    values = np.stack([np.full(samples, STEP_M), np.full(samples, pulse_v)])
    channels = (Channel(name="/command", unit="m"), Channel(name="/pulses", unit="V"))
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, channels=channels)


def written_out(samples: int, pulse_v: float) -> tuple[Real, Real]:
    """Position and force of the limited loop, by an independent solver."""

    def force(state: Real) -> Real:
        wanted = KV * (KP * (STEP_M - state[0]) - state[1]) + pulse_v
        return np.asarray(GAIN * np.clip(wanted, -LIMIT, LIMIT))

    time_s = np.arange(samples) / RATE_HZ
    solved = solve_ivp(
        lambda _t, state: [state[1], (force(state) - VISCOUS * state[1]) / MASS],
        (0.0, time_s[-1]), [0.0, 0.0], t_eval=time_s, method="DOP853", rtol=1e-10, atol=1e-13, max_step=1e-3,
    )  # fmt: skip
    return solved.y[0], force(solved.y)


def test_a_limit_bounds_the_force_that_acts() -> None:
    for pulse_v in (0.0, 5.0):
        # The limit takes away most of a command that is eighty times as large, and digits with it: hence 1e-9.
        simulation = simulate(axis(limit=LIMIT), command(samples=200, pulse_v=pulse_v), tolerance=1e-9)
        position, force = written_out(200, pulse_v)
        outputs = simulation.outputs
        found = outputs.values[[outputs.index("position"), outputs.index("/effort")]]
        # The force follows the position by the loop's stiffness.
        atol_m = 1e-6 * np.abs(position).max()
        np.testing.assert_allclose(found[0], position, atol=atol_m)
        np.testing.assert_allclose(found[1], force, atol=GAIN * KV * KP * atol_m)
        assert np.abs(found[1]).max() <= GAIN * LIMIT * (1 + 1e-12)
        assert any(flag.startswith("axis is at its limit of 10 V for ") for flag in simulation.flags)


def test_a_limit_that_is_never_reached_changes_nothing() -> None:
    free = simulate(axis(), command(samples=100))
    held = simulate(axis(limit=1e6), command(samples=100))
    np.testing.assert_allclose(
        held.outputs.values, free.outputs.values, atol=1e-7 * np.abs(free.outputs.values).max()
    )
    assert held.flags == ()


def test_a_loop_that_runs_away_says_so() -> None:
    unstable = axis(law="pi", gains={"kp": 1.0, "ki": 90.0})
    flags = simulate(unstable, command(samples=100)).flags
    assert any(flag.startswith("the closed loop is unstable: poles at ") for flag in flags)

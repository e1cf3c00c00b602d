import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chladni.models.core.port_law import PortLaw
from chladni.models.drives.mr_shipped import MEASURED_DAMPER_ASYMMETRIC
from chladni.models.integrator.known_motion import force_along_motion
from chladni.signals.errors import ModelError


def maxwell(_d, s, _t, parameters, state, rates):
    """A damper behind a spring: F' = k (s - F/c)."""
    rates[0] = parameters[0] * (s - state[0] / parameters[1])
    return float(state[0])


def bursting(_d, _s, _t, _parameters, state, rates):
    """Grows beyond all numbers in a finite time."""
    rates[0] = state[0] * state[0]
    return float(state[0])


def following(d, s, t, _parameters, state, rates):
    """Asks everything that a law is told."""
    rates[0] = d + 10.0 * s + 100.0 * t
    return float(d + state[0])


MAXWELL = PortLaw(port=0, function=maxwell, parameters=(2.0, 3.0), state=(0.5,))


def test_a_law_with_a_closed_form_is_met_with_the_order_of_the_method():
    """Constant velocity: F = c s + (F0 - c s) exp(-k t/c); the error falls as the fourth power of the step."""
    t = np.linspace(0.0, 3.0, 7)
    exact = 6.0 + (0.5 - 6.0) * np.exp(-2.0 * t / 3.0)
    errors = [
        np.abs(force_along_motion(MAXWELL, 2.0 * t, np.full(7, 2.0), t, substeps=count) - exact).max()
        for count in (1, 2, 4, 8)
    ]
    order = -np.polyfit(np.log([1, 2, 4, 8]), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.15)
    assert errors[-1] < 1e-7


def test_steps_may_differ_and_a_law_is_told_place_speed_and_time():
    """state' = d + 10 s + 100 t with d = t^2, s = 2 t sampled unevenly: linear between samples."""
    t = np.array([0.0, 0.1, 0.4, 0.5, 1.2])
    d, s = t**2, 2.0 * t
    rates = d + 10.0 * s + 100.0 * t
    state = np.concatenate([[0.0], np.cumsum(np.diff(t) * (rates[1:] + rates[:-1]) / 2)])
    law = PortLaw(port=0, function=following, state=(0.0,))
    assert force_along_motion(law, d, s, t) == pytest.approx(d + state, rel=1e-13)


def test_the_damper_agrees_with_another_integrator_on_the_same_motion():
    law = MEASURED_DAMPER_ASYMMETRIC.law(0.5)
    t = np.arange(0.0, 2.0, 0.002)
    x, v = 0.02 * np.sin(np.pi * t), 0.02 * np.pi * np.cos(np.pi * t)

    def rates(time, state):
        found = [0.0, 0.0]
        law.function(0.0, 0.02 * np.pi * np.cos(np.pi * time), time, law.parameters, list(state), found)
        return found

    solved = solve_ivp(rates, (0.0, t[-1]), law.state, t_eval=t, method="Radau", rtol=1e-9, atol=1e-12)
    pairs = zip(x, v, solved.y.T, strict=True)
    oracle = np.array([law.function(d, s, 0.0, law.parameters, list(state), [0.0, 0.0]) for d, s, state in pairs])
    error = force_along_motion(law, x, v, t) - oracle
    # The velocity between samples is a straight line: its error is (omega dt)^2/8 = 5e-6 of the velocity.
    assert np.sqrt(np.mean(error**2) / np.mean(oracle**2)) < 2e-5


def test_where_the_states_grow_beyond_all_numbers_there_is_no_force():
    law = PortLaw(port=0, function=bursting, state=(1.0,))
    t = np.linspace(0.0, 8.0, 9)
    force = force_along_motion(law, t, t, t)
    assert force[0] == 1.0
    assert np.isnan(force[-1])


def test_motions_that_do_not_fit_together_are_refused():
    t = np.arange(3.0)
    with pytest.raises(ModelError, match=r"shapes \(3,\), \(2,\), \(3,\)"):
        force_along_motion(MAXWELL, t, t[:2], t)
    with pytest.raises(ModelError, match="times must rise"):
        force_along_motion(MAXWELL, t, t, t[::-1])
    with pytest.raises(ModelError, match="every interval needs a step"):
        force_along_motion(MAXWELL, t, t, t, substeps=0)

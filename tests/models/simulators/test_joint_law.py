"""Laws at joints, asked step by step."""

import numpy as np
import pytest

from chladni.models.core.port_law import PortLaw
from chladni.models.effects.coulomb_friction import bristle, regularised
from chladni.models.effects.quadratic_damping import quadratic
from chladni.models.simulators.joint_law import JointLaw


def test_forces_add_up():
    law = JointLaw(
        laws=(
            PortLaw(port=0, function=quadratic, parameters=(2.0,)),
            PortLaw(port=0, function=regularised, parameters=(5.0, 0.5, 1e-6)),
        )
    ).started()
    assert law(0.0, 3.0, 0.0) == pytest.approx(2.0 * 9.0 + 5.0 + 0.5)


def test_states_start_anew_with_each_run():
    law = JointLaw(laws=(PortLaw(port=0, function=bristle, parameters=(1.0, 0.0, 0.01), state=(0.0,)),))
    first = law.started()
    for step in range(10):
        first(0.0, 1.0, 0.01 * step)
    assert first(0.0, 1.0, 0.1) > 0.9
    assert law.started()(0.0, 1.0, 0.0) == 0.0


def test_bristle_follows_dahls_closed_form():
    # At constant speed w = 1 - exp(-travel/presliding); one implicit step errs by half its share of the presliding.
    law = JointLaw(laws=(PortLaw(port=0, function=bristle, parameters=(3.0, 0.0, 0.01), state=(0.0,)),)).started()
    step_s, speed = 1e-4, 0.5
    force = np.array([law(speed * step_s * step, speed, step_s * step) for step in range(1000)])
    exact = 3.0 * (1 - np.exp(-speed * step_s * np.arange(1000) / 0.01))
    assert np.abs(force - exact).max() < 3.0 * 0.5 * speed * step_s / 0.01


def test_bristle_stiffer_than_the_step_stays_bounded():
    law = JointLaw(laws=(PortLaw(port=0, function=bristle, parameters=(3.0, 0.0, 1e-9), state=(0.0,)),)).started()
    speeds = np.sin(np.linspace(0, 40, 400))
    force = np.array([law(0.0, speed, 0.01 * step) for step, speed in enumerate(speeds)])
    assert np.abs(force).max() <= 3.0 * (1 + 1e-6)
    sliding = np.abs(speeds[1:]) > 0.1
    assert np.allclose(force[1:][sliding], 3.0 * np.sign(speeds[1:][sliding]), rtol=1e-3)


def test_trace_holds_what_was_asked():
    law = JointLaw(laws=(PortLaw(port=0, function=quadratic, parameters=(1.0,)),)).started()
    law(0.1, 2.0, 0.0)
    law(0.2, -3.0, 0.5)
    assert law.trace == [(0.0, 0.1, 2.0, 4.0), (0.5, 0.2, -3.0, -9.0)]

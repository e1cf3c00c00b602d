"""Python functions as simulators."""

import numpy as np
import pytest

import chladni
from chladni.models.core.port import Port, Terminal
from chladni.models.integrator.integrator import Integrator
from chladni.models.simulators.callable_simulator import callable_simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator
from chladni.signals.errors import ModelError
from tests.models.simulators.slide import RATE_HZ, in_python, model, smooth

U, Y = Terminal(name="u", unit="N"), Terminal(name="y", unit="m")


def simulator(function, joints=()):
    return callable_simulator(function, name="f", inputs=(U,), outputs=(Y,), joints=joints)


def test_parameters_reach_the_function():
    stiff = WrappedSimulator(simulator=in_python(), values={"stiffness": 1600.0})
    constant = np.full((1, 2000), 8.0)
    # At rest in the end: the spring holds the force.
    assert stiff.respond(constant, RATE_HZ).outputs[0, -1] == pytest.approx(8.0 / 1600.0, rel=1e-3)


def test_friction_around_a_function_acts_as_around_a_model():
    rate_hz = 2000.0
    force = smooth(4000, rate_hz)
    friction = chladni.attached("coulomb_friction", "guide", {"force": 6.0, "creep_speed": 0.02})
    found = WrappedSimulator(simulator=in_python(), effects=(friction,)).respond(force, rate_hz)
    exact = Integrator(model().with_effects([friction]).compile(), rate_hz).run(force)
    without = Integrator(model().compile(), rate_hz).run(force)
    scale = np.abs(exact.outputs).max(axis=1)
    # The function steps by Euler: its error is of the order of the step, 0.0005 s times 20 rad/s.
    assert np.all(np.abs(found.outputs - exact.outputs).max(axis=1) < 0.02 * scale)
    assert np.all(np.abs(without.outputs - exact.outputs).max(axis=1) > 0.1 * scale)
    (motion,) = found.motions
    assert np.abs(motion.force).max() == pytest.approx(6.0, rel=1e-3)
    assert np.allclose(motion.displacement, found.outputs[0])


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda inputs, *_: inputs[:, :-1], "shape"),
        (lambda inputs, *_: np.full_like(inputs, np.nan), "is nan at 0 s"),
    ],
)
def test_wrong_answers_are_told(function, message):
    with pytest.raises(ModelError, match=message):
        simulator(function).respond(np.ones((1, 10)), RATE_HZ, values={}, joint_laws={})


def test_a_law_that_is_never_asked_is_told():
    deaf = simulator(lambda inputs, *_: inputs, joints=(Port(name="elbow", kind="joint"),))
    friction = chladni.attached("coulomb_friction", "elbow", {"force": 1.0})
    with pytest.raises(ModelError, match="never asked the law at joint 'elbow'"):
        WrappedSimulator(simulator=deaf, effects=(friction,)).respond(np.ones((1, 10)), RATE_HZ)


def test_names_are_unique():
    with pytest.raises(ModelError, match="'u' is used twice"):
        callable_simulator(lambda inputs, *_: inputs, name="f", inputs=(U,), outputs=(U,))
    with pytest.raises(ModelError, match="of kind body"):
        simulator(lambda inputs, *_: inputs, joints=(Port(name="b", kind="body"),))


def test_an_effect_elsewhere_is_told():
    with pytest.raises(ModelError, match="has no 'wrist'"):
        WrappedSimulator(simulator=in_python(), effects=(chladni.attached("delay", "wrist", {"delay": 0.1}),))
    with pytest.raises(ModelError, match="stiffness"):
        WrappedSimulator(simulator=in_python(), values={"stiff": 1.0})

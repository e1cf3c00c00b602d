from dataclasses import replace
from math import pi

import numpy as np
import pytest

from chladni.models.core.compiled_model import CompiledModel, DelayLine, GeneratedInput
from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.core.state_space import StateSpace
from chladni.signals.errors import ModelError

FREQUENCY_HZ = np.geomspace(0.01, 100.0, 41)
S = 2j * pi * FREQUENCY_HZ
DECAY = 3.0


def lag(*, derivatives: int = 0) -> CompiledModel:
    """x' = -3 x + u, y = x, with an input port: d = u, f adds to u."""
    columns = 1 + derivatives
    return CompiledModel(
        a=np.array([[-DECAY]]), b=np.eye(1, columns), c=np.ones((1, 1)), d=np.zeros((1, columns)), g=np.ones((1, 1)),
        h=np.zeros((1, 1)), displacement_state=np.zeros((1, 1)), displacement_column=np.eye(1, columns),
        displacement_port=np.zeros((1, 1)), velocity_state=np.zeros((1, 1)), velocity_column=np.zeros((1, columns)),
        velocity_port=np.zeros((1, 1)), inputs=(Terminal(name="u", unit="N", derivatives=derivatives),),
        outputs=(Terminal(name="y", unit="m"),), states=("x",), ports=(Port(name="u", kind="input"),),
    )  # fmt: skip


def still(_d: float, _s: float, _t: float, _parameters: object, _state: object, _rates: object) -> float:
    return 0.0


def test_the_response_of_a_lag_is_the_textbooks() -> None:
    np.testing.assert_allclose(lag().frequency_response(FREQUENCY_HZ)[0, 0], 1 / (S + DECAY), rtol=1e-13)
    np.testing.assert_allclose(
        lag().state_space().frequency_response(FREQUENCY_HZ)[0, 0], 1 / (S + DECAY), rtol=1e-13
    )
    np.testing.assert_allclose(lag().state_space().poles(), [-DECAY])


def test_dead_times_and_offsets_turn_the_phase_and_nothing_else() -> None:
    at_port = replace(lag(), delays=(DelayLine(port=0, delay_s=0.2),))
    at_input, at_output = replace(lag(), input_delays_s=(0.2,)), replace(lag(), output_offsets_s=(0.2,))
    for model in (at_port, at_input, at_output):
        found = model.frequency_response(FREQUENCY_HZ)[0, 0]
        np.testing.assert_allclose(found, np.exp(-0.2 * S) / (S + DECAY), rtol=1e-12)


def test_a_delay_inside_a_loop_is_closed_exactly() -> None:
    # u' = u - x(t - 0.2) fed back with unit gain: H = 1/(s + 3 + e^{-0.2 s}).
    loop = replace(
        lag(), a=np.array([[-DECAY - 1]]), g=-np.ones((1, 1)), displacement_state=np.ones((1, 1)),
        displacement_column=np.zeros((1, 1)), delays=(DelayLine(port=0, delay_s=0.2),),
    )  # fmt: skip
    expected = 1 / (S + DECAY + np.exp(-0.2 * S))
    np.testing.assert_allclose(loop.frequency_response(FREQUENCY_HZ)[0, 0], expected, rtol=1e-12)


def test_an_input_with_derivatives_has_a_response_but_no_state_space() -> None:
    model = replace(lag(derivatives=2), b=np.array([[1.0, 0.5, 0.25]]))
    expected = (1 + 0.5 * S + 0.25 * S**2) / (S + DECAY)
    np.testing.assert_allclose(model.frequency_response(FREQUENCY_HZ)[0, 0], expected, rtol=1e-12)
    with pytest.raises(ModelError, match="no state space"):
        model.state_space()


def test_columns_are_counted_with_derivatives_and_generated_inputs() -> None:
    assert lag(derivatives=2).columns == 3
    shaking = GeneratedInput(terminal=Terminal(name="floor", unit="m/s^2"), samples=np.zeros_like)
    wider = {name: np.zeros((1, 2)) for name in ("b", "d", "displacement_column", "velocity_column")}
    model = replace(lag(), generated=(shaking,), **wider)
    assert model.columns == 2
    assert model.column_of("u") == 0


def test_laws_and_maps_make_a_model_nonlinear_and_delays_do_not() -> None:
    assert replace(lag(), delays=(DelayLine(port=0, delay_s=0.1),)).is_linear()
    assert not replace(lag(), laws=(PortLaw(port=0, function=still),)).is_linear()
    assert not replace(lag(), input_maps=((0, lambda samples, _rate_hz: samples),)).is_linear()


def test_ports_and_columns_are_found_by_name_or_named() -> None:
    assert lag().port_index("u") == 0
    assert lag().port_index("u", "input") == 0
    with pytest.raises(ModelError, match="no joint 'u'; there are: none"):
        lag().port_index("u", "joint")
    with pytest.raises(ModelError, match="no site 'v'; there are: u"):
        lag().port_index("v")
    with pytest.raises(ModelError, match="no input 'v'; inputs: u"):
        lag().column_of("v")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"a": np.zeros((2, 2))}, r"a has shape \(2, 2\), \(1, 1\) was expected"),
        ({"g": np.full((1, 1), np.nan)}, "g holds a number that is not finite"),
        ({"input_delays_s": (0.0, 0.0)}, "input_delays_s has 2 values, 1 were expected"),
        ({"output_offsets_s": (0.0, 0.0)}, "output_offsets_s has 2 values, 1 were expected"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        replace(lag(), **change)


def test_a_state_space_names_what_it_has_not() -> None:
    system = lag().state_space()
    with pytest.raises(ModelError, match="no output 'z'; outputs: y"):
        system.output_index("z")
    with pytest.raises(ModelError, match="no input 'z'; inputs: u"):
        system.input_index("z")
    assert (system.input_index("u"), system.output_index("y")) == (0, 0)
    with pytest.raises(ModelError, match="c holds a number"):
        replace(system, c=np.full((1, 1), np.inf))
    with pytest.raises(ModelError, match="b has shape"):
        StateSpace(
            a=system.a, b=np.zeros((2, 1)), c=system.c, d=system.d, inputs=system.inputs, outputs=system.outputs,
            states=system.states,
        )  # fmt: skip

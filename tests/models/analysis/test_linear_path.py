"""What a linear path keeps of a system, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.models.analysis.linear_path import linear_path, rate_unit
from chladni.models.core.port import Terminal
from chladni.signals.errors import ModelError
from tests.models.analysis.systems import compiled, gain_only, pt2, state_space


def test_states_that_have_no_part_are_left_out() -> None:
    # x0 is reached and seen; x1 isn't reached; x2 is reached, but only y2 sees it.
    system = state_space(np.diag([-1.0, -2.0, -3.0]), [1, 0, 1], [[1, 1, 0], [0, 0, 1]])

    path = linear_path(system)

    assert path.kept.tolist() == [0, 2]
    assert path.to("y1").kept.tolist() == [0]
    assert path.to("y2").poles.tolist() == [-3.0]


def test_scaling_changes_no_response() -> None:
    rough = state_space([[0, 1e-7], [-4e7, -0.4]], [0, 1e9], [1e-3, 0])
    path = linear_path(rough)

    assert np.abs(path.a).max() / np.abs(path.a[path.a != 0]).min() < 100
    assert np.abs(path.b).max() <= 2 * np.abs(path.a).max()
    exact = 1e-3 * 1e-7 * 1e9 / (1e-7 * 4e7)
    assert path.final_value() == pytest.approx(exact, rel=1e-14)


def test_poles_of_integrators_are_exactly_zero() -> None:
    double = state_space([[0, 1, 0], [0, 0, 1], [0, 0, -1e4]], [0, 0, 1], [1, 0, 0])
    path = linear_path(double)

    assert path.integrators() == 2
    assert path.stable()
    assert path.poles.tolist() == [0, 0, -1e4]


def test_the_rate_of_a_path_is_the_path_of_the_rate() -> None:
    path = linear_path(pt2(3.0, 0.2))
    rate = path.rate()
    assert rate is not None
    assert (rate.outputs[0].unit, rate.final_value()) == ("m/s", pytest.approx(0, abs=1e-15))
    acceleration = rate.rate()
    assert acceleration is not None
    assert acceleration.d[0] == pytest.approx(9.0, rel=1e-15)
    assert acceleration.rate() is None
    assert rate_unit("A") == "(A)/s"


def test_dead_times_of_input_and_output_add_up() -> None:
    model = compiled(pt2(1.0, 0.5), input_delays_s=(0.3,), output_offsets_s=(0.2,))
    assert linear_path(model).dead_time_s.tolist() == [0.5]


def test_unknown_names_and_empty_systems_are_refused() -> None:
    system = pt2(1.0, 0.5)
    with pytest.raises(ModelError, match="no input 'v'; inputs: u"):
        linear_path(system, from_input="v")
    with pytest.raises(ModelError, match="no output 'z'; outputs: y"):
        linear_path(system).to("z")
    heard = state_space([[0.0]], [1], [1])
    deaf = replace(heard, b=np.zeros((1, 0)), d=np.zeros((1, 0)), inputs=())
    with pytest.raises(ModelError, match="without inputs"):
        linear_path(deaf)


def test_an_input_whose_derivatives_act_is_refused() -> None:
    moved = compiled(
        pt2(1.0, 0.5), inputs=(Terminal(name="u", unit="m", derivatives=1),), b=np.zeros((2, 2)), d=np.zeros((1, 2)),
        displacement_column=np.zeros((0, 2)), velocity_column=np.zeros((0, 2)),
    )  # fmt: skip
    with pytest.raises(ModelError, match="prescribes a motion"):
        linear_path(moved)


def test_a_gain_alone_is_a_path() -> None:
    path = linear_path(gain_only(3.0))
    assert (path.final_value(), path.poles.size, path.stable()) == (3.0, 0, True)

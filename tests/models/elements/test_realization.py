import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.core.port import Terminal
from chladni.models.elements.realization import realize, state_space
from chladni.models.elements.transfer_function import TransferFunction
from chladni.signals.errors import ModelError

coefficients = st.lists(st.floats(0.1, 10.0), min_size=1, max_size=5).map(tuple)


@given(num=coefficients, den=coefficients, unit=st.floats(1e-6, 1e6))
def test_realization_is_the_transfer_function(num: tuple[float, ...], den: tuple[float, ...], unit: float) -> None:
    # Time counted in any unit: the form must not depend on whether poles lie at 1e-6 or 1e6 rad/s.
    scale = unit ** -np.arange(5.0)
    num = tuple(np.asarray(num[::-1]) * scale[: len(num)])[::-1]
    den = tuple(np.asarray(den[::-1]) * scale[: len(den)])[::-1]
    transfer = TransferFunction(num=num, den=den)
    form = realize(transfer)
    frequency_hz = unit * np.geomspace(0.01, 10, 15) / (2 * np.pi)
    s = 2j * np.pi * frequency_hz
    solved = np.array([np.linalg.solve(p * np.eye(form.b.size) - form.a, form.b) for p in s])
    found = solved @ form.c + np.polyval(form.q[::-1], s)
    expected = transfer.frequency_response(frequency_hz)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_entries_are_of_the_size_of_the_poles() -> None:
    form = realize(TransferFunction(num=(1,), den=(1e-12, 2e-7, 1)))
    assert np.abs(form.a).max() <= 2e6
    assert np.abs(form.c).max() <= 2.0


def test_a_constant_has_no_state_and_an_integrator_one() -> None:
    assert realize(TransferFunction(num=(3,))).a.shape == (0, 0)
    integrator = realize(TransferFunction(num=(3,), den=(1, 0)))
    assert integrator.a.tolist() == [[0.0]]
    assert integrator.b[0] * integrator.c[0] == 3.0


def test_an_improper_function_keeps_its_polynomial() -> None:
    # (s^2 + 3 s + 2)/(s + 1) is s + 2; with a rest of 1 over it.
    np.testing.assert_allclose(realize(TransferFunction(num=(1, 3, 3), den=(1, 1))).q, [2.0, 1.0])


def test_state_space_of_an_improper_function_needs_a_filter() -> None:
    derivative = TransferFunction(num=(0.5, 0))
    with pytest.raises(ModelError, match=r"num is of order 1, den of order 0: it differentiates.*give filter_time_s"):
        state_space(derivative)
    frequency_hz = np.array([0.1, 1.0])
    found = state_space(derivative, filter_time_s=1e-3).frequency_response(frequency_hz)[0, 0]
    np.testing.assert_allclose(found, derivative.filtered(1e-3).frequency_response(frequency_hz), rtol=1e-12)


def test_state_space_refuses_dead_time_and_names_what_it_is_told() -> None:
    with pytest.raises(ModelError, match=r"a dead time of 0.2 s has no state space"):
        state_space(TransferFunction(num=(1,), delay_s=0.2))
    named = state_space(
        TransferFunction(num=(1,), den=(1, 1)),
        entry=Terminal(name="voltage", unit="V"),
        exit_=Terminal(name="speed", unit="rad/s"),
    )
    assert (named.inputs[0].name, named.outputs[0].unit, named.states) == ("voltage", "rad/s", ("x1",))

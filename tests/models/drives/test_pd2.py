import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.drives.pd2 import pd2
from tests.models.drives.oracles import FREQUENCY_HZ


def correction(**changes):
    given = {"gain": 1.3, "derivative_s": 2e-3, "second_derivative_s2": 4e-5, "filter_s": 5e-3, **changes}
    return given, pd2(**given, entry=Terminal(name="u", unit="V"), exit_=Terminal(name="y", unit="V"))


@pytest.mark.parametrize("changes", [{}, {"derivative_s": -1e-3}, {"second_derivative_s2": 0.0}])
def test_response_is_the_papers_polynomial_over_the_declared_filter(changes):
    p, system = correction(**changes)
    s = 2j * np.pi * FREQUENCY_HZ
    above = 1 + p["derivative_s"] * s + p["second_derivative_s2"] * s**2
    expected = p["gain"] * above / (1 + p["filter_s"] * s) ** 2
    found = system.frequency_response(FREQUENCY_HZ)[0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-13 * np.abs(expected).max())


def test_a_step_is_answered_at_once_by_the_second_derivative_alone():
    p, system = correction()
    assert system.d.item() == pytest.approx(p["gain"] * p["second_derivative_s2"] / p["filter_s"] ** 2, rel=1e-12)
    assert (system.inputs[0].name, system.outputs[0].name) == ("u", "y")

import numpy as np
import pytest

from chladni.models.elements.rational import rational
from chladni.models.elements.transfer_function import TransferFunction
from chladni.signals.errors import ModelError


def test_coefficients_are_parameters_and_come_back() -> None:
    made = rational((2, 0, 1), (3, 4), delay_s=0.5)
    assert made.parameters.numbers() == {"num_s2": 2, "num_s0": 1, "den_s1": 3, "den_s0": 4, "delay": 0.5}
    assert made.transfer == TransferFunction(num=(2, 0, 1), den=(3, 4), delay_s=0.5)


def test_a_changed_coefficient_changes_the_function() -> None:
    changed = rational((2, 1), (1, 0, 3)).with_values({"den_s0": 5.0, "num_s1": 0.0})
    assert changed.transfer == TransferFunction(num=(1,), den=(1, 0, 5))


def test_zero_is_a_function_too() -> None:
    assert rational((0.0,)).transfer.num == (0.0,)
    assert not rational((-2.0, 0.0), (1.0, 1.0)).parameters.unusual()


def test_what_makes_no_function_is_refused() -> None:
    with pytest.raises(ModelError, match="den is zero"):
        rational((1,), (0,))
    made = rational((1,), (2,))
    with pytest.raises(ModelError, match="den is zero"):
        _ = made.with_values({"den_s0": 0.0}).transfer
    with pytest.raises(ModelError, match="delay: -1 s is not possible"):
        rational((1,), delay_s=0.1).with_values({"delay": -1.0})


def test_tolerances_and_ranges_follow_the_user() -> None:
    made = rational((4,)).with_tolerances({"num_s0": 0.3})
    assert made.parameters["num_s0"].tolerance == 0.3
    with pytest.raises(ModelError, match="no parameter 'gain'"):
        made.with_tolerances({"gain": 0.1})
    wide = made.with_usual_value("num_s0", -1000.0)
    assert not wide.parameters.unusual()
    np.testing.assert_allclose(wide.transfer.num, (-1000.0,))

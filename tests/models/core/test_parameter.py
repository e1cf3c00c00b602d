import math

import pytest

from chladni.models.core.parameter import Parameter, Parameters
from chladni.signals.errors import ModelError


def mass(value: float = 2.0) -> Parameter:
    return Parameter(name="mass", value=value, unit="kg", low=1.0, high=5.0, minimum=0.0)


def test_values_are_replaced_by_name_and_the_rest_stays() -> None:
    parameters = Parameters((mass(), Parameter(name="gain", value=1.0, low=0.0, high=2.0)))
    changed = parameters.with_values({"mass": 3})
    assert changed.numbers() == {"mass": 3.0, "gain": 1.0}
    assert parameters.numbers() == {"mass": 2.0, "gain": 1.0}
    assert list(changed) == ["mass", "gain"]
    assert len(changed) == 2


@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_an_impossible_value_is_refused_with_its_name(value: float) -> None:
    with pytest.raises(ModelError, match=r"^mass: "):
        mass(value)


def test_both_ends_of_the_possible_range_are_allowed() -> None:
    assert mass(0.0).value == 0.0


@pytest.mark.parametrize(("value", "usual"), [(1.0, True), (5.0 * (1 + 1e-12), True), (5.1, False), (0.9, False)])
def test_a_value_outside_the_usual_range_is_told(value: float, usual: bool) -> None:
    parameters = Parameters((mass(value),))
    assert parameters["mass"].usual is usual
    assert bool(parameters.unusual()) is not usual


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    parameters = Parameters((mass(),))
    with pytest.raises(ModelError, match="did you mean mass"):
        parameters.with_values({"mas": 1.0})
    with pytest.raises(ModelError, match="parameters: mass"):
        parameters.require("colour")
    with pytest.raises(KeyError):
        parameters["colour"]


def test_names_are_unique() -> None:
    with pytest.raises(ModelError, match="'mass' is declared 2 times"):
        Parameters((mass(), mass()))


def test_a_number_without_a_unit_is_told_without_one() -> None:
    shape = Parameter(name="shape", value=1.0, low=1.0, high=10.0, minimum=1.0, maximum=50.0)
    with pytest.raises(ModelError, match=r"^shape: 0\.5 is not possible; give a value from 1 to 50$"):
        shape.with_value(0.5)
    with pytest.raises(ModelError, match=r"^shape: nan is not finite; give a number$"):
        shape.with_value(float("nan"))

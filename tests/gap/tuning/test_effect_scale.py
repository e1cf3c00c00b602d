import numpy as np
import pytest

from chladni.gap.tuning.effect_scale import effect_numbers, with_numbers
from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError

FRICTION = attached("coulomb_friction", "elbow", {"force": 8.0})
STOP = attached("one_sided_stop", "elbow", {"stiffness": 1e6, "clearance": -1e-4, "side": -1.0})


def test_positive_numbers_move_by_factors_and_signed_ones_by_steps():
    numbers = effect_numbers([FRICTION, STOP], [["force", "offset"], ["clearance"]])
    found = with_numbers([FRICTION, STOP], numbers, np.array([np.log(2.0), 0.0, 0.5]))
    assert found[0].values["force"] == pytest.approx(16.0)
    assert found[0].values["offset"] == 0.0
    assert found[1].values["clearance"] == pytest.approx(-0.5e-4)
    assert found[1].values["stiffness"] == 1e6


def test_at_zero_nothing_changes():
    numbers = effect_numbers([FRICTION, STOP])
    assert with_numbers([FRICTION, STOP], numbers, np.zeros(3)) == (FRICTION, STOP)


@pytest.mark.parametrize("x", [-0.7, 0.0, 0.4])
def test_slopes_are_those_of_the_values(x):
    for number in effect_numbers([FRICTION, STOP], [["force", "offset"], ["clearance"]]):
        difference = (number.value(x + 1e-6) - number.value(x - 1e-6)) / 2e-6
        assert number.slope(x) == pytest.approx(difference, rel=1e-8)


def test_bounds_are_what_is_possible():
    force, clearance = effect_numbers([FRICTION, STOP], [["force"], ["clearance"]])
    assert force.value(force.high) == pytest.approx(1e9)
    assert force.value(force.low) == pytest.approx(8e-6)
    assert clearance.value(clearance.low) == pytest.approx(-1e3)
    shape = effect_numbers([attached("hysteresis", "j", {"force": 1.0, "yield": 1e-4, "shape": 2.0})], [["shape"]])[0]
    assert shape.value(shape.low) == pytest.approx(1.0)


def test_a_choice_is_not_fitted():
    assert STOP.usually_fitted == ("stiffness", "clearance")
    assert FRICTION.usually_fitted == ("force",)


def test_what_makes_a_form_of_a_law_is_fitted_with_it():
    values = {"force": 1.0, "yield": 1e-4}
    assert attached("hysteresis", "j", values).usually_fitted == ("force", "yield")
    creeping = attached("hysteresis", "j", values, variant="creeping")
    assert creeping.usually_fitted == ("force", "yield", "slip_speed", "loop")


def test_a_name_that_is_given_twice_is_one_number():
    assert len(effect_numbers([FRICTION], [["force", "offset", "force"]])) == 2


def test_mistakes_are_named():
    with pytest.raises(ModelError, match="no parameter 'forze'; did you mean force"):
        effect_numbers([FRICTION], [["forze"]])
    with pytest.raises(ModelError, match="1 effects, there are 2"):
        effect_numbers([FRICTION, STOP], [["force"]])

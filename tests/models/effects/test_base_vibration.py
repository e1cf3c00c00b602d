import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body
from tests.models.structures.made_models import tree

VALUES = {"level": 0.2, "band": 40.0, "seed": 3}


def test_it_acts_where_the_grounds_acceleration_acts() -> None:
    plant = tree().compile()
    shaken = attached("base_vibration", "ground", VALUES).attach(plant)
    floor = plant.column_of("floor")
    np.testing.assert_array_equal(shaken.b[:, -1], plant.b[:, floor])
    np.testing.assert_array_equal(shaken.d[:, -1], plant.d[:, floor])
    assert shaken.generated[0].terminal.unit == "m/s^2"
    assert shaken.generated[0].terminal.name == "ground.base_vibration"
    assert shaken.is_linear()


def test_an_oscillator_on_a_body_feels_it() -> None:
    oscillator = attached("extra_mode", "left", {"mass": 0.4, "frequency": 12.0, "damping_ratio": 0.03})
    shaken = oscillator.attach(attached("base_vibration", "ground", VALUES).attach(tree().compile()))
    np.testing.assert_allclose(shaken.b[:, -1], shaken.b[:, shaken.column_of("floor")], rtol=1e-12)
    assert shaken.b[-1, -1] == pytest.approx(-1.0)


def test_two_floors_keep_their_names_apart() -> None:
    once = attached("base_vibration", "ground", VALUES).attach(one_body())
    twice = attached("base_vibration", "ground", {**VALUES, "seed": 4}).attach(once)
    assert [one.terminal.name for one in twice.generated] == ["ground.base_vibration", "ground.base_vibration.2"]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"level": 1.0, "band": 5.0, "band_start": 5.0}, r"band_start = 5 Hz must be below band = 5 Hz"),
        ({"level": 1.0, "band": 5.0, "seed": 1.5}, r"seed = 1.5 must be a whole number"),
    ],
)
def test_a_band_has_a_width_and_a_seed_is_whole(values: dict[str, float], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        attached("base_vibration", "ground", values)

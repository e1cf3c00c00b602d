import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.unbalance import rotor
from tests.models.effects.small_models import one_body


def law_of(effect: str, values: dict[str, float]):
    (law,) = attached(effect, "mass", values).attach(one_body()).laws
    return lambda t: law.function(0.0, 0.0, t, law.parameters, [], [])


def test_at_a_steady_speed_it_is_a_tone_of_mass_times_eccentricity_times_speed_squared() -> None:
    rotor_force = law_of("unbalance", {"moment": 2e-3, "frequency": 25.0, "phase": 0.4})
    tone = law_of("tonal_disturbance", {"amplitude": 2e-3 * (50 * np.pi) ** 2, "frequency": 25.0, "phase": 0.4})
    for t in (0.0, 0.013, 7.7):
        assert rotor_force(t) == pytest.approx(tone(t), abs=1e-9)


def test_it_turns_as_its_speed_says_and_grows_with_the_square() -> None:
    t = np.linspace(0.0, 2.0, 200_001)
    speed = 2 * np.pi * (10.0 + 15.0 * t)
    # The angle is the speed's integral: trapezoids are exact of a straight line.
    angle = 0.3 + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    numbers = (1.5, 2 * np.pi * 10.0, 2 * np.pi * 15.0, 0.3)
    for place in (0, 777, 150_000):
        found = rotor(0.0, 0.0, float(t[place]), numbers, [], [])
        assert found == pytest.approx(1.5 * speed[place] ** 2 * np.sin(angle[place]), abs=1e-5 * speed[place] ** 2)

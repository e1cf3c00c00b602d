"""What tells a law of a joint's motion from a floor that shakes under it."""

import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from tests.gap.arm import arm, measured

LAWS = [
    ("coulomb_friction", {"force": 4.0, "creep_speed": 2e-4}),
    ("hardening_stiffness", {"cubic": 4e12}),
    ("ripple", {"amplitude": 6.0, "period": 2e-5, "phase": 0.4}),
]


def left_at(effect, name: str) -> float:
    log = measured((effect,), seed=3)
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    (located,) = (one for one in location.ranked if name in one.places[0].names)
    site = next(one for one in located.places[0].sites if one.name == name)
    return left_by_any_law(location, located, site)


@pytest.mark.parametrize(("word", "values"), LAWS)
def test_a_law_of_the_joint_is_followed_whatever_its_name(word: str, values: dict[str, float]) -> None:
    assert left_at(chladni.attached(word, "shoulder", values), "shoulder") < 0.12


def test_a_filter_of_the_command_is_followed() -> None:
    assert left_at(chladni.attached("lag", "shaker", {"time_constant": 1e-3}), "shaker") < 0.12


@pytest.mark.parametrize("name", ["shoulder", "ground"])
def test_a_floor_that_shakes_follows_nothing(name: str) -> None:
    floor = chladni.attached("base_vibration", "ground", {"level": 1.0, "band": 150.0, "band_start": 5.0})
    assert left_at(floor, name) > 0.3

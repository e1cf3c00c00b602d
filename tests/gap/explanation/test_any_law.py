"""What tells a law of a joint's motion from a floor that shakes under it."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.explanation.any_law import _tones, left_by_any_law
from chladni.gap.location.locate import locate
from chladni.gap.plant.tunable import Tunables
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.effect_kind import EffectKind, Variant
from tests.gap.arm import arm, measured

LAWS = [
    ("coulomb_friction", {"force": 4.0, "creep_speed": 2e-4}),
    pytest.param("hardening_stiffness", {"cubic": 4e12}, marks=pytest.mark.nightly),
    pytest.param("ripple", {"amplitude": 6.0, "period": 2e-5, "phase": 0.4}, marks=pytest.mark.nightly),
]


@pytest.mark.parametrize("line", [40, 400])
def test_a_tone_stands_out_however_far_the_rest_lies_below(line: int) -> None:
    # Windowed it has three lines; the others are rounding, and so is their running sum.
    turns = np.cos(2.0 * np.pi * line * np.arange(3000) / 3000)
    motion = SimpleNamespace(force=1e20 * turns, displacement=np.ones(3000))
    np.testing.assert_allclose(_tones(cast("Any", motion))[0], turns, atol=1e-3)


def left_at(effect, name: str) -> float:
    log = measured((effect,), seed=3)
    location = locate(arm(), log, estimate_noise(log), Tunables.of(arm()))
    (located,) = (one for one in location.ranked if name in one.places[0].names)
    site = next(one for one in located.places[0].sites if one.name == name)
    return left_by_any_law(location, located, site)


@pytest.mark.nightly
@pytest.mark.parametrize(("word", "values"), LAWS)
def test_a_law_of_the_joint_is_followed_whatever_its_name(word: str, values: dict[str, float]) -> None:
    assert left_at(chladni.attached(word, "shoulder", values), "shoulder") < 0.12


def turning(d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``change cos(2 pi frequency t) d``."""
    return float(parameters[0] * np.cos(2.0 * np.pi * parameters[1] * t) * d)


TURNING_STIFFNESS = EffectKind(
    name="turning_stiffness",
    family="stiffness",
    meaning="stiffness of a shaft with a keyway",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(name="change", value=1e4, unit="N/m", low=0.0, high=1e9, minimum=0.0, maximum=1e12),
            Parameter(name="frequency", value=9.0, unit="Hz", low=0.1, high=1e3, minimum=1e-3, maximum=1e6),
        )
    ),
    neutral={"change": 0.0},
    variants=(
        Variant(
            name="harmonic",
            attach=LawAtPort(law=turning, numbers=lambda values, _: (values["change"], values["frequency"])),
            formula="F = change cos(2 pi frequency t) d",
        ),
    ),
)


@pytest.mark.nightly
def test_a_stiffness_that_turns_with_a_shaft_is_followed() -> None:
    shaft = chladni.attached(TURNING_STIFFNESS, "shoulder", {"change": 6e4, "frequency": 9.37})
    assert left_at(shaft, "shoulder") < 0.12


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "values"),
    [("lag", {"time_constant": 1e-3}), pytest.param("rate_limit", {"rate": 2e4}, marks=pytest.mark.nightly)],
)
def test_what_an_actuator_does_with_the_command_is_followed(word: str, values: dict[str, float]) -> None:
    assert left_at(chladni.attached(word, "shaker", values), "shaker") < 0.12


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("name", ["shoulder", pytest.param("ground", marks=pytest.mark.nightly)])
def test_a_floor_that_shakes_follows_nothing(name: str) -> None:
    floor = chladni.attached("base_vibration", "ground", {"level": 1.0, "band": 150.0, "band_start": 5.0})
    assert left_at(floor, name) > 0.3

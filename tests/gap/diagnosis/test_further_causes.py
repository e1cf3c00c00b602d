"""A third cause: looked for where two leave more than noise, named where it explains nearly all of that."""

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.diagnosis.further_causes import explains_the_rest, leaves_a_further
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.models.effects.attached_effect import AttachedEffect, attached
from tests.gap.arm import arm, measured

GAIN = attached("gain_error", "a", {"gain": 2.0})
DRAG = attached("quadratic_damping", "b", {"coefficient": 2.0})
LATE = attached("time_offset", "c", {"offset": 1e-3})
FRICTION = attached("coulomb_friction", "d", {"force": 2.0})


def leaving(*held: float, effects: tuple[AttachedEffect, ...]) -> Contestant:
    """Effects that leave so much of each output, mean square over the noise's."""
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return Contestant(hypothesis=hypothesis, fit=None, held=np.array(held), gap=0.0, prior=0.0)


def test_one_more_is_looked_for_beside_several_that_leave_more_than_noise_at_any_sensor() -> None:
    assert leaves_a_further(leaving(1.0, 1.5, 1.0, effects=(DRAG, GAIN)))
    assert not leaves_a_further(leaving(1.0, 1.2, 1.0, effects=(DRAG, GAIN)))
    assert not leaves_a_further(leaving(1.0, 5.0, 1.0, effects=(DRAG,)))
    assert leaves_a_further(leaving(1.0, 5.0, 1.0, effects=(DRAG, GAIN, LATE)))


@pytest.mark.parametrize(
    ("third", "left", "enough"),
    [
        # Of its RMS beyond the noise a law with details may leave 38 %, a number of a sensor 16 %.
        (FRICTION, 1.5, True),
        (FRICTION, 3.0, False),
        (LATE, 1.2, True),
        (LATE, 1.5, False),
    ],
)
def test_a_third_must_explain_nearly_all_that_two_leave(third, left, enough) -> None:
    two = leaving(1.0, 9.0, 1.0, effects=(DRAG, GAIN))
    assert explains_the_rest(two, leaving(1.0, left, 1.0, effects=(DRAG, GAIN, third))) is enough


def test_one_sensor_that_a_third_does_not_explain_is_not_hidden_by_another_that_it_does() -> None:
    two = leaving(9.0, 9.0, effects=(DRAG, GAIN))
    assert not explains_the_rest(two, leaving(1.0, 9.0, effects=(DRAG, GAIN, FRICTION)))


@pytest.mark.nightly
def test_three_causes_at_once_are_all_named() -> None:
    spring = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
    late = chladni.attached("time_offset", "acc_column", {"offset": 4e-4})
    gain = chladni.attached("gain_error", "acc_wrist", {"gain": 1.3})
    found = diagnose(arm(), [measured((spring, late, gain), seed=9, seconds=5.0)])
    assert {(one.effect, one.site) for one in found.causes} == {
        ("hardening_stiffness", "hand"), ("time_offset", "acc_column"), ("gain_error", "acc_wrist")
    }  # fmt: skip
    assert found.verdict == "effect"
    assert found.gap.explained == pytest.approx(1.0, abs=1e-3)
    numbers = {one.site: one.parameters for one in found.causes}
    assert numbers["acc_wrist"]["gain"].value == pytest.approx(1.3, rel=0.01)

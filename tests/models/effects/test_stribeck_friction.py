import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.motions import driven, energy, force, law_of, loop
from tests.models.effects.small_models import one_body

VALUES = {"coulomb": 5.0, "static": 8.0, "speed": 0.02}


def test_follows_stribecks_curve_above_the_creep_speed() -> None:
    law = law_of(attached("stribeck_friction", "spring", {**VALUES, "creep_speed": 1e-6}), one_body())
    for s in (1e-3, 0.01, 0.02, 0.1, 3.0):
        assert force(law, s=s) == pytest.approx(5.0 + 3.0 * np.exp(-((s / 0.02) ** 2)), rel=1e-12)


def test_is_coulombs_friction_when_static_and_sliding_are_equal() -> None:
    same = law_of(attached("stribeck_friction", "spring", {**VALUES, "static": 5.0}), one_body())
    coulomb = law_of(attached("coulomb_friction", "spring", {"force": 5.0}), one_body())
    for s in (-0.3, -1e-4, 0.0, 3e-5, 0.02):
        assert force(same, s=s) == pytest.approx(force(coulomb, s=s), abs=1e-15)


def test_a_bristle_slides_with_stribecks_curve() -> None:
    law = law_of(attached("stribeck_friction", "spring", VALUES, variant="bristle"), one_body())
    for speed in (0.005, 0.02, 0.2):
        # A way of 100 preslidings at a steady speed: nothing of the start is left.
        times_s = np.linspace(0.0, 1e-3 / speed, 50)
        found = driven(law, lambda t, v=speed: v * t, lambda _t, v=speed: v, times_s)
        assert found[-1] == pytest.approx(5.0 + 3.0 * np.exp(-((speed / 0.02) ** 2)), rel=1e-6)


def test_bristle_damping_acts_while_bristles_bend() -> None:
    values = {**VALUES, "presliding": 1e-5, "bristle_damping": 50.0}
    law = law_of(attached("stribeck_friction", "spring", values, variant="bristle"), one_body())
    # At the first moment no bristle is bent and all bend with the speed of the contact.
    assert law.function(0.0, 0.01, 0.0, law.parameters, [0.0], [0.0]) == pytest.approx(50.0 * 0.01, rel=1e-12)


def test_a_slow_cycle_takes_more_than_a_fast_one() -> None:
    law = law_of(attached("stribeck_friction", "spring", {**VALUES, "creep_speed": 1e-6}), one_body())
    slow, fast = energy(*loop(law, 1e-3, 0.5)), energy(*loop(law, 1e-3, 1e4))
    # At a speed of up to 0.5 mm/s it slides with the static friction, at 10 m/s with the sliding one.
    assert slow == pytest.approx(4 * 8.0 * 1e-3, rel=2e-3)
    assert fast == pytest.approx(4 * 5.0 * 1e-3, rel=2e-3)


def test_static_friction_below_the_sliding_one_is_refused() -> None:
    with pytest.raises(
        ModelError, match=r"stribeck_friction at 'spring': static = 3 N must be at least coulomb = 5 N"
    ):
        attached("stribeck_friction", "spring", {**VALUES, "static": 3.0})

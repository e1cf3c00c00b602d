"""At which places a cause may be, and which fits are no fits of their word."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis import plausible
from chladni.gap.diagnosis.plausible import (
    is_far,
    is_lost,
    is_one_force,
    least_left,
    near_places,
    plausible_places,
    sound,
)
from chladni.gap.diagnosis.study import study_of
from chladni.models.effects.attached_effect import attached
from tests.gap.arm import arm, measured
from tests.gap.fitted import contestant, location

GAIN = attached("gain_error", "a0", {"gain": 2.0})
DRAG = attached("quadratic_damping", "j1", {"coefficient": 2.0})


def place(chi: float, forces: int = 1):
    return SimpleNamespace(profile=SimpleNamespace(chi=chi, forces=(None,) * forces))


def leaving(*chi: float, sensors: int = 3, tuned: float = 5.0):
    """Places whose force leaves so many times the noise, of what a tuned model leaves."""
    found = location([place(one) for one in chi], sensors=sensors)
    found.best, found.tuned = found.ranked[0], SimpleNamespace(chi=tuned)
    return found


def left_by(places):
    return [one.profile.chi for one in places]


@pytest.mark.nightly
def test_a_place_that_explains_less_than_another_one_is_left_out() -> None:
    study = study_of(arm(), measured(seconds=2.0), leave_out=frozenset(), own={})
    location = study.location
    first = replace(
        location.ranked[0], profile=replace(location.ranked[0].profile, misfit=location.ranked[0].profile.expected)
    )
    second = replace(first, profile=replace(first.profile, misfit=1.5 * first.profile.expected))
    assert plausible_places(replace(location, ranked=(first, second))) == [first]
    # Beside a large gap that little more tells nothing: the ground and the joint on it print nearly one pattern.
    large = replace(location.tuned, misfit=500.0 * location.tuned.expected)
    assert plausible_places(replace(location, tuned=large, ranked=(first, second))) == [first, second]
    # Where even the best place leaves something, the force between samples is taken for straight: all may be.
    first = replace(first, profile=replace(first.profile, misfit=1.4 * first.profile.expected))
    assert len(plausible_places(replace(location, ranked=(first, second)))) == 2


def test_one_force_that_leaves_noise_alone_is_one_where_sensors_are_enough_to_say_so() -> None:
    assert is_one_force(leaving(1.1, 3.0))
    assert not is_one_force(leaving(1.2, 3.0))
    assert not is_one_force(leaving(1.1, 3.0, sensors=2))


def test_places_are_near_where_they_leave_as_much_or_little_more_of_the_gap() -> None:
    assert left_by(near_places(leaving(2.0, 2.4, 2.6, 4.0, tuned=5.0), 1.25)) == [2.0, 2.4]
    # 2 + 0.003 of the 498 that the force explains.
    assert left_by(near_places(leaving(2.0, 2.4, 3.4, 4.0, tuned=500.0), 1.25)) == [2.0, 2.4, 3.4]
    # Less than noise is no better than noise.
    assert left_by(near_places(leaving(0.5, 1.2, 1.3), 1.25)) == [0.5, 1.2]


def test_runs_are_lost_where_they_leave_three_times_what_a_force_does() -> None:
    assert [is_lost(leaving(2.0), left) for left in (5.0, 7.0)] == [False, True]
    # A sensor's or an input's own error recovers no states to run from; far away it is all the same.
    sensor = location([place(2.0, forces=0)])
    sensor.best = sensor.ranked[0]
    assert not is_lost(sensor, 1e6)
    assert [is_far(sensor, left) for left in (5.0, 7.0)] == [False, True]


def test_least_left_is_that_of_the_best() -> None:
    assert least_left([contestant(GAIN, chi=3.0), contestant(DRAG, chi=2.0)]) == 2.0
    assert least_left([]) == float("inf")


def test_fits_that_are_another_effect_and_those_at_sensors_of_steps_are_left_out(monkeypatch) -> None:
    monkeypatch.setattr(plausible, "is_degenerate", lambda _, one: one.chi > 5.0)
    # The other sensor recorded more than the end of its range lets through.
    log = SimpleNamespace(output_names=("a0", "a1"), outputs=np.array([np.zeros(100), np.linspace(-9.0, 9.0, 100)]))
    study = SimpleNamespace(contest=SimpleNamespace(run=None), coarse=frozenset({"a0"}), measurement=log)
    kept, turned, stepping = contestant(DRAG), contestant(DRAG, chi=9.0), contestant(DRAG, GAIN)
    clips, wider = (contestant(attached("clipping", "a1", {"limit": limit})) for limit in (4.0, 8.5))
    assert sound(study, [kept, turned, stepping, clips, wider]) == [kept, wider]

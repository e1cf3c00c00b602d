"""At which places a cause may be, and which fits are no fits of their word."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis import plausible
from chladni.gap.diagnosis.plausible import (
    is_degenerate,
    is_lost,
    is_one_force,
    least_left,
    near_places,
    plausible_places,
    sound,
)
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.explanation.trial import excited_band_hz
from chladni.gap.plant.free_run import FreeRun
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.extra_mode import STIFF_MOUNT
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
    # A sensor's or an input's own error recovers no states to run from.
    sensor = location([place(2.0, forces=0)])
    sensor.best = sensor.ranked[0]
    assert not is_lost(sensor, 1e6)


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


@pytest.fixture(scope="module")
def run() -> FreeRun:
    return FreeRun(arm(), measured(()))


def hanging(frequency_hz: float, damping_ratio: float = 0.02) -> Contestant:
    """A fit that ended at a mass that hangs at a body with this frequency."""
    values = {"mass": 0.5, "frequency": frequency_hz, "damping_ratio": damping_ratio}
    return contestant(attached("extra_mode", "arm", values))


def changing(at: float, rise: float) -> Contestant:
    """A fit that ended at a spring that changes about a time, slowly or not."""
    values = {"relative_change": 0.2, "time": at, "rise": rise}
    return contestant(attached("varying_stiffness", "elbow", values, variant="step"))


def test_an_oscillator_that_never_swings_in_a_log_is_a_spring_to_where_it_stands(run: FreeRun) -> None:
    lowest_hz = max(1.0 / run.measurement.duration_s, excited_band_hz(run.measurement)[0] / STIFF_MOUNT)
    assert is_degenerate(run, hanging(0.9 * lowest_hz))
    assert not is_degenerate(run, hanging(1.1 * lowest_hz))


def test_an_oscillator_far_below_all_that_moved_is_a_spring_to_where_it_stands(run: FreeRun) -> None:
    lowest_hz = excited_band_hz(run.measurement)[0]
    # Long enough for it to swing: so it's the band alone that says it stands still.
    assert 0.9 * lowest_hz / STIFF_MOUNT > 1.0 / run.measurement.duration_s
    assert is_degenerate(run, hanging(0.9 * lowest_hz / STIFF_MOUNT))


def test_what_is_damped_far_too_much_to_swing_is_a_mass_that_a_dashpot_carries(run: FreeRun) -> None:
    middle_hz = 0.5 * excited_band_hz(run.measurement)[1]
    # Critical is 1; a fit isn't exact.
    assert not is_degenerate(run, hanging(middle_hz, damping_ratio=1.2))
    assert is_degenerate(run, hanging(middle_hz, damping_ratio=3.0))


def test_an_oscillator_far_above_all_that_moved_is_a_mass(run: FreeRun) -> None:
    highest_hz = excited_band_hz(run.measurement)[1]
    assert not is_degenerate(run, hanging(0.9 * STIFF_MOUNT * highest_hz))
    assert is_degenerate(run, hanging(1.1 * STIFF_MOUNT * highest_hz))


def test_a_change_that_is_over_at_once_or_never_comes_is_a_stiffness(run: FreeRun) -> None:
    length = run.measurement.duration_s
    assert not is_degenerate(run, changing(0.04 * length, 0.01 * length))
    assert is_degenerate(run, changing(0.01 * length, 0.005 * length))
    assert is_degenerate(run, changing(0.99 * length, 0.005 * length))
    assert is_degenerate(run, changing(1.5 * length, 0.1 * length))


def test_a_slow_change_is_seen_though_half_of_it_comes_after_the_log(run: FreeRun) -> None:
    length = run.measurement.duration_s
    assert not is_degenerate(run, changing(1.02 * length, 2.0 * length))

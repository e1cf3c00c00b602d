"""A floor that is too high is asked for again behind the best cause, and only where that hides something."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.finer_floor import finer_floor, share_of_own_signal, without_own_signal
from chladni.gap.diagnosis.study import over_floor, study_of
from chladni.gap.explanation.contest import Contest
from chladni.gap.explanation.hypotheses import hypothesis_of
from tests.gap.arm import arm, measured

RUB = chladni.attached("coulomb_friction", "elbow", {"force": 8.0})
NOISE = 0.01


@pytest.fixture(scope="module")
def rubbing():
    """The study of an arm that rubs, over a floor of its wrist's sensor that is ten times too high."""
    study = study_of(arm(), measured((RUB,), seconds=3.0, noise=NOISE, off={}), leave_out=frozenset(), own={})
    contest, high = study.contest, np.array([0.0, 0.0, 10.0])
    return replace(
        study,
        contest=Contest(
            contest.run,
            contest.problem.with_noise(contest.noise.raised(high * contest.noise.rms)),
            contest.training,
        ),
    )


def answer(study, left):
    """What a cause explains but for some signal that it leaves."""
    found = study.contest.enter(hypothesis_of((RUB,), study.location.tuned.z))
    missed = replace(found.fit, outputs=found.fit.outputs - left)
    return replace(found, fit=missed)


@pytest.mark.nightly
@pytest.mark.slow
def test_the_noise_behind_a_cause_is_told_where_it_hid_something(rubbing) -> None:
    outputs = rubbing.measurement.outputs
    noise = NOISE * np.std(outputs, axis=1)
    # What a force that nobody modelled does reaches all sensors, here with three times the noise of each.
    square = outputs[2] ** 2 - np.mean(outputs[2] ** 2)
    left = 3.0 * noise[:, None] * square / np.std(square)
    finer = finer_floor(rubbing, answer(rubbing, left))
    assert finer is not None
    assert finer.rms[2] < 0.5 * rubbing.contest.noise.rms[2]
    assert np.all(finer.rms <= rubbing.contest.noise.rms)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_clipped_sensor_s_distortion_is_not_in_the_floor_that_is_told(rubbing) -> None:
    found = rubbing.contest.enter(hypothesis_of((RUB,), rubbing.location.tuned.z))
    wrist, noise = found.fit.outputs[2], NOISE * np.std(rubbing.measurement.outputs[2])
    cut = np.clip(wrist, *np.quantile(wrist, [0.1, 0.9])) - wrist
    clipped = replace(
        rubbing,
        measurement=replace(rubbing.measurement, outputs=rubbing.measurement.outputs + [[0.0], [0.0], [1.0]] * cut),
    )
    finer = finer_floor(clipped, found)
    assert finer is not None
    assert finer.rms[2] == pytest.approx(noise, rel=0.15)


@pytest.mark.nightly
@pytest.mark.slow
def test_nothing_new_is_told_where_nothing_was_named_or_only_noise_is_left(rubbing) -> None:
    nothing = answer(rubbing, np.zeros_like(rubbing.measurement.outputs))
    assert finer_floor(rubbing, nothing) is None
    plain = rubbing.contest.enter(hypothesis_of((), rubbing.location.tuned.z), tune=False)
    assert finer_floor(rubbing, plain) is None


@pytest.mark.nightly
@pytest.mark.slow
def test_another_round_is_held_over_the_floor_that_was_told(rubbing) -> None:
    finer = over_floor(rubbing, rubbing.contest.noise.lowered(np.array([1.0, 1.0, 0.01])))
    assert finer.contest.noise.rms[2] < 0.2 * rubbing.contest.noise.rms[2]
    assert (finer.kinds, finer.windows, finer.measurement.log) == (rubbing.kinds, None, rubbing.measurement.log)


def test_curves_and_steps_are_seen_and_a_gain_and_noise_are_not() -> None:
    rng = np.random.default_rng(7)
    signal, noise = rng.standard_normal((4, 20_000)), 0.1 * rng.standard_normal((4, 20_000))
    residual = noise.copy()
    # As much power as the noise: half of what is left.
    residual[0] += 0.1 / np.sqrt(2) * (signal[0] ** 2 - 1.0)
    residual[1] = 0.5 * np.floor(signal[1] / 0.5) - signal[1] + 0.01 * noise[1]
    residual[2] += 0.3 * signal[2]
    found = share_of_own_signal(5.0 + signal, residual)
    assert found[0] == pytest.approx(0.5, abs=0.03)
    assert found[1] > 0.7
    assert np.all(found[2:] < 0.01)


def test_noise_of_a_short_log_follows_nothing() -> None:
    signal, noise = np.random.default_rng(9).standard_normal((2, 400, 150))
    found = share_of_own_signal(signal, noise)
    # A curve of sixty points takes two fifths of it by chance: the mean is within three standard errors of none.
    assert abs(found.mean()) < 3 * found.std() / np.sqrt(400)


def test_a_sensor_that_shows_nothing_follows_nothing() -> None:
    assert share_of_own_signal(np.zeros((1, 50)), np.zeros((1, 50)))[0] == 0.0


def test_what_a_clipped_sensor_leaves_is_taken_away_and_noise_is_not() -> None:
    rng = np.random.default_rng(8)
    signal, noise = rng.standard_normal((2, 20_000)), 0.05 * rng.standard_normal((2, 20_000))
    left = noise.copy()
    left[0] += np.clip(signal[0], -1.2, 1.2) - signal[0]
    found = without_own_signal(signal, left)
    assert np.std(found[0]) == pytest.approx(0.05, rel=0.03)
    np.testing.assert_array_equal(found[1], noise[1])

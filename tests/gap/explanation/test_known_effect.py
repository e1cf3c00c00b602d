"""A second effect acts along the whole motion, not along what the linear model says of it."""

import numpy as np
import pytest

from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.contest import Contest, training_mask
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.known_effect import KnownEffect, KnownStates
from chladni.gap.location.locate import locate
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import training_in_windows
from chladni.models.effects.attached_effect import attached
from chladni.models.integrator.integrator import Integrator
from tests.gap.made_log import RATE_HZ, WORDS, band_noise, measured, problem_of, three_bodies

SAMPLES = 6000
STOP = attached("hardening_stiffness", "j1", {"cubic": 4e12})
MOUNT = attached("mounting_resonance", "a0", {"frequency": 140.0, "damping_ratio": 0.01})


@pytest.fixture(scope="module")
def made():
    signals = band_noise(SAMPLES, rms=150.0)
    log, floor = measured(three_bodies().with_effects((STOP, MOUNT)), signals)
    run = FreeRun(three_bodies(), log)
    contest = Contest(run, problem_of(run, floor), training_mask(log.samples, log.sample_rate_hz))
    first = contest.enter(hypothesis_of((STOP,), np.zeros(len(run.tunables.names))), tune=False)
    return log, floor, contest, first


def test_what_is_left_and_what_was_taken_make_the_log(made) -> None:
    log, _, contest, first = made
    known = KnownEffect.of(contest.run, first.fit, first.fit.effects)
    # A cubic spring did something, or the rest of these tests say nothing.
    assert np.std(known.outputs[0]) > 0.1 * np.std(log.outputs[0])
    np.testing.assert_allclose(known.behind(known.without(log)).outputs, log.outputs, atol=1e-9)


def test_ports_move_as_with_the_effect(made) -> None:
    _, _, contest, first = made
    known, fit = KnownEffect.of(contest.run, first.fit, first.fit.effects), first.fit
    start = fit.initial[:, : len(contest.run.compiled().states)]
    plain = contest.run.motion(fit.z, (), start, site="j1").displacement
    bent = contest.run.motion(fit.z, fit.effects, fit.initial, site="j1").displacement
    np.testing.assert_allclose(plain + known.displacement["j1", "joint"], bent, atol=1e-12)


def test_over_windows_it_is_what_the_linear_model_answers_to_the_law_s_force(made) -> None:
    log, floor, contest, first = made
    windows = tuple((start, start + 500) for start in range(0, SAMPLES, 500))
    run = FreeRun(three_bodies(), log, windows=windows)
    states = Integrator(run.compiled(None, (STOP,)), RATE_HZ, tolerance=1e-9).run(log.inputs).states
    there = Contest(run, problem_of(run, floor), training_in_windows(windows))
    start = np.ascontiguousarray(states[:, ::500].T)
    fit = there.enter(hypothesis_of((STOP,), first.fit.z), tune=False, initial=start).fit
    whole, parts = (KnownEffect.of(one, at, (STOP,)) for one, at in ((contest.run, first.fit), (run, fit)))
    # Transients of the record's ends apart, which a linear model answers to anything with.
    middle = slice(1000, 5000)
    apart = np.std((whole.outputs - parts.outputs)[:, middle], axis=1) / np.std(whole.outputs, axis=1)
    assert np.all(apart < 0.1)
    key = ("j1", "joint")
    way = whole.displacement[key]
    assert np.std((way - parts.displacement[key])[middle]) < 0.1 * np.std(way)


@pytest.mark.nightly
def test_a_sensor_s_mount_is_found_behind_a_spring(made) -> None:
    log, floor, contest, first = made
    known = KnownEffect.of(contest.run, first.fit, first.fit.effects)
    location = locate(three_bodies(), known.without(log), floor, contest.run.tunables, first.fit.z)
    (place,) = [one for one in location.ranked if "a0" in one.places[0].names]
    found = [one for one in screened(location, [place], WORDS, known) if one.trial.site.name == "a0"]
    assert found[0].trial.effect == "mounting_resonance"
    assert found[0].values["frequency"] == pytest.approx(140.0, rel=0.02)
    # Along the linear model's share of the motion the same law explains far less.
    blind = [one for one in screened(location, [place], WORDS) if one.trial.effect == "mounting_resonance"]
    assert found[0].misfit < 0.5 * blind[0].misfit


def test_windows_begin_at_known_states_and_others_at_rest() -> None:
    known = KnownStates(names=("x", "v"), values=np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]))
    found = known.at_starts(((0, 2), (2, 4)), ("v", "filter", "x"))
    np.testing.assert_array_equal(found, [[4.0, 0.0, 0.0], [6.0, 0.0, 2.0]])

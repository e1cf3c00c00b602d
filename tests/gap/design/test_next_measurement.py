import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from chladni.gap.design.experiment import Design
from chladni.gap.design.experiments import Reach
from chladni.gap.design.next_measurement import next_measurement, sentence
from chladni.gap.design.rival import Part, Prediction, imitated, sums_of
from chladni.gap.design.search import Search
from chladni.gap.explanation.contest import Contest, training_mask
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import windows_for
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.controller import Controller
from tests.gap.design.close_candidates import acting, axis, contested, fitted, wrong
from tests.gap.made_log import band_noise, measured, problem_of, white_floor

HARDENING = attached("hardening_stiffness", "j1", {"cubic": 1.2e9})
COULOMB = attached("coulomb_friction", "j1", {"force": 0.3})


@pytest.fixture(scope="module")
def hardening_or_stiffer():
    # Known so well that what imitates the cubic is a wrong value.
    known = {"j1.stiffness": 1e-5}
    hypotheses = acting("hardening_stiffness", "j1", cubic=1e9), wrong("j1.stiffness")
    return contested(HARDENING, *hypotheses, tolerances=known)


@pytest.fixture(scope="module")
def hammer_or_sensor():
    gain = attached("gain_error", "hammer", {"gain": 1.3})
    hypotheses = [acting("gain_error", site, gain=1.1) for site in ("hammer", "a2")]
    return contested(gain, *hypotheses, outputs=[2])


@pytest.mark.nightly
def test_hardening_against_a_stiffer_spring_asks_for_a_higher_level(hardening_or_stiffer):
    first = Search(*hardening_or_stiffer, seed=1).best()[0]
    assert first.change == "level"
    assert "hammer at 2 times the level" in first.words
    # A cubic grows with the square of the level, so that twice is plenty.
    assert first.nats > 10 * first.now_nats


@pytest.mark.nightly
def test_measuring_as_advised_tells_hardening_from_a_stiffer_spring(hardening_or_stiffer):
    model, log, _, candidates, floor = hardening_or_stiffer
    apart = candidates[0].log_evidence - candidates[1].log_evidence
    clean = measured(model.with_effects((HARDENING,)), 2 * log.inputs, noise=0.0)[0]
    noise = np.random.default_rng(6).standard_normal(clean.outputs.shape) * floor.rms[:, None]
    louder = replace(clean, outputs=clean.outputs + noise)
    again = fitted(model, louder, floor, *(one.hypothesis for one in candidates))
    assert again[0].hypothesis.named == candidates[0].hypothesis.named
    assert again[0].log_evidence - again[1].log_evidence > apart + 20


@pytest.mark.nightly
def test_what_is_expected_of_the_log_is_what_the_contest_found():
    arguments = contested(COULOMB, acting("coulomb_friction", "j1", force=0.3), wrong("j1.damping"))
    candidates = arguments[3]
    found = candidates[0].log_evidence - candidates[1].log_evidence
    expected = Search(*arguments, seed=1).now_nats
    # One log's evidence scatters by sqrt(2 nats), and an expectation over which is true takes their mean.
    assert 0.3 * found < expected < found + np.sqrt(2 * found) + 3


@pytest.mark.nightly
def test_coulomb_against_viscous_friction_asks_for_another_level_or_less_noise():
    arguments = contested(COULOMB, acting("coulomb_friction", "j1", force=0.3), wrong("j1.damping"))
    search = Search(*arguments, seed=1)
    levels = [one.design for one in search._each(search._reach.levels()) if one.design.change == "level"]
    repeated = 2 * search.now_nats
    # Whatever the level, viscous damping can match the loss at one of them only.
    assert all(one.nats > repeated + 1 for one in levels)
    assert search.best()[0].change in ("level", "repeats")


@pytest.mark.nightly
def test_an_input_against_the_only_sensor_asks_for_a_sensor(hammer_or_sensor):
    search = Search(*hammer_or_sensor, seed=1)
    designs = search.best()
    assert [one.change for one in designs] == ["sensor"]
    assert "accelerometer" in designs[0].words
    # No drive tells them apart: both scale the same channel.
    assert search.now_nats == pytest.approx(0.0, abs=1e-6)
    assert all(one.design.nats < 1e-3 for one in search._each(search._reach.levels()))
    assert all(one.design.nats < 1e-3 for one in search._each(search._reach.courses()))


@pytest.mark.slow
def test_the_sentence_names_what_to_do_and_numbers(hardening_or_stiffer):
    said = next_measurement(*hardening_or_stiffer, seed=1)
    pattern = (
        r"Repeat with hammer at 2 times the level \(RMS [\d.]+ N\): hardening stiffness at j1 and another value of "
        r"j1\.stiffness then differ by ([\d.]+) sigma \(now ([\d.]+)\)"
    )
    then, now = (float(one) for one in re.match(pattern, said).groups())
    assert then > 3 * now
    log = hardening_or_stiffer[1]
    level = float(re.search(r"RMS ([\d.]+) N", said).group(1))
    assert level == pytest.approx(2 * np.sqrt(np.mean(log.inputs**2)), rel=0.01)


@pytest.mark.nightly
def test_the_same_seed_says_the_same(hammer_or_sensor):
    assert next_measurement(*hammer_or_sensor, seed=3) == next_measurement(*hammer_or_sensor, seed=3)


def test_one_candidate_has_nothing_to_be_told_from(hammer_or_sensor):
    model, log, tunables, candidates, floor = hammer_or_sensor
    assert next_measurement(model, log, tunables, candidates[:1], floor, seed=1) is None


def test_variants_of_one_law_are_one_answer(hammer_or_sensor):
    model, log, tunables, candidates, floor = hammer_or_sensor
    assert next_measurement(model, log, tunables, [candidates[0], candidates[0]], floor, seed=1) is None


def test_candidates_that_nothing_tells_apart_are_said_to_be_one(hammer_or_sensor):
    candidates = sorted(hammer_or_sensor[3], key=lambda one: one.hypothesis.named[0].site, reverse=True)
    nothing = Design(change="level", words="Repeat", effort=1.0, nats=0.5, now_nats=0.2)
    assert sentence([nothing], candidates, {"level", "sensor"}) == (
        "Nothing that was tried (levels up to 4 times, a further sensor) tells a gain error at hammer and a "
        "gain error at a2 apart: the best, 'Repeat', would bring them to 1 sigma (now 0.63). Take them as one answer."
    )


@pytest.mark.nightly
def test_a_clock_that_is_late_before_a_law_is_compared_too():
    late = attached("time_offset", "a1", {"offset": 2e-3})
    both = hypothesis_of(
        (late, attached("coulomb_friction", "j1", {"force": 0.3})), acting("gain_error", "a1", gain=1.1).start_z
    )
    arguments = contested(late, both, acting("time_offset", "a1", offset=1e-3), signals=band_noise(1500))
    search = Search(*arguments, seed=1)
    best = search.best()
    assert {"level", "repeats", "sensor"} <= search.tried
    assert best[0].nats >= search.now_nats


@pytest.mark.slow
def test_an_experiment_in_which_a_candidate_diverges_is_never_asked_for(hardening_or_stiffer):
    search = Search(*hardening_or_stiffer, seed=1)
    logged = search._reach.as_logged()
    assert len(search._each([logged])) == 1
    assert not search._each([replace(logged, inputs=1e200 * logged.inputs)])


def test_a_stretch_from_the_middle_of_a_long_log_is_faded_in():
    # Nothing in the first 6000 samples: they don't stand for the log.
    signals = np.concatenate([np.zeros((1, 6000)), band_noise(7000) + 500.0], axis=1)
    arguments = contested(
        attached("gain_error", "a0", {"gain": 1.2}), wrong(""), wrong("j1.stiffness"), signals=signals
    )
    inputs = Search(*arguments, seed=1)._reach.measurement.inputs[0]
    assert inputs[0] == 0.0
    np.testing.assert_array_equal(inputs[600:], signals[0, 6600:12000])


def test_a_free_axis_is_compared_in_windows():
    model = axis()
    true = model.with_effects((attached("coulomb_friction", "guide", {"force": 3.0}),))
    force = 20 * np.sin(2 * np.pi * 0.7 * np.arange(3000) / 500.0)[None]
    log, floor = measured(true, force, noise=0.002, rate_hz=500.0)
    run = FreeRun(model, log, windows=windows_for(model, log))
    assert len(run.windows) > 1
    contest = Contest(run, problem_of(run, floor), training_mask(log.samples, log.sample_rate_hz))
    z = np.zeros(len(run.tunables.names))
    friction = hypothesis_of((attached("coulomb_friction", "guide", {"force": 2.0}),), z)
    candidates = [contest.enter(friction), contest.enter(Hypothesis(freed=("guide.damping",), start_z=z))]
    search = Search(model, log, run.tunables, candidates, floor, seed=1)
    # Coulomb friction of 3 N at 20 N of force, in noise of 0.2 %: the log tells them apart already.
    assert search.now_nats > 20
    assert {one.design.change for one in search._each(search._reach.levels())} == {"level", "repeats"}


def test_what_a_loop_should_follow_is_not_replaced_by_noise():
    loop = Controller(
        name="loop", feedback="position", drives="motor", law="p-p", gains={"kp": 20.0, "kv": 300.0}, gain=1.0
    )
    model = replace(axis(), controllers=(loop,))
    log, _ = measured(model, 0.01 * np.sin(np.arange(2000) / 50)[None], rate_hz=500.0)
    reach = Reach(model=model, measurement=log, begins_with_log=True, seed=0)
    assert not list(reach.courses())
    assert not list(reach.positions())
    assert "loop at 2 times the level" in next(reach.levels()).words


class Free:
    """What a refit needs of a candidate: bounds and what is believed."""

    def __init__(self, count, limit=100.0, sure=0.0):
        self.unknowns = count
        self.low, self.high = np.full(count, -limit), np.full(count, limit)
        self.believed, self.sure = np.zeros(count), np.full(count, sure)


def made(unknowns=3, states=2, outputs=2, samples=400, seed=0):
    rng = np.random.default_rng(seed)
    own, starts = rng.standard_normal((unknowns, outputs, samples)), rng.standard_normal((states, outputs, samples))
    own -= own.mean(axis=-1, keepdims=True)
    starts -= starts.mean(axis=-1, keepdims=True)
    return Prediction(np.zeros((outputs, samples)), own, starts), rng


def part(wanted, prediction, noise, windows=None, scale=1.3):
    windows = windows or [(0, wanted.shape[-1])]
    return Part(sums_of(wanted, prediction, noise, windows), np.full(len(wanted), scale), wanted.shape[-1])


def test_what_lies_along_the_slopes_is_imitated_to_nothing():
    prediction, rng = made()
    step, start, offset = rng.standard_normal(3), rng.standard_normal(2), np.array([[3.0], [-2.0]])
    wanted = np.tensordot(step, prediction.own, 1) + np.tensordot(start, prediction.starts, 1) + offset
    at, (left,) = imitated(Free(3), np.zeros(3), [part(wanted, prediction, white_floor([0.1, 0.2]))])
    # A ridge of 1e-9 keeps the equations of the initial states regular.
    np.testing.assert_allclose(at, step, rtol=1e-7)
    assert np.all(left < 1e-10)


def test_what_no_slope_has_stays_in_units_of_the_noise():
    prediction, rng = made(samples=4000)
    other = rng.standard_normal((2, 4000))
    columns = np.concatenate([prediction.own, prediction.starts]).reshape(5, -1)
    flat = other.ravel() - columns.T @ np.linalg.lstsq(columns.T, other.ravel(), rcond=None)[0]
    other = flat.reshape(2, 4000)
    _, (left,) = imitated(Free(3), np.zeros(3), [part(other, prediction, white_floor([0.5, 0.5]))])
    np.testing.assert_allclose(
        left, np.mean((other - other.mean(axis=1, keepdims=True)) ** 2, axis=1) / 0.25, rtol=0.01
    )


def test_the_step_makes_the_likelihood_largest():
    # Oracle: a general minimiser on the same likelihood, written out.
    prediction, rng = made()
    wanted = rng.standard_normal((2, 400)) * np.array([[3.0], [0.5]])
    wanted -= wanted.mean(axis=1, keepdims=True)
    at, (left,) = imitated(Free(3, sure=1.0), np.zeros(3), [part(wanted, prediction, white_floor([1.0, 1.0]))])

    def power(x):
        rest = wanted - np.tensordot(x[:3], prediction.own, 1) - np.tensordot(x[3:], prediction.starts, 1)
        return np.mean(rest**2, axis=1)

    def roots(x):
        return np.concatenate([np.sqrt(400 * np.log1p(power(x) / 1.3)), x[:3]])

    best = least_squares(roots, np.zeros(5), xtol=1e-12, ftol=1e-12, gtol=1e-12).x
    # Six rounds of reweighing.
    np.testing.assert_allclose(at, best[:3], atol=2e-4)
    np.testing.assert_allclose(left, power(best), rtol=1e-3)


def test_bounds_hold():
    prediction, _ = made()
    wanted = 5.0 * prediction.own[0]
    at, (left,) = imitated(Free(3, limit=1.0), np.zeros(3), [part(wanted, prediction, white_floor([1.0, 1.0]))])
    assert at[0] == pytest.approx(1.0)
    assert np.all(left > 10.0)


def test_windows_have_initial_states_of_their_own():
    prediction, _ = made(unknowns=1)
    half = np.arange(400) < 200
    wanted = np.where(half, prediction.starts[0], -2 * prediction.starts[0])
    floor = white_floor([1.0, 1.0])
    wanted[:, half] -= wanted[:, half].mean(axis=1, keepdims=True)
    _, (whole,) = imitated(Free(1), np.zeros(1), [part(wanted, prediction, floor)])
    _, (apart,) = imitated(Free(1), np.zeros(1), [part(wanted, prediction, floor, [(0, 200), (200, 400)])])
    assert np.all(apart < 0.05 * whole)


def test_two_records_pin_what_each_alone_leaves_free():
    # A stiffness that imitates a hardening spring at one level doesn't at twice the level.
    prediction, _ = made(unknowns=1, states=1)
    floor = white_floor([0.1, 0.1])
    once, twice = 1.0 * prediction.own[0], 4.0 * prediction.own[0]
    first, second = part(once, prediction, floor), part(twice, prediction, floor)
    for one in (first, second):
        assert np.all(imitated(Free(1), np.zeros(1), [one])[1][0] < 1e-10)
    _, left = imitated(Free(1), np.zeros(1), [first, second])
    assert max(one.max() for one in left) > 50.0


def test_states_that_print_nothing_harm_nothing():
    prediction, rng = made()
    blank = Prediction(prediction.outputs, prediction.own, np.zeros((2, 2, 400)))
    wanted = np.tensordot(rng.standard_normal(3), prediction.own, 1)
    _, (left,) = imitated(Free(3), np.zeros(3), [part(wanted, blank, white_floor([1.0, 1.0]))])
    assert np.all(left < 1e-10)

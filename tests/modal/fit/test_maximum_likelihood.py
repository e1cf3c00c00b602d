"""Refinement: exact on exact data, close modes kept apart, lost modes told, intervals that hold the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from chladni.modal.fit import normal_equations
from chladni.modal.fit.maximum_likelihood import refine
from chladni.modal.fit.modal_model import ModalModel
from chladni.spectral.forms import convert_form
from tests.modal.modal_coverage import (
    averaged_random,
    coverage,
    few_periods,
    independent_noise,
    started,
)
from tests.modal.truth import ModalTruth, chain, close_modes, mac, noisy_response

FREQUENCY_HZ = np.linspace(0.25, 8, 600)
RNG = np.random.default_rng


def measured(truth, at=(0,), *, noise=0.03, seed=0, frequency_hz=FREQUENCY_HZ):
    return noisy_response(truth, frequency_hz, at, noise=noise, rng=RNG(seed))


def exact(truth, at=(0,), *, std=0.0):
    response = measured(truth, at)
    return replace(response, values=truth.accelerance(FREQUENCY_HZ, at), std=np.full(response.std.shape, std))


@pytest.mark.parametrize("std", [0.0, np.inf])
@pytest.mark.parametrize("form", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("at", [(0,), (0, 3)])
def test_exact_data_give_exact_modes(std, form, at):
    truth = chain()
    response = convert_form(exact(truth, at, std=std), form)
    fitted = refine(response, started(truth, at, RNG(1), off=0.2))
    np.testing.assert_allclose(fitted.model.poles, truth.poles, rtol=1e-11)
    np.testing.assert_allclose(fitted.model.shapes, truth.unit_shapes, atol=1e-9)
    assert np.isnan(fitted.chi_square)
    assert any("carry no standard deviation" in note for note in fitted.notes)
    assert fitted.frequency_std_hz.max() < 1e-9


def test_shapes_are_normalised_and_sorted():
    truth = chain()
    start = started(truth, (0, 1), RNG(3)).select([3, 1, 0, 4, 2])
    fitted = refine(measured(truth, (0, 1)), start)
    assert np.all(np.diff(fitted.model.frequency_hz) > 0)
    np.testing.assert_array_equal(fitted.kept, [2, 1, 4, 0, 3])
    np.testing.assert_array_equal(np.abs(fitted.model.shapes).max(axis=1), 1)
    np.testing.assert_array_equal(fitted.shape_std[fitted.model.shapes == 1], 0)
    assert np.count_nonzero(fitted.shape_std == 0) == 5


def test_unknown_variance_is_found_from_what_is_left():
    truth = chain()
    response = measured(truth, noise=1e-9)
    rng = RNG(5)
    flat = 0.02 * np.array([1.0, 2.0, 0.5, 1.0, 3.0])[:, None, None]
    noise = rng.standard_normal(response.values.shape) + 1j * rng.standard_normal(response.values.shape)
    noisy = replace(response, values=response.values + flat * noise, std=np.zeros(response.std.shape))
    known = replace(noisy, std=np.broadcast_to(flat, response.std.shape))
    start = started(truth, (0,), RNG(1))
    without, beside = refine(noisy, start), refine(known, start)
    # The variance is estimated from 600 lines of each function, within 3 %, and the weights are no estimates a line.
    np.testing.assert_allclose(without.model.frequency_hz, beside.model.frequency_hz, rtol=1e-5)
    efficiency = (2 * 15) / (2 * 15 - 4)
    np.testing.assert_allclose(without.frequency_std_hz, beside.frequency_std_hz / np.sqrt(efficiency), rtol=0.2)
    assert beside.chi_square == pytest.approx((2 * 15 - 2) / (2 * 15), abs=0.1)


@pytest.mark.parametrize("share", [pytest.param(0.0, marks=pytest.mark.nightly), 1.0])
def test_intervals_without_stated_variance_hold_the_truth(share):
    """Noise on every line alike, or as a share of the function on its lines: 2 % of either."""
    truth, inside, total = chain(damping=0.002), 0, 0
    exact_values = truth.accelerance(FREQUENCY_HZ, (0,))
    level = np.median(np.abs(exact_values), axis=-1, keepdims=True)
    sigma = 0.02 * (share * np.abs(exact_values) + (1 - share) * level) / np.sqrt(2)
    for seed in range(20):
        rng = RNG([3, seed])
        noise = rng.standard_normal(exact_values.shape) + 1j * rng.standard_normal(exact_values.shape)
        response = replace(
            measured(truth), values=exact_values + sigma * noise, std=np.full(exact_values.shape, np.inf)
        )
        fitted = refine(response, started(truth, (0,), rng))
        off = [(fitted.model.frequency_hz - truth.frequency_hz) / fitted.frequency_std_hz]
        off += [(fitted.model.damping_ratio - truth.damping_ratio) / fitted.damping_std]
        inside, total = inside + np.count_nonzero(np.abs(off) < 1.96), total + np.size(off)
    # 95 % of 200 numbers scatter by 1.5 %; modes narrower than a line are known from few lines.
    assert inside / total > 0.88


def test_the_covariance_is_that_of_many_runs():
    truth = chain()
    runs = [
        refine(independent_noise(truth, RNG([7, run]), at=(0, 2), lines=200), started(truth, (0, 2), RNG(run)))
        for run in range(60)
    ]
    pairs = np.array([np.stack([run.model.frequency_hz, run.model.damping_ratio], axis=1) for run in runs])
    predicted = np.mean([run.covariance for run in runs], axis=0)
    scaled = (pairs - [[f, z] for f, z in zip(truth.frequency_hz, truth.damping_ratio, strict=True)]) / np.sqrt(
        np.einsum("rara->ra", predicted)
    )
    # Sixty runs of ten numbers that are all of sigma 1: their mean square is 1 within 6 %; three and a half of that.
    assert np.mean(scaled**2) == pytest.approx(1.0, abs=0.2)
    np.testing.assert_allclose(np.sqrt(np.einsum("rara->ra", predicted))[:, 0], runs[0].frequency_std_hz, rtol=0.3)


def test_close_modes_are_kept_apart():
    truth, at = close_modes(), (0, 1)
    good = 0
    for run in range(40):
        rng = RNG([11, run])
        response = measured(truth, at, seed=run, frequency_hz=np.linspace(8, 12, 400))
        model = refine(response, started(truth, at, rng, off=0.2)).model
        right = model.poles.size == 2 and np.all(np.abs(model.frequency_hz / truth.frequency_hz - 1) < 5e-4)
        good += bool(right and all(mac(model.shapes[k], truth.shapes[k]) > 0.99 for k in (0, 1)))
    assert good >= 38


def with_extra(model, pole):
    """The model and one more mode, which the data don't hold."""
    return ModalModel(
        poles=np.append(model.poles, pole),
        shapes=np.concatenate([model.shapes, model.shapes[:1]]),
        participation=np.concatenate([model.participation, model.participation[:1]]),
        lower=model.lower,
        upper=model.upper,
    )


def test_a_mode_started_twice_is_reported():
    truth = chain()
    start = with_extra(started(truth, (0,), RNG(2), off=0.0), truth.poles[1] * (1 + 1e-6))
    fitted = refine(measured(truth), start)
    assert fitted.model.poles.size == 5
    np.testing.assert_allclose(fitted.model.frequency_hz, truth.frequency_hz, rtol=3e-3)
    assert any("ran" in note or "left" in note for note in fitted.notes)


def test_a_mode_outside_the_band_is_reported():
    truth = chain()
    fitted = refine(measured(truth), started(truth, (0,), RNG(2)), band_hz=(0.5, 5.2))
    np.testing.assert_array_equal(fitted.kept, [0, 1, 2])
    assert sum("left the band from" in note for note in fitted.notes) == 2


def test_no_mode_is_an_answer():
    truth = chain()
    start = started(truth, (0,), RNG(2)).select([4])
    fitted = refine(measured(truth), start, band_hz=(0.5, 1.5))
    assert fitted.model.poles.size == 0
    assert fitted.shape_std.shape == (0, 5)
    assert "left the band" in fitted.notes[0]


def test_misfit_widens_the_intervals():
    truth = chain()
    response = measured(truth)
    overconfident = replace(response, std=response.std / 3)
    start = started(truth, (0,), RNG(4))
    honest, bold = refine(response, start), refine(overconfident, start)
    assert bold.chi_square == pytest.approx(9 * honest.chi_square, rel=1e-2)
    # Nine times the variance is found again but for what chance makes of it.
    np.testing.assert_allclose(bold.frequency_std_hz, honest.frequency_std_hz, rtol=0.2)
    timid = refine(replace(response, std=response.std * 3), start)
    np.testing.assert_allclose(timid.frequency_std_hz, 3 * honest.frequency_std_hz, rtol=0.2)


def test_blocks_of_lines_alter_error_bars_little(monkeypatch):
    truth = chain()
    response, start = measured(truth, (0, 1)), started(truth, (0, 1), RNG(4))
    whole = refine(response, start)
    monkeypatch.setattr(normal_equations, "LARGEST_WORK", 10 * 600 * 24 * 25 // (2 * 3))
    monkeypatch.setattr(normal_equations, "LARGEST_TABLE", 24**2 * 60)
    monkeypatch.setattr(normal_equations, "LARGEST_BATCH", 24**2 * 2)
    blocks = refine(response, start)
    # Both stop within a hundredth of a sigma of the optimum.
    off = np.abs(blocks.model.frequency_hz - whole.model.frequency_hz) / whole.frequency_std_hz
    assert off.max() < 0.05
    np.testing.assert_allclose(blocks.frequency_std_hz, whole.frequency_std_hz, rtol=0.1)


def binomial_limits(trials):
    """Shares that a true coverage of 92 to 98 % gives but once in a thousand on each side."""
    return binom.ppf(1e-3, trials, 0.92) / trials, binom.ppf(1 - 1e-3, trials, 0.98) / trials


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("make", "at", "runs", "options"),
    [
        pytest.param(independent_noise, (0,), 90, {"lines": 200}, marks=pytest.mark.nightly),
        (independent_noise, (0, 2), 90, {"lines": 200}),
        (few_periods, (0,), 90, {"lines": 200}),
        pytest.param(averaged_random, (0,), 40, {"cycles": 600, "resolution_hz": 1 / 40}, marks=pytest.mark.nightly),
        # Few long segments, as they are chosen for modes: leakage nearly cancels in frequencies.
        pytest.param(
            averaged_random, (0,), 25, {"cycles": 2000, "resolution_hz": 1 / 250}, marks=pytest.mark.nightly
        ),
        pytest.param(
            averaged_random,
            (0,),
            25,
            {"cycles": 2000, "resolution_hz": 1 / 250, "force_noise": 0.0},
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_intervals_hold_the_truth(make, at, runs, options):
    found = coverage(chain(), make, runs=runs, at=at, seed=3, **options)
    # Modes are independent, and so are frequency and damping of one; components of one shape are counted as two.
    for names, each in ((("frequency", "damping"), 2), (("shape",), 2), (("mass",), 1)):
        low, high = binomial_limits(each * 5 * runs)
        share = np.mean([found.share(name) for name in names])
        assert low <= share <= high, names


def test_the_limits_of_coverage_bite():
    assert binomial_limits(400)[1] < 1
    assert binomial_limits(400)[0] > 0.87


def many_modes(modes, masses):
    """Modes spread evenly, with shapes at random: hardly a line where some function has no antiresonance."""
    rng = RNG(12)
    return ModalTruth(
        frequency_hz=np.linspace(1, 20, modes) + rng.uniform(-0.15, 0.15, modes),
        damping_ratio=rng.uniform(0.003, 0.012, modes),
        shapes=rng.standard_normal((modes, masses)),
    )


def test_many_modes_settle_under_noise_like_the_response():
    # Weights vary a hundredfold from line to line; a curvature that blurs them is none.
    truth = many_modes(40, 8)
    response = measured(truth, frequency_hz=np.linspace(0.5, 20.5, 1400))
    fitted = refine(response, started(truth, (0,), RNG(3), responses=8))
    assert fitted.model.poles.size == 40
    assert not fitted.notes
    assert fitted.chi_square == pytest.approx((2 * 8 - 2) / (2 * 8), abs=0.1)
    off = np.abs(fitted.model.frequency_hz - truth.frequency_hz) / fitted.frequency_std_hz
    # The mean square of 40 numbers of sigma 1 is 1 within 22 %; three and a half of that.
    assert np.mean(off**2) < 1.8


def test_steps_that_run_out_are_told_and_widen_the_intervals():
    truth = chain()
    response, start = measured(truth), started(truth, (0,), RNG(6), off=0.5)
    settled, short = refine(response, start), refine(response, start, max_iterations=1)
    assert not settled.notes
    assert "didn't settle within 1 step," in short.notes[0]
    assert np.all(short.frequency_std_hz > settled.frequency_std_hz)
    off = np.abs(short.model.frequency_hz - settled.model.frequency_hz) / short.frequency_std_hz
    # Whatever is left to go fits in one of the sigmas that were widened for it.
    assert off.max() < 1
    assert np.all(refine(response, start, max_iterations=0).frequency_std_hz > short.frequency_std_hz)


@pytest.mark.nightly
def test_leakage_biases_nothing():
    # Five decay times a segment: a fit without the window finds 7 % too much damping.
    truth = chain()
    seen, unseen = [], []
    for run in range(10):
        rng = RNG([5, run])
        response = averaged_random(truth, rng, at=(0,), cycles=1500, resolution_hz=1 / 80)
        bare = replace(response, provenance=replace(response.provenance, averaging="periodic"))
        start = started(truth, (0,), rng)
        seen.append(refine(response, start, band_hz=(0.4, 7.5)).model.damping_ratio)
        unseen.append(refine(bare, start, band_hz=(0.4, 7.5)).model.damping_ratio)
    spread = np.std(seen, axis=0) / np.sqrt(len(seen))
    assert np.all(np.abs(np.mean(seen, axis=0) - 0.01) < 5 * spread)
    assert np.mean(unseen, axis=0)[0] > 0.01 + 5 * spread[0]

"""Poles of closed-form structures by the poly-reference least-squares complex frequency estimator."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.experimental.plscf import polyreference_poles
from chladni.signals.errors import EstimateError
from tests.modal.made_responses import chain, functions
from tests.modal.truth import close_modes, mac, noisy_response

FREQUENCY_HZ = np.arange(0, 60, 0.1)
# Rounding of the sums (1e-16 of their size) is squared into the normal equations: half of the digits remain, less
# some for poles that lie close to each other.
EXACT = 1e-6


def true_poles(structure):
    modes = structure.natural_modes()
    omega = 2 * np.pi * modes.frequency_hz
    return omega * (-modes.damping_ratio + 1j * np.sqrt(1 - modes.damping_ratio**2))


def poles_of(table, order):
    return table.pole[table.order == order]


def worst(found, truth):
    """Largest relative distance from a true pole to the nearest found."""
    return np.max(np.min(np.abs(found[None, :] - truth[:, None]), axis=1) / np.abs(truth))


@pytest.mark.parametrize("form", [0, 1, 2])
@pytest.mark.parametrize("references", [("m1",), ("m1", "m3")])
@pytest.mark.parametrize("frequency_hz", [FREQUENCY_HZ, FREQUENCY_HZ[1:-1], FREQUENCY_HZ[21:]])
def test_poles_of_a_chain_are_exact_without_noise_and_alone(form, references, frequency_hz):
    structure = chain()
    response = functions(structure, frequency_hz, references=references, order=form)
    table = polyreference_poles(response, max_order=40, order_step=10)
    truth = true_poles(structure)
    for order in (20, 30, 40):
        assert poles_of(table, order).size == truth.size
        assert worst(poles_of(table, order), truth) < EXACT


@pytest.mark.parametrize("weighting", ["std", "uniform", "relative"])
def test_poles_are_exact_whatever_the_weights(weighting):
    structure = chain()
    exact = functions(structure, FREQUENCY_HZ, references=("m1", "m4"))
    std = np.random.default_rng(0).uniform(0.5, 2.0, exact.values.shape) * (1 + exact.frequency_hz)
    table = polyreference_poles(replace(exact, std=std), max_order=30, order_step=10, weighting=weighting)
    # Weights of many decades lift lines whose rounding is that of the highest.
    assert worst(poles_of(table, 30), true_poles(structure)) < 10 * EXACT


def _every_third_missing(response):
    return replace(response, excited=response.excited & (np.arange(response.excited.size) % 3 != 1))


def _a_hole(response):
    return replace(response, excited=response.excited & ((response.frequency_hz < 8) | (response.frequency_hz > 15)))


def _lines_without_value(response):
    values = response.values.copy()
    values[1, 0, 50:90] = np.nan
    values[:, :, 200] = np.inf
    return replace(response, values=values)


@pytest.mark.parametrize("spoil", [_every_third_missing, _a_hole, _lines_without_value])
def test_missing_lines_cost_no_accuracy(spoil):
    structure = chain()
    response = spoil(functions(structure, FREQUENCY_HZ, references=("m1", "m3")))
    table = polyreference_poles(response, max_order=30, order_step=10)
    assert worst(poles_of(table, 30), true_poles(structure)) < EXACT


def test_lines_need_not_lie_on_a_grid():
    structure = chain()
    frequency_hz = np.sort(np.random.default_rng(3).uniform(2.0, 55.0, 500))
    table = polyreference_poles(functions(structure, frequency_hz), max_order=30, order_step=10)
    assert worst(poles_of(table, 30), true_poles(structure)) < EXACT


def test_a_mode_near_zero_hertz_is_found():
    structure = chain(damping_s=1e-3)
    # At 3 % of the band the negative frequencies of the pair are as near as most of the band's own lines.
    table = polyreference_poles(functions(structure, np.arange(0, 200, 0.1)), max_order=40, order_step=10)
    assert worst(poles_of(table, 40), true_poles(structure)[:1]) < EXACT


def test_poles_outside_the_band_are_not_given():
    table = polyreference_poles(functions(chain(), FREQUENCY_HZ), max_order=20, band_hz=(10.0, 30.0))
    damped_hz = table.pole.imag / (2 * np.pi)
    assert damped_hz.min() > 9.89
    assert damped_hz.max() < 30.11
    assert worst(poles_of(table, 20), true_poles(chain())[1:3]) < 1e-5


def test_noise_moves_poles_no_more_than_its_share():
    structure, truth, noise = chain(), true_poles(chain()), 0.01
    response = functions(structure, FREQUENCY_HZ, noise=noise)
    table = polyreference_poles(response, max_order=40, order_step=10)
    # On the lines of one half-power band, about 2 zeta f/0.1 Hz of them, H of a mode stands out of its noise by at
    # least the ratio of the RMS to 1 % of it; the best estimate then scatters by zeta sqrt(2) noise/sqrt(lines). A
    # linear estimate gets within 3 sigma of ten times that.
    damping = -truth.real / np.abs(truth)
    lines = np.maximum(1, 2 * damping * np.abs(truth) / (2 * np.pi) / 0.1)
    allowed = 30 * damping * np.sqrt(2) * noise / np.sqrt(lines)
    for order in (20, 30, 40):
        nearest = np.min(np.abs(poles_of(table, order)[None] - truth[:, None]), axis=1) / np.abs(truth)
        assert np.all(nearest < allowed)


def test_close_modes_are_both_found_with_two_references():
    modes = close_modes()
    random = np.random.default_rng(5)
    response = noisy_response(modes, np.arange(5, 15, 0.02), (0, 1), noise=0.03, rng=random)
    table = polyreference_poles(response, max_order=20)
    for order in (10, 15, 20):
        chosen = poles_of(table, order)[np.argsort(np.abs(np.abs(poles_of(table, order)) - 20 * np.pi))[:2]]
        frequency_hz = np.sort(np.abs(chosen)) / (2 * np.pi)
        # 3 % of noise moves each of two overlapping modes by a part of their distance of 0.02 Hz.
        np.testing.assert_allclose(frequency_hz, modes.frequency_hz, atol=0.008)


@pytest.mark.parametrize(("at", "times"), [((0,), 1), ((0, 1), 2)])
def test_a_double_pole_shows_as_often_as_the_references_tell_it_apart(at, times):
    modes = close_modes(apart=0.0)
    response = noisy_response(modes, np.arange(5, 15, 0.05), at, noise=0.0, rng=np.random.default_rng(0))
    found = poles_of(polyreference_poles(response, max_order=16, min_order=16), 16)
    # A double root of a polynomial splits by the root of the rounding error, 1e-4; that of a matrix less.
    assert np.sum(np.abs(found - modes.poles[0]) < 1e-4 * np.abs(modes.poles[0])) == times
    assert found.size == times


def test_participation_is_the_drive_of_each_mode():
    structure, references = chain(), ("m1", "m3", "m5")
    response = functions(structure, FREQUENCY_HZ, references=references)
    table = polyreference_poles(response, max_order=20, min_order=20)
    rows = [structure.body_index(name) for name in references]
    for pole, shape in zip(true_poles(structure), structure.natural_modes().shapes, strict=True):
        found = table.vector[np.argmin(np.abs(table.pole - pole))]
        assert mac(found, shape[rows]) > 1 - EXACT
        assert np.linalg.norm(found) == pytest.approx(1.0)
        largest = found[np.argmax(np.abs(found))]
        assert largest.real > 0
        assert abs(largest.imag) < 1e-12


def test_units_of_responses_and_references_change_no_pole():
    response = functions(chain(), FREQUENCY_HZ, references=("m1", "m3"), noise=0.01)
    gain = np.array([1e6, 1.0, 1e-9, 3.0, 1e3])[:, None, None] * np.array([1e4, 1e-5])[:, None]
    scaled = replace(response, values=response.values * gain, std=response.std * gain)
    for weighting in ("std", "uniform", "relative"):
        plain = polyreference_poles(response, max_order=20, order_step=5, weighting=weighting)
        other = polyreference_poles(scaled, max_order=20, order_step=5, weighting=weighting)
        np.testing.assert_allclose(other.pole, plain.pole, rtol=1e-6)
        drives = plain.vector * np.array([1e4, 1e-5])
        likeness = [mac(one, two) for one, two in zip(other.vector, drives, strict=True)]
        np.testing.assert_allclose(likeness, 1, atol=1e-6)


def test_the_order_of_channels_changes_no_pole():
    response = functions(chain(), FREQUENCY_HZ, references=("m1", "m3"), noise=0.01)
    rows, columns = [3, 0, 4, 1, 2], [1, 0]
    turned = replace(
        response,
        values=response.values[np.ix_(rows, columns)],
        std=response.std[np.ix_(rows, columns)],
        responses=tuple(response.responses[row] for row in rows),
        references=tuple(response.references[column] for column in columns),
    )
    plain, other = (polyreference_poles(each, max_order=20, order_step=5) for each in (response, turned))
    np.testing.assert_allclose(other.pole, plain.pole, rtol=1e-7)
    likeness = [mac(one, two) for one, two in zip(other.vector[:, columns], plain.vector, strict=True)]
    np.testing.assert_allclose(likeness, 1, atol=1e-7)


def test_responses_without_std_are_not_used_and_named():
    response = functions(chain(), FREQUENCY_HZ, noise=0.001)
    std, values = response.std.copy(), response.values.copy()
    std[2], values[2] = np.inf, 1e9
    table = polyreference_poles(replace(response, std=std, values=values), max_order=20, min_order=20)
    assert "/m3.x" in table.notes[0]
    assert worst(table.pole, true_poles(chain())) < 1e-3


def test_without_any_std_all_lines_count_alike():
    response = functions(chain(), FREQUENCY_HZ, noise=0.001)
    unknown = replace(response, std=np.full_like(response.std, np.inf))
    default, uniform = (
        polyreference_poles(unknown, max_order=20, order_step=5, **kind) for kind in ({}, {"weighting": "uniform"})
    )
    np.testing.assert_array_equal(default.pole, uniform.pole)


def test_a_dead_response_changes_nothing():
    response = functions(chain(), FREQUENCY_HZ, noise=0.001)
    values = response.values.copy()
    values[4] = np.nan
    dead = polyreference_poles(replace(response, values=values), max_order=20, min_order=20)
    without = replace(
        response,
        values=response.values[:4],
        std=response.std[:4],
        coherence=response.coherence[:4],
        responses=response.responses[:4],
    )
    np.testing.assert_allclose(dead.pole, polyreference_poles(without, max_order=20, min_order=20).pole, rtol=1e-7)
    assert "/m5.x" in dead.notes[0]


def test_many_responses_are_taken_in_chunks(monkeypatch):
    response = functions(chain(), FREQUENCY_HZ, noise=0.01)
    lively = replace(response, std=response.std * np.random.default_rng(0).uniform(0.5, 2, response.std.shape))
    whole = polyreference_poles(lively, max_order=20, order_step=5)
    monkeypatch.setattr("chladni.modal.experimental.reduced_normal_equations.CHUNK", 2000)
    np.testing.assert_allclose(polyreference_poles(lively, max_order=20, order_step=5).pole, whole.pole, rtol=1e-8)


@pytest.mark.nightly
def test_orders_are_counted_down_from_the_highest():
    response = functions(chain(), FREQUENCY_HZ, references=("m1", "m2", "m3"), noise=0.01)
    table = polyreference_poles(response, max_order=23, min_order=4, order_step=5)
    assert table.orders.tolist() == [8, 13, 18, 23]
    assert set(table.order) <= set(table.orders)
    assert np.all(np.diff(table.order) >= 0)
    assert polyreference_poles(response, max_order=90).orders.tolist() == list(range(2, 91, 2))


def test_orders_beyond_what_the_lines_determine_are_left_out_with_a_note():
    response = functions(chain(), np.arange(1, 61, 1.0), noise=1e-3)
    table = polyreference_poles(response, max_order=60)
    assert table.orders[-1] == 15
    assert "orders above 15 left out: 60 lines" in table.notes[0]


def test_one_function_of_few_lines_is_enough():
    response = functions(chain(), np.arange(4.0, 8.0, 0.05), responses=["m1"], order=0)
    table = polyreference_poles(response, max_order=20)
    assert worst(poles_of(table, table.orders[-1]), true_poles(chain())[:1]) < 1e-5


def test_impossible_requests_are_named():
    response = functions(chain(), FREQUENCY_HZ)
    with pytest.raises(EstimateError, match="orders from 5 to 3"):
        polyreference_poles(response, min_order=5, max_order=3)
    with pytest.raises(EstimateError, match="band 30 to 10 Hz"):
        polyreference_poles(response, band_hz=(30, 10))
    with pytest.raises(EstimateError, match="2 excited lines"):
        polyreference_poles(response, band_hz=(10, 10.15))
    with pytest.raises(EstimateError, match="zero or not finite"):
        polyreference_poles(replace(response, values=np.zeros_like(response.values)))
    with pytest.raises(EstimateError, match="21 lines carry polynomials up to order 5, min_order is 30"):
        polyreference_poles(response, band_hz=(10, 12), min_order=30)
    with pytest.raises(EstimateError, match="'magic' is none of std, uniform, relative"):
        polyreference_poles(response, weighting="magic")


def test_lines_that_do_not_determine_the_polynomials_are_an_error(monkeypatch):
    # The matrix of powers up to 60 on lines with a hole is singular to rounding, which a ridge below zero brings out.
    monkeypatch.setattr("chladni.modal.experimental.reduced_normal_equations.NUMERATOR_RIDGE", -1e-9)
    with pytest.raises(EstimateError, match="don't determine polynomials of order 60: lower max_order"):
        polyreference_poles(_a_hole(functions(chain(), FREQUENCY_HZ)))


@given(
    seed=st.integers(0, 2**32 - 1),
    lines=st.integers(10, 120),
    responses=st.integers(1, 3),
    references=st.integers(1, 3),
    weighting=st.sampled_from(["std", "uniform", "relative"]),
)
def test_whatever_the_data_poles_are_finite_stable_and_in_the_band(seed, lines, responses, references, weighting):
    random = np.random.default_rng(seed)
    names = [f"m{row + 1}" for row in range(3)]
    response = functions(
        chain((4e4, 5e4, 3e4)),
        np.arange(lines) * 0.5,
        references=names[:references],
        responses=names[:responses],
        noise=float(random.choice([0.0, 1e-3, 1.0, 1e6])),
        seed=seed,
    )
    step_hz, top_hz = 0.5, response.frequency_hz[-1]
    table = polyreference_poles(response, max_order=30, weighting=weighting)
    assert np.all(np.isfinite(table.pole))
    assert np.all(np.isfinite(table.vector))
    assert np.all(table.pole.real < 0)
    assert np.all(table.pole.imag >= np.pi * step_hz)
    assert np.all(table.pole.imag <= 2 * np.pi * (top_hz + step_hz))


def test_poles_agree_with_sdypy_ema():
    from sdypy.EMA import Model

    structure = chain()
    response = functions(structure, np.arange(0, 64, 0.0625), noise=0.001)
    with warnings.catch_warnings():
        # It warns that 64 Hz lies above its last line.
        warnings.simplefilter("ignore")
        model = Model(response.values[:, 0], response.frequency_hz, lower=0.5, upper=64.0, pol_order_high=20)
        model.get_poles(show_progress=False)
    peer = model.all_poles[-1]
    ours = polyreference_poles(response, max_order=20, min_order=20).pole
    for pole in true_poles(structure):
        mine, theirs = ours[np.argmin(np.abs(ours - pole))], peer[np.argmin(np.abs(peer - pole))]
        # Both are linear estimates of the same noisy data, with other coefficients and weights.
        assert abs(abs(mine) / abs(theirs) - 1) < 2e-4
        assert abs(mine.real / theirs.real - 1) < 0.05

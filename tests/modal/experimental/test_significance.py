from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from chladni.modal.experimental.judged_lines import STEADY_LINES, TOLERATED, judged_lines
from chladni.modal.experimental.significance import SignificanceRules, log_f_tail, mode_significance
from chladni.signals.errors import SetupError
from tests.modal import truth

CHAIN = truth.chain()
LINES_HZ = np.arange(0.02, 8.0, 0.02)


def noisy(seed, *, noise=0.03, at=(0,), model=CHAIN):
    return truth.noisy_response(model, LINES_HZ, at, noise=noise, rng=np.random.default_rng(seed))


def white(seed, *, at=(0,), responses=3):
    """Functions that are nothing but noise of known variance."""
    rng = np.random.default_rng(seed)
    response = noisy(seed, at=at)
    shape = (responses, len(at), LINES_HZ.size)
    values = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return replace(
        response,
        values=values,
        std=np.ones(shape),
        coherence=response.coherence[:responses],
        responses=response.responses[:responses],
    )


def pole(frequency_hz, damping=0.01):
    omega = 2 * np.pi * np.asarray(frequency_hz, dtype=float)
    return -damping * omega + 1j * omega * np.sqrt(1 - damping**2)


def significance(response, poles, participation=None):
    if participation is None:
        participation = np.ones((len(poles), len(response.references)), complex)
    return mode_significance(judged_lines(response, "accelerance", band_hz=None), np.asarray(poles), participation)


def test_modes_of_a_structure_are_needed():
    found = significance(noisy(1), CHAIN.poles)
    assert found.passes(SignificanceRules()).all()
    # Alone at its frequency each mode is nearly all there is, in the response where it is the clearest.
    assert np.all((found.contribution > 0.8) & (found.contribution < 1.2))
    np.testing.assert_allclose(found.width, 2 * 0.01 * CHAIN.frequency_hz / 0.02, rtol=1e-3)


@pytest.mark.parametrize("step_hz", [0.02, 0.002])
def test_modes_hundreds_of_lines_wide_are_needed_however_fine_the_lines(step_hz):
    # Ten per cent are up to 670 lines here, of which the middle alone would be a parabola.
    model = truth.chain(damping=0.1)
    response = truth.noisy_response(
        model, np.arange(step_hz, 12.0, step_hz), (0,), noise=0.03, rng=np.random.default_rng(1)
    )
    assert significance(response, model.poles).passes(SignificanceRules()).all()


def test_a_pole_where_there_is_none_is_not_needed():
    found = significance(noisy(1), np.append(CHAIN.poles, pole(3.7)))
    assert found.passes(SignificanceRules()).tolist() == [True] * 5 + [False]
    assert found.gain[5] < 2


def test_the_second_of_two_poles_for_one_peak_is_not_needed():
    twice = np.append(CHAIN.poles, CHAIN.poles[2] * 1.001)
    found = significance(noisy(1), twice)
    assert found.log_false_alarm[[2, 5]].max() > np.log(1e-4)
    assert found.passes(SignificanceRules())[[0, 1, 3, 4]].all()


def test_gain_in_noise_is_one_on_average():
    gains = [
        significance(white(seed), [pole(frequency_hz, 0.02)]).gain[0] for seed in range(30) for frequency_hz in (2, 5)
    ]
    # A noise-only line has TOLERATED of itself for model error, which takes one percent off. The pole and the
    # participation aren't fitted here, only six of the eight parameters: 6/8, and the mean of 60 gains scatters by
    # sqrt(2/6/60) of it.
    expected = 6 / 8
    assert np.mean(gains) == pytest.approx(expected, abs=4 * expected * np.sqrt(2 / 6 / 60) + 0.02)


def test_a_pole_fitted_to_the_largest_line_of_noise_is_not_needed():
    for seed in range(10):
        response = white(seed)
        largest = LINES_HZ[5:-5][np.argmax(np.sum(np.abs(response.values[:, 0, 5:-5]) ** 2, axis=0))]
        found = significance(response, [pole(largest, 0.01 / largest)])
        assert not found.passes(SignificanceRules())[0]


def test_look_elsewhere_counts_the_places():
    response = noisy(1, noise=0.8)
    wide = significance(response, CHAIN.poles[1:2])
    inside = (LINES_HZ > 1.5) & (LINES_HZ < 4.5)
    narrow = replace(response, excited=inside)
    shorter = significance(narrow, CHAIN.poles[1:2])
    # The same lines around the mode, in a band of 150 lines in place of 399.
    assert wide.log_false_alarm[0] - shorter.log_false_alarm[0] == pytest.approx(np.log(399 / 150), abs=0.02)


def test_modes_that_lines_tied_by_a_window_show_need_more():
    response = noisy(1, noise=0.8)
    alone = judged_lines(response, "accelerance", band_hz=None)
    tied = judged_lines(response, "accelerance", band_hz=None, correlated_lines=2.0)
    ones = np.ones((1, 1), complex)
    strong = mode_significance(alone, CHAIN.poles[1:2], ones).log_false_alarm[0]
    weak = mode_significance(tied, CHAIN.poles[1:2], ones).log_false_alarm[0]
    assert strong < weak < 0


def test_rules():
    found = significance(noisy(1), CHAIN.poles)
    assert not found.passes(SignificanceRules(false_alarm=1e-300)).all()
    assert not found.passes(SignificanceRules(contribution=2.0)).any()
    chosen = np.array([True, False, True, False, False])
    np.testing.assert_array_equal(found.select(chosen).gain, found.gain[chosen])


def test_some_of_the_modes():
    whole, some = significance(noisy(1), CHAIN.poles), np.array([1, 3])
    lines = judged_lines(noisy(1), "accelerance", band_hz=None)
    part = mode_significance(lines, CHAIN.poles, np.ones((5, 1), complex), modes=some)
    np.testing.assert_array_equal(part.gain, whole.gain[some])


def test_too_few_lines_say_nothing():
    response = noisy(1)
    few = replace(response, excited=np.abs(LINES_HZ - 1.0) < 0.09)
    crowd = pole(np.linspace(0.95, 1.05, 9), 0.1)
    found = significance(few, crowd)
    assert not found.passes(SignificanceRules()).any()


@pytest.mark.parametrize("wrong", [0.0, 1.0])
def test_impossible_rule(wrong):
    with pytest.raises(SetupError, match="false-alarm probability"):
        SignificanceRules(false_alarm=wrong)


@pytest.mark.parametrize(("ratio", "upper", "lower"), [(1.0, 8, 40), (5.0, 4, 200), (30.0, 12, 60)])
def test_f_tail_against_scipy(ratio, upper, lower):
    assert log_f_tail(ratio, upper, lower) == pytest.approx(stats.f.logsf(ratio, upper, lower), rel=1e-9)


def test_f_tail_far_out():
    # Where the probability itself underflows its logarithm goes on: for upper = 2 it is known in closed form.
    for ratio in (1e3, 1e6):
        exact = -1500 * np.log1p(ratio / 1500)
        assert log_f_tail(ratio, 2, 3000) == pytest.approx(exact, rel=1e-3)


def test_weights_are_noise_and_model_error():
    response = noisy(1)
    lines = judged_lines(response, "accelerance", band_hz=(1.0, 6.0))
    inside = (LINES_HZ >= 1.0) & (LINES_HZ <= 6.0)
    np.testing.assert_array_equal(lines.frequency_hz, LINES_HZ[inside])
    s = 2j * np.pi * lines.frequency_hz
    np.testing.assert_allclose(lines.values, response.values[..., inside] / s**2, rtol=1e-12)
    relative = 1 / (lines.weight * np.abs(lines.values))
    # Three percent of the exact magnitude over sqrt 2, and a tenth of the measured one.
    middle = np.median(relative)
    assert middle == pytest.approx(np.hypot(0.03, TOLERATED) / np.sqrt(2), rel=0.02)


def test_a_sigma_that_is_small_by_chance_is_not_believed():
    response = noisy(1)
    std = response.std.copy()
    std[:, :, 200] = 0.0
    lines = judged_lines(replace(response, std=std), "accelerance", band_hz=None)
    plain = judged_lines(response, "accelerance", band_hz=None)
    assert np.all(lines.weight[:, :, 200] < 2 * plain.weight[:, :, 200])
    assert np.array_equal(lines.weight[:, :, : 200 - STEADY_LINES], plain.weight[:, :, : 200 - STEADY_LINES])


def test_functions_without_sigma_are_weighed_by_how_they_jump():
    response = white(3)
    blind = replace(response, std=np.full(response.std.shape, np.inf))
    lines = judged_lines(blind, "receptance", band_hz=None)
    known = judged_lines(response, "receptance", band_hz=None)
    # 400 lines know a variance to a twelfth, their median to a tenth.
    np.testing.assert_allclose(np.median(lines.weight, axis=-1), np.median(known.weight, axis=-1), rtol=0.2)


def test_lines_of_one_function_that_are_missing_weigh_nothing():
    response = noisy(1)
    values = response.values.copy()
    values[2, 0, 50] = np.nan
    lines = judged_lines(replace(response, values=values), "accelerance", band_hz=None)
    assert lines.weight[2, 0, 50] == 0
    assert lines.weight[1, 0, 50] > 0
    assert np.isfinite(lines.values).all()

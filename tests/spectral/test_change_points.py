"""Steps whose places and sizes are known, and noise that has none."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from chladni.signals.errors import EstimateError
from chladni.spectral.change_points import find_steps


def false_alarms(*, runs: int, logs: int, alike: float, rate: float, seed: int) -> int:
    """Series of noise alone in which a step is found; neighbours correlate by `alike`."""
    rng = np.random.default_rng(seed)
    noise = lfilter([1.0], [1.0, -alike], rng.standard_normal((runs, logs + 100)))[:, 100:]
    return sum(bool(find_steps(one, false_alarm=rate).changes) for one in noise)


@pytest.mark.parametrize(
    ("runs", "logs", "alike", "rate"), [(200, 80, 0.0, 0.05), (200, 20, 0.0, 0.01), (100, 300, 0.6, 0.01)]
)
def test_noise_has_no_step_more_often_than_was_asked(runs: int, logs: int, alike: float, rate: float) -> None:
    # As many as a method of just this rate exceeds once in a hundred tries.
    most = binom.ppf(0.99, runs, rate)
    assert false_alarms(runs=runs, logs=logs, alike=alike, rate=rate, seed=11) <= most


def test_steps_are_found_where_they_are_with_their_sizes() -> None:
    rng = np.random.default_rng(2)
    truth = 10 + 3.0 * (np.arange(200) >= 60) - 5.0 * (np.arange(200) >= 130)
    hits = inside = 0
    for _ in range(30):
        found = find_steps(truth + rng.standard_normal(200))
        if len(found.changes) != 2:
            continue
        hits += 1
        for change, place, step in zip(found.changes, (60, 130), (3.0, -5.0), strict=True):
            inside += change.first <= place <= change.last
            assert abs(change.step - step) < 5 * change.step_std
    assert hits >= 27
    # 95 % of all, less three sigma of the binomial law.
    assert inside >= 0.95 * 2 * hits - 3 * np.sqrt(2 * hits * 0.95 * 0.05)


def test_a_covariate_explains_what_would_else_be_steps() -> None:
    rng, days = np.random.default_rng(3), np.arange(365)
    temperature = 10 - 12 * np.cos(2 * np.pi * days / 365) + 3 * rng.standard_normal(365)
    frequency_hz = 4.0 - 0.01 * temperature + 0.005 * rng.standard_normal(365)
    found = find_steps(frequency_hz, covariates=[temperature])
    assert not found.changes
    assert abs(found.slopes[0] + 0.01) < 4 * found.slopes_std[0]
    damaged = frequency_hz - 0.02 * (days >= 250)
    [change] = find_steps(damaged, covariates=[temperature]).changes
    assert change.first <= 250 <= change.last
    assert abs(change.step + 0.02) < 4 * change.step_std
    # Without it the year hides what it takes.
    assert find_steps(damaged).scatter > 5 * find_steps(damaged, covariates=[temperature]).scatter


def test_a_level_that_comes_back_is_two_steps() -> None:
    rng, found = np.random.default_rng(5), 0
    for _ in range(20):
        values = rng.standard_normal(120) + 4.0 * ((np.arange(120) >= 50) & (np.arange(120) < 70))
        changes = find_steps(values).changes
        found += [one.first - 3 <= place <= one.last + 3 for one, place in zip(changes, (50, 70), strict=False)] == [
            True, True
        ]  # fmt: skip
    assert found >= 18


def test_a_value_of_little_weight_moves_little() -> None:
    values, std = np.zeros(40), np.full(40, 0.1)
    values += 0.1 * np.random.default_rng(4).standard_normal(40)
    values[20:24], std[20:24] = 30.0, 30.0
    assert not find_steps(values, std=std).changes


@pytest.mark.parametrize("length", [1, 2, 5])
def test_a_short_series_has_no_step(length: int) -> None:
    found = find_steps(np.arange(length, dtype=float))
    assert not found.changes
    assert found.expected.shape == (length,)


def test_an_exact_step_is_one() -> None:
    [change] = find_steps(np.repeat([1.0, 2.0], 10)).changes
    assert (change.place, change.first, change.last) == (10, 10, 10)
    assert not find_steps(np.ones(20)).changes


@pytest.mark.parametrize("values", [[], [1.0, np.nan], [[1.0, 2.0]]])
def test_what_is_no_series_is_refused(values: list[float]) -> None:
    with pytest.raises(EstimateError, match="must be one-dimensional"):
        find_steps(values)
    with pytest.raises(EstimateError, match="covariates of shape"):
        find_steps([1.0, 2.0], covariates=[[1.0]])

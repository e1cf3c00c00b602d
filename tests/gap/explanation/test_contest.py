"""Held-out blocks and the evidence that is taken from them."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.explanation.contest import EFFECTIVE_SAMPLES, SLACK, held_gap, log_evidence, training_mask, weighed
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis


def left(*held):
    """A contestant that leaves these mean squares, in units of the noise."""
    return Contestant(hypothesis=Hypothesis(start_z=np.zeros(0)), fit=None, held=np.array(held), gap=0.0, prior=0.0)


def test_a_third_is_held_out_in_blocks_over_the_whole_log() -> None:
    mask = training_mask(36_000, 1000.0)
    assert np.mean(~mask) == pytest.approx(1 / 3, abs=0.05)
    edges = np.flatnonzero(np.diff(mask.astype(int)))
    assert edges.size >= 8
    # Both halves hold some: a drift would be all on one side otherwise.
    assert np.mean(~mask[:18_000]) == pytest.approx(np.mean(~mask[18_000:]), abs=0.1)


def test_blocks_do_not_keep_step_with_a_period() -> None:
    period = 3 * 750
    mask = training_mask(10 * period, 1000.0, period)
    phases = {int(start) % period for start in np.flatnonzero(np.diff(mask.astype(int)) == -1)}
    assert len(phases) > 3


def test_a_short_log_has_held_out_blocks_too() -> None:
    mask = training_mask(300, 1000.0)
    assert np.count_nonzero(np.diff(mask.astype(int)) == -1) >= 3


def test_evidence_is_that_of_the_formula() -> None:
    held = np.array([1.0, 2.0])
    expected = -0.5 * EFFECTIVE_SAMPLES * np.log((2.0 + SLACK) / (1.0 + SLACK)) - 1.5 - np.log(EFFECTIVE_SAMPLES)
    assert log_evidence(held, 3.0, 2) == pytest.approx(expected)


def test_the_gap_is_one_when_nothing_is_simulated() -> None:
    measured = np.random.default_rng(0).standard_normal((2, 5000)) * np.array([[1.0], [100.0]])
    assert held_gap(measured, np.zeros_like(measured), np.ones(5000, dtype=bool)) == pytest.approx(1.0, abs=1e-3)


def test_a_floor_that_the_best_gets_under_is_lowered_for_all() -> None:
    # A sensor that clips looks noisy: of a floor 20 times too high, 2 % and 5 % left are far apart, not alike.
    better, worse = weighed([left(1.0, 0.05), left(1.0, 0.02)])
    assert better.held[1] == 0.02
    assert better.log_evidence - worse.log_evidence == pytest.approx(
        0.5 * EFFECTIVE_SAMPLES * np.log((2.5 + SLACK) / (1.0 + SLACK))
    )


def test_a_floor_is_never_raised() -> None:
    better, worse = weighed([left(2.0, 1.0), left(3.0, 1.0)])
    assert better.log_evidence - worse.log_evidence == pytest.approx(
        0.5 * EFFECTIVE_SAMPLES * np.log((3.0 + SLACK) / (2.0 + SLACK))
    )


def test_states_that_windows_begin_with_are_paid_for() -> None:
    free = replace(left(1.0, 1.0), starts=24)
    assert (
        log_evidence(np.ones(2), 0.0, 24)
        == next(one for one in weighed([left(1.0, 1.0), free]) if one.starts).log_evidence
    )

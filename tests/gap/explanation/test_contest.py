"""Held-out blocks and the evidence that is taken from them."""

import numpy as np
import pytest

from chladni.gap.explanation.contest import EFFECTIVE_SAMPLES, SLACK, held_gap, log_evidence, training_mask


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

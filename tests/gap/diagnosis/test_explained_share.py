"""Which share of the gap's power each named cause explains."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.closing import explained_power
from chladni.gap.diagnosis.naming import with_shares
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.records.diagnosis import Cause
from chladni.models.effects.attached_effect import AttachedEffect, attached
from tests import made_diagnosis as made
from tests.gap.fitted import causes as answered
from tests.gap.fitted import contestant

LAG = attached("lag", "shaker", {"time_constant": 1e-3})
MOUNT = attached("mounting_resonance", "acc_wrist", {"frequency": 200.0, "damping_ratio": 0.02})
DRAG = attached("quadratic_damping", "elbow", {"coefficient": 30.0})
#: Of the powers 0.25, 0.05 and 0.01 the share that is explained is 0.20 of 0.24.
GAP = replace(made.diagnosis().gap, tuned=0.5, after=np.sqrt(0.05), noise=0.1, explained=0.2 / 0.24)


def fitted(gap: float, *effects: AttachedEffect) -> Contestant:
    return contestant(*effects, gap=gap)


def causes(*ranked: Contestant) -> Causes:
    """The answer of fits by falling evidence."""
    falling = [replace(one, log_evidence=-20.0 * place) for place, one in enumerate(ranked)]
    return answered(*falling, tuned=contestant(gap=0.5, log_evidence=-1000.0))


def said(*effects: AttachedEffect) -> list[Cause]:
    return [made.friction(effect=one.effect, site=one.site, share=None) for one in effects]


def test_one_cause_has_all_that_is_explained() -> None:
    (only,) = with_shares(causes(fitted(GAP.after, LAG), fitted(0.3, MOUNT)), said(LAG), GAP)
    assert only.share == GAP.explained


def test_of_two_each_has_what_comes_back_without_it() -> None:
    # The best fit of each alone is the one first by evidence, whatever else it leaves.
    ranked = (
        fitted(GAP.after, LAG, MOUNT), fitted(0.3, MOUNT), fitted(0.2, MOUNT), fitted(0.4, LAG)
    )  # fmt: skip
    lag, mount = with_shares(causes(*ranked), said(LAG, MOUNT), GAP)
    assert lag.share == pytest.approx((0.09 - 0.05) / 0.24)
    assert mount.share == pytest.approx((0.16 - 0.05) / 0.24)


def test_without_a_fit_of_the_others_alone_nothing_tells() -> None:
    ranked = (fitted(GAP.after, LAG, MOUNT), fitted(0.3, MOUNT), fitted(0.2, LAG, DRAG))
    lag, mount = with_shares(causes(*ranked), said(LAG, MOUNT), GAP)
    assert lag.share is not None
    assert mount.share is None


def test_where_no_share_is_explained_none_is_told() -> None:
    ranked = (fitted(0.1, LAG, MOUNT), fitted(0.11, MOUNT), fitted(0.12, LAG))
    near = replace(GAP, explained=None)
    assert [one.share for one in with_shares(causes(*ranked), said(LAG, MOUNT), near)] == [None, None]


def test_steps_of_a_sensor_that_no_fit_told_have_none() -> None:
    steps = made.friction(effect="quantization", site="acc_wrist", share=None)
    lag, quantized = with_shares(causes(fitted(GAP.after, LAG)), [*said(LAG), steps], GAP)
    assert (lag.share, quantized.share) == (GAP.explained, None)


def test_a_cause_without_which_all_diverges_is_worth_no_more_than_all() -> None:
    assert explained_power(1e9, 0.5, 0.2, noise=0.1) == explained_power(0.5, 0.5, 0.2, noise=0.1)
    assert explained_power(0.15, 0.5, 0.2, noise=0.1) == 0.0

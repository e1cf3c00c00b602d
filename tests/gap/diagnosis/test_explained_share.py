"""Which share of the gap's power each named cause explains."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis.causes import Causes
from chladni.gap.diagnosis.closing import explained_power
from chladni.gap.diagnosis.explained_share import with_shares
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.records.diagnosis import Cause
from chladni.models.effects.attached_effect import AttachedEffect, attached
from tests import made_diagnosis as made

LAG = attached("lag", "shaker", {"time_constant": 1e-3})
MOUNT = attached("mounting_resonance", "acc_wrist", {"frequency": 200.0, "damping_ratio": 0.02})
DRAG = attached("quadratic_damping", "elbow", {"coefficient": 30.0})
#: Of the powers 0.25, 0.05 and 0.01 the share that is explained is 0.20 of 0.24.
GAP = replace(made.diagnosis().gap, tuned=0.5, after=np.sqrt(0.05), noise=0.1, explained=0.2 / 0.24)


def contestant(gap: float, *effects: AttachedEffect) -> Contestant:
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return Contestant(hypothesis=hypothesis, fit=SimpleNamespace(), held=np.ones(2), gap=gap, prior=0.0)


def causes(*ranked: Contestant) -> Causes:
    return Causes(
        verdict="effect",
        tuned=contestant(0.5),
        best=ranked[0],
        ranked=ranked,
        probabilities=(1.0 / len(ranked),) * len(ranked),
        shaken=None,
        noise=None,
        distorted=(),
        instead=None,
        states=None,
    )


def said(*effects: AttachedEffect) -> list[Cause]:
    return [made.friction(effect=one.effect, site=one.site, share=None) for one in effects]


def test_one_cause_has_all_that_is_explained() -> None:
    (only,) = with_shares(causes(contestant(GAP.after, LAG), contestant(0.3, MOUNT)), said(LAG), GAP)
    assert only.share == GAP.explained


def test_of_two_each_has_what_comes_back_without_it() -> None:
    # The best fit of each alone is the one first by evidence, whatever else it leaves.
    ranked = (
        contestant(GAP.after, LAG, MOUNT), contestant(0.3, MOUNT), contestant(0.2, MOUNT), contestant(0.4, LAG)
    )  # fmt: skip
    lag, mount = with_shares(causes(*ranked), said(LAG, MOUNT), GAP)
    assert lag.share == pytest.approx((0.09 - 0.05) / 0.24)
    assert mount.share == pytest.approx((0.16 - 0.05) / 0.24)


def test_without_a_fit_of_the_others_alone_nothing_tells() -> None:
    ranked = (contestant(GAP.after, LAG, MOUNT), contestant(0.3, MOUNT), contestant(0.2, LAG, DRAG))
    lag, mount = with_shares(causes(*ranked), said(LAG, MOUNT), GAP)
    assert lag.share is not None
    assert mount.share is None


def test_where_no_share_is_explained_none_is_told() -> None:
    ranked = (contestant(0.1, LAG, MOUNT), contestant(0.11, MOUNT), contestant(0.12, LAG))
    near = replace(GAP, explained=None)
    assert [one.share for one in with_shares(causes(*ranked), said(LAG, MOUNT), near)] == [None, None]


def test_steps_of_a_sensor_that_no_fit_told_have_none() -> None:
    steps = made.friction(effect="quantization", site="acc_wrist", share=None)
    lag, quantized = with_shares(causes(contestant(GAP.after, LAG)), [*said(LAG), steps], GAP)
    assert (lag.share, quantized.share) == (GAP.explained, None)


def test_a_cause_without_which_all_diverges_is_worth_no_more_than_all() -> None:
    assert explained_power(1e9, 0.5, 0.2, noise=0.1) == explained_power(0.5, 0.5, 0.2, noise=0.1)
    assert explained_power(0.15, 0.5, 0.2, noise=0.1) == 0.0

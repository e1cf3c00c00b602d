"""In which order several causes are named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis.causes import Causes
from chladni.gap.diagnosis.naming import causes_named, ranking_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.models.effects.attached_effect import AttachedEffect, attached

LAG = attached("lag", "shaker", {"time_constant": 1e-3})
MOUNT = attached("mounting_resonance", "acc_wrist", {"frequency": 200.0, "damping_ratio": 0.02})


def contestant(chi: float, *effects: AttachedEffect) -> Contestant:
    """A fit of some effects that leaves this mean square, in units of the noise."""
    fit = SimpleNamespace(effects=effects, effect_std=tuple({} for _ in effects))
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return Contestant(hypothesis=hypothesis, fit=fit, held=np.full(2, chi), gap=0.0, prior=0.0)


def weighed_causes(ranked: tuple[Contestant, ...], probabilities: tuple[float, ...]) -> Causes:
    return Causes(
        verdict="effect",
        tuned=contestant(100.0),
        best=ranked[0],
        ranked=ranked,
        probabilities=probabilities,
        shaken=None,
        noise=None,
        distorted=(),
        instead=None,
        states=None,
    )


@pytest.mark.parametrize(("lag", "mount", "first"), [(5.0, 50.0, "lag"), (50.0, 5.0, "mounting_resonance")])
def test_the_cause_that_alone_leaves_least_comes_first(lag: float, mount: float, first: str) -> None:
    ranked = (contestant(1.0, MOUNT, LAG), contestant(lag, LAG), contestant(mount, MOUNT))
    causes = weighed_causes(ranked, (0.9, 0.05, 0.05))
    named = causes_named(SimpleNamespace(stepping=None), causes)
    assert named[0].effect == first
    assert len(named) == 2


def test_a_word_at_sites_that_look_the_same_is_as_probable_as_all_of_them_together() -> None:
    joint = attached("ripple", "elbow", {"amplitude": 3.0, "period": 0.01})
    drag = attached("quadratic_damping", "elbow", {"coefficient": 30.0})
    ranked = (
        contestant(1.0, joint),
        contestant(1.0, replace(joint, site="shaker")),
        contestant(1.0, drag),
        contestant(9.0, replace(joint, site="shoulder")),
    )
    ranked = (*(replace(one, log_evidence=-10.0) for one in ranked[:3]), replace(ranked[3], log_evidence=-90.0))
    causes = weighed_causes(ranked, (0.4, 0.35, 0.15, 0.05))
    (named,) = causes_named(SimpleNamespace(stepping=None), causes)
    assert named.group == ("elbow", "shaker")
    assert named.probability == pytest.approx(0.75)
    rows = {(one.effect, one.site): one.probability for one in ranking_of(causes, (named,))}
    assert rows["ripple", "elbow"] == 0.4
    assert rows["ripple", "shaker"] == 0.35


def test_a_word_that_is_best_as_half_of_a_pair_says_beside_what() -> None:
    # By falling evidence: the mount's best fit is the pair's, the lag's is its own.
    ranked = (contestant(1.0, LAG), contestant(1.0, MOUNT, LAG), contestant(9.0, MOUNT))
    causes = weighed_causes(ranked, (0.9, 0.05, 0.05))
    rows = {one.effect: one for one in ranking_of(causes, causes_named(SimpleNamespace(stepping=None), causes))}
    assert rows["lag"].beside == ()
    assert [(one.effect, one.site) for one in rows["mounting_resonance"].beside] == [("lag", "shaker")]

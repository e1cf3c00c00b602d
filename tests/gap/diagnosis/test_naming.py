"""In which order several causes are named."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis.causes import Causes
from chladni.gap.diagnosis.naming import causes_named
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.models.effects.attached_effect import AttachedEffect, attached

LAG = attached("lag", "shaker", {"time_constant": 1e-3})
MOUNT = attached("mounting_resonance", "acc_wrist", {"frequency": 200.0, "damping_ratio": 0.02})


def contestant(chi: float, *effects: AttachedEffect) -> Contestant:
    """A fit of some effects that leaves this mean square, in units of the noise."""
    fit = SimpleNamespace(effects=effects, effect_std=tuple({} for _ in effects))
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return Contestant(hypothesis=hypothesis, fit=fit, held=np.full(2, chi), gap=0.0, prior=0.0)


@pytest.mark.parametrize(("lag", "mount", "first"), [(5.0, 50.0, "lag"), (50.0, 5.0, "mounting_resonance")])
def test_the_cause_that_alone_leaves_least_comes_first(lag: float, mount: float, first: str) -> None:
    both = contestant(1.0, MOUNT, LAG)
    causes = Causes(
        verdict="effect",
        tuned=contestant(100.0),
        best=both,
        ranked=(both, contestant(lag, LAG), contestant(mount, MOUNT)),
        probabilities=(0.9, 0.05, 0.05),
        shaken=None,
        noise=None,
        distorted=(),
        instead=None,
        followed=False,
    )
    named = causes_named(SimpleNamespace(lattices={}), causes)
    assert named[0].effect == first
    assert len(named) == 2

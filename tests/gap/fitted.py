"""Contestants without a fit, and what is believed of them: what tests of the answer share."""

from types import SimpleNamespace

import numpy as np

from chladni.gap.calibration import LAPSE, TEMPER
from chladni.gap.diagnosis.belief import Belief
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.evidence import Left
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.records.diagnosis import Verdict
from chladni.models.effects.attached_effect import AttachedEffect
from tests.gap.made_log import three_bodies, white_floor

#: Numbers on which noise leaves an energy of one each.
LINES = 1000.0


def leaving(chi: float, *, force: float = 0.0, along: float = 0.0) -> Left:
    """What leaves so many times the noise across the sites, and `along` beyond the noise along them."""
    return Left(
        along=LINES + along, along_expected=LINES, across=2 * LINES * chi, across_expected=2 * LINES, force=force
    )


def contestant(
    *effects: AttachedEffect,
    chi: float = 1.0,
    outputs: int = 2,
    gap: float = 0.0,
    log_evidence: float = 0.0,
    freed: tuple[str, ...] = (),
    left: Left | None = None,
) -> Contestant:
    """Effects, or values that are wrong, that leave this mean square of each output, in units of the noise.

    Without `left` each of several causes explains something.
    """
    count = len(effects) + len(freed)
    return Contestant(
        hypothesis=Hypothesis(effects=effects, fitted=((),) * len(effects), freed=freed, start_z=np.zeros(0)),
        fit=SimpleNamespace(effects=effects, effect_std=tuple({} for _ in effects)),
        held=np.full(outputs, chi),
        gap=gap,
        left=leaving(1.0 + 100.0 / (1.0 + count)) if left is None else left,
        log_evidence=log_evidence,
    )


def location(ranked=(), *, sensors=3, misfit=1.0):
    """Where forces were looked for in three bodies, whose tuned model leaves `misfit` times the noise."""
    model = three_bodies()
    names = tuple(one.name for one in model.outputs[:sensors])
    problem = SimpleNamespace(
        model=model,
        measurement=SimpleNamespace(output_names=names),
        measured=np.zeros((sensors, 1, 1)),
        tunables=SimpleNamespace(names=tuple(model.parameters)),
        noise=white_floor(np.ones(sensors)),
    )
    tuned = SimpleNamespace(misfit=misfit * sensors * LINES, expected=sensors * LINES, prior=0.0)
    return SimpleNamespace(problem=problem, tuned=tuned, ranked=tuple(ranked))


def causes(*ranked: Contestant, tuned: Contestant, verdict: Verdict = "effect") -> Causes:
    """What is said where the first of contestants is believed."""
    return Causes(
        verdict=verdict,
        tuned=tuned,
        best=ranked[0] if ranked else tuned,
        belief=Belief(location(), [tuned, *ranked]),
        shaken=None,
        noise=None,
        distorted=(),
    )


#: Probability that any of what was weighed is right.
SURE = 1.0 - LAPSE
#: Nats by which these are more probable than a force of any shape anywhere.
_FAR = 1000.0


def as_probable(one: Contestant, share: float) -> float:
    """Log evidence with which a contestant has a share of `SURE`, among others that are given one so."""
    return float(_FAR + TEMPER * np.log(share)) - Belief(location(), [one]).nats(one) + one.log_evidence

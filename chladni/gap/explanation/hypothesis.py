"""Hypotheses on what a model lacks, and what their fits say."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.explanation.evidence import Left
from chladni.gap.records.diagnosis import PARAMETER, Candidate
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Hypothesis:
    """Effects at sites, or parameters that may leave their tolerance; nothing of either is "the model is right".

    Attributes
    ----------
    effects
        With the values that their fit starts from.
    fitted
        For each effect the names of the parameters that move.
    freed
        Names of parameters whose value may be wrong.
    initial
        ``[window, state]`` where the states of the model without these effects start, None when nothing tells.
    """

    effects: tuple[AttachedEffect, ...] = ()
    fitted: tuple[tuple[str, ...], ...] = ()
    freed: tuple[str, ...] = ()
    start_z: Real
    initial: Real | None = None

    @property
    def named(self) -> tuple[Candidate, ...]:
        """What it names as causes."""
        effects = [Candidate(effect=one.effect, site=one.site) for one in self.effects]
        return (*effects, *(Candidate(effect=PARAMETER, site=name) for name in self.freed))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Contestant:
    """A hypothesis that was fitted in free run.

    Attributes
    ----------
    hypothesis, fit
        What, and the result on the training samples.
    held
        ``[output]`` mean square of the whitened residual on the samples that the fit didn't see; 1 is noise.
    gap
        RMS of the residual over RMS of what was measured, on those samples, outputs scaled by their RMS.
    left
        What it leaves on the telling lines, of its laws' force and elsewhere.
    log_evidence
        Nats, but for a constant that all hypotheses that were weighed together share.
    """

    hypothesis: Hypothesis
    fit: OutputErrorFit
    held: Real
    gap: float
    left: Left
    log_evidence: float = 0.0

    @property
    def chi(self) -> float:
        """Mean of `held` over the outputs."""
        return float(np.mean(self.held))

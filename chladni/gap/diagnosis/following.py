"""Laws that follow the log over short windows, where every run parts from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import FAR, FITS, PLACES
from chladni.gap.diagnosis.study import Study, recovered_states
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_effect import KnownStates
from chladni.gap.explanation.shooting import Shooting, Shot
from chladni.gap.location.locate import Located


@dataclass(frozen=True, slots=True, kw_only=True)
class Entered:
    """Causes that were entered.

    Attributes
    ----------
    ranked
        By falling evidence.
    states
        That the machine went through, when all runs were lost and a law follows the log from these over short windows
        nearly as far as unknown forces do; else None.
    forces
        Unknown forces at two places that explain much more than one anywhere, when they were looked for; else None.
    """

    ranked: Sequence[Contestant] = ()
    states: KnownStates | None = None
    forces: Located | None = None


def least_force(located: Located | None) -> float:
    """Give what unknown forces leave, over the noise's power, at least 1; infinite where none was looked for."""
    return np.inf if located is None or not located.profile.forces else max(located.profile.chi, 1.0)


def is_lost_beside(located: Located | None, left: float) -> bool:
    """Whether what the best runs leave, over the noise's power, is far more than unknown forces do."""
    return left > FAR * least_force(located)


def followed(study: Study, located: Located | None, hypotheses: Sequence[Hypothesis]) -> Entered | None:
    """Enter the hypotheses that follow the log over short windows, from there; None when none does.

    Where unknown forces explain far more than any named one, its run may have gone another way than the log's. Those
    of the place, or two, that are given tell the states at which windows begin.
    """
    states = recovered_states(study.location.problem, located)
    if states is None:
        return None
    shooting = Shooting(study.contest, states)
    following = _following(shooting, hypotheses, FAR * least_force(located))
    entered = [shooting.entered(shot) for shot in following]
    return Entered(ranked=[one for one in entered if one is not None], states=states) if following else None


def _following(shooting: Shooting, hypotheses: Sequence[Hypothesis], enough: float) -> list[Shot]:
    """Shoot the most promising hypotheses; those that explain nearly what unknown forces do, best first."""
    shots = [shot for shot in map(shooting.shot, hypotheses[:FITS]) if shot is not None]
    return sorted((one for one in shots if one.misfit < enough), key=lambda one: one.misfit)[:PLACES]

"""Causes over windows where a free run parts from the log's, whatever is named."""

from collections.abc import Callable

from chladni.gap.diagnosis.causes import Causes, causes_of
from chladni.gap.diagnosis.search import TRIED, following, is_lost, plausible_places
from chladni.gap.diagnosis.study import Study, over_windows
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.hypotheses import effect_hypotheses
from chladni.gap.explanation.shooting import Shooting

Step = Callable[[float], None]


def causes_found(study: Study, progress: Step) -> tuple[Study, Causes]:
    """Judge a study; where no named effect's run follows the log, over windows, when one is named there.

    A machine that may come to rest at several places, or take several ways on, goes one that a model of almost the
    same numbers doesn't. An unknown force goes with it: where that explains far more than any run does, the states
    that it led through are where windows begin.
    """
    causes = causes_of(study, progress)
    unexplained = causes.verdict == "unknown" and causes.instead is None
    if not unexplained or study.windows is not None or not is_lost(study.location, causes.best.chi):
        return study, causes
    windowed = over_windows(study)
    if windowed is None or not _is_followed(windowed):
        return study, causes
    again = causes_of(windowed, progress)
    return (windowed, again) if again.verdict == "effect" and again.shaken is None else (study, causes)


def _is_followed(study: Study) -> bool:
    """Whether a law of the catalogue follows the log over short windows as far as an unknown force does."""
    states = study.contest.states
    if states is None:
        return False
    candidates = screened(study.location, plausible_places(study.location), study.leave_out, study.own)
    hypotheses = effect_hypotheses(candidates, study.own, count=TRIED)
    return bool(following(study, Shooting(study.contest, states), hypotheses))

"""Causes over windows where a free run parts from the log's, whatever is named."""

from collections.abc import Callable

from chladni.gap.diagnosis.causes import Causes, causes_of
from chladni.gap.diagnosis.search import is_lost
from chladni.gap.diagnosis.study import Study, over_windows

Step = Callable[[float], None]
#: Share of the progress that a contest takes which another one over windows may follow.
_FIRST = 0.7


def causes_found(study: Study, progress: Step) -> tuple[Study, Causes]:
    """Judge a study; where no named effect's run follows the log, over windows, when one is named there.

    A machine that may come to rest at several places, or take several ways on, goes one that a model of almost the
    same numbers doesn't. An unknown force goes with it: where that explains far more than any run does, and a law
    follows as far over short windows, the states that it led through are where longer windows begin.
    """
    causes = causes_of(study, lambda done: progress(_FIRST * done))
    windowed = over_windows(study) if _parted(study, causes) else None
    if windowed is not None:
        again = causes_of(windowed, lambda done: progress(_FIRST + (1.0 - _FIRST) * done))
        if again.verdict == "effect" and again.shaken is None:
            study, causes = windowed, again
    progress(1.0)
    return study, causes


def _parted(study: Study, causes: Causes) -> bool:
    """Whether nothing is named since runs part from the log's; where something else explains it, they don't."""
    unexplained = causes.verdict == "unknown" and causes.instead is None
    return unexplained and study.windows is None and causes.followed and is_lost(study.location, causes.best.chi)

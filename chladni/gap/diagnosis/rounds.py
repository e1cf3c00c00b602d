"""Causes in further rounds: over a finer floor, and over windows where a free run parts from the log's."""

from collections.abc import Callable

from chladni.gap.diagnosis.causes import Causes, causes_of
from chladni.gap.diagnosis.finer_floor import finer_floor
from chladni.gap.diagnosis.quieter_floor import quieter_study
from chladni.gap.diagnosis.search import is_lost
from chladni.gap.diagnosis.study import Study, over_floor, over_windows

Step = Callable[[float], None]
#: Progress at the ends of the first contest, of another one over a finer floor, and of one over the quiet band's.
_FIRST, _FINER, _QUIETER = 0.6, 0.75, 0.9


def causes_found(study: Study, progress: Step) -> tuple[Study, Causes]:
    """Judge a study; over a finer floor and over windows again, when effects are named there.

    Behind the first answer noise may turn out far lower than it was estimated, or a law promise to explain what was
    taken for noise; that is another cause.

    A machine that may come to rest at several places, or take several ways on, goes one that a model of almost the
    same numbers doesn't. An unknown force goes with it: where that explains far more than any run does, and a law
    follows as far over short windows, the states that it led through are where longer windows begin.
    """
    found = study, causes_of(study, _part(progress, 0.0, _FIRST))
    finer = finer_floor(*found)
    if finer is not None:
        found = _better(found, _again(found, over_floor(study, finer), _part(progress, _FIRST, _FINER)))
    quieter = quieter_study(*found)
    if quieter is not None:
        again = _again(found, quieter, _part(progress, _FINER, _QUIETER))
        # Of one effect the quiet band's noise tells nothing but to be lower.
        found = _better(found, again) if len(again[1].best.hypothesis.effects) > 1 else found
    states = found[1].states
    if states is not None and _parted(*found):
        found = _again(found, over_windows(found[0], states), _part(progress, _QUIETER, 1.0))
    progress(1.0)
    return found


def _part(progress: Step, start: float, stop: float) -> Step:
    return lambda done: progress(start + (stop - start) * done)


def _again(found: tuple[Study, Causes], study: Study, progress: Step) -> tuple[Study, Causes]:
    """Judge another study of the same log; what was found before where that names nothing."""
    causes = causes_of(study, progress)
    return (study, causes) if causes.verdict == "effect" and causes.shaken is None else found


def _better(found: tuple[Study, Causes], again: tuple[Study, Causes]) -> tuple[Study, Causes]:
    """Give the round whose answer leaves less on samples that no fit saw."""
    return min((found, again), key=lambda one: one[1].best.gap)


def _parted(study: Study, causes: Causes) -> bool:
    """Whether nothing is named since runs part from the log's; where something else explains it, they don't."""
    unexplained = causes.verdict == "unknown" and causes.instead is None
    return unexplained and study.windows is None and is_lost(study.location, causes.best.chi)

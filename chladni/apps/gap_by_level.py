"""Measured logs at several levels, each against its own simulation: what changes with level, in both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.apps.gap_comparison import GapComparison, comparison_document, noise_told
from chladni.apps.gap_document import Document
from chladni.gap.calibration import ALIKE
from chladni.gap.comparison.levels import compare_levels
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.records.measurement import Measurement
from chladni.signals.engineering import percent
from chladni.signals.errors import EstimateError


@dataclass(frozen=True, slots=True, kw_only=True)
class GapByLevel:
    """Comparisons at several levels.

    Attributes
    ----------
    comparisons
        One a pair of logs, in the order given.
    levels, simulated_levels
        Sentences on what changes with level: of the gap and the measured logs, of the simulated ones.
    """

    comparisons: tuple[GapComparison, ...]
    levels: tuple[str, ...]
    simulated_levels: tuple[str, ...]

    def sentences(self) -> tuple[str, ...]:
        """Both, for people; what holds for both logs is said once."""
        simulated = (f"in the simulation, {one}" for one in self.simulated_levels if one not in self.levels)
        return (*self.levels, *simulated)


def gap_by_level(comparisons: Sequence[GapComparison]) -> GapByLevel:
    """Say what changes with level, over comparisons of one machine with one sensor set in any order."""
    measured, simulated = zip(*(one.pair for one in comparisons), strict=True)
    return GapByLevel(
        comparisons=tuple(comparisons),
        levels=(*_growth(comparisons), *_changes(measured)),
        simulated_levels=_changes(simulated),
    )


def by_level_document(found: GapByLevel) -> Document:
    """Document of the first comparison, with `further` ones and what changes with level."""
    first, *rest = (comparison_document(one) for one in found.comparisons)
    told = {"levels": list(found.levels), "simulated_levels": list(found.simulated_levels)}
    return first | {"further": rest} | {key: sentences for key, sentences in told.items() if sentences}


def _changes(measurements: Sequence[Measurement]) -> tuple[str, ...]:
    try:
        return compare_levels([with_period(one) for one in measurements])
    except EstimateError:
        # Too short for a frequency response; what the gap does is told all the same.
        return ()


def _growth(comparisons: Sequence[GapComparison]) -> tuple[str, ...]:
    """How the gap goes from the lowest level to the highest, of the strongest input that all logs share."""
    shared = [name for name in comparisons[0].inputs if all(name in one.inputs for one in comparisons)]
    if not shared:
        return ()
    name = max(shared, key=lambda one: _level(comparisons[0], one))
    low, *_, high = sorted(comparisons, key=lambda one: _level(one, name))
    low_level, high_level = (_level(one, name) for one in (low, high))
    if high_level < ALIKE * low_level:
        return ()
    first, last = (f"{percent(one.gap)} (noise {noise_told(one)})" for one in (low, high))
    return (f"the gap is {first} at {low_level:.3g} RMS of {name}, {last} at {high_level:.3g}",)


def _level(one: GapComparison, name: str) -> float:
    measured = one.pair[0]
    return float(np.std(measured.inputs[measured.input_names.index(name)]))

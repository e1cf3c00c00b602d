"""Linearity: whether functions stay the same when the excitation is stronger."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.comparison import PeakChange, ResponseComparison
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import Value, require_shape
from chladni.signals.wording import counted
from chladni.spectral.comparison import compare_responses

LinearityVerdict = Literal["linear", "nearly linear", "nonlinear", "undecided"]
# Changes below this share of the function hardly move a mode within its bandwidth.
NEARLY = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearityCheck(Value):
    """How far functions at other levels are from those at the first.

    Attributes
    ----------
    comparisons
        One for each level but the first: lines, phases, peaks.
    difference
        ``[level, response, reference]`` of each level against the first: root of sum |H_level - H_first|^2 over sum
        |H_first|^2.
    expected
        ``[level, response, reference]`` the same as far as the random error of both explains it.
    significant_share
        ``[level, response, reference]`` share of the lines whose difference random error doesn't explain.
    verdict
        What follows from the numbers.
    finding
        The same in a sentence, with the peak that changes most.
    """

    comparisons: tuple[ResponseComparison, ...]
    difference: Real
    expected: Real
    significant_share: Real
    verdict: LinearityVerdict
    finding: str

    def __post_init__(self) -> None:
        require_shape("difference", self.difference, self.significant_share.shape, "levels x functions")
        require_shape("expected", self.expected, self.significant_share.shape, "levels x functions")
        self._freeze()

    @property
    def peaks(self) -> tuple[PeakChange, ...]:
        """What became of the peaks between the first and the last level."""
        return self.comparisons[-1].peaks


def check_linearity(responses: Sequence[FrequencyResponse], *, false_alarm: float = 0.01) -> LinearityCheck:
    """Compare the same functions at several levels of excitation.

    Parameters
    ----------
    responses
        One set of functions a level, by rising level, with the same channels and lines.
    false_alarm
        Chance of calling any line of a linear structure changed, 0 to 1; all levels share it.

    Returns
    -------
    LinearityCheck
        ``nearly linear`` when changes are significant but below 10 % of every function, ``undecided`` when no line is
        excited at all levels.

    Raises
    ------
    EstimateError
        When there are fewer than two levels, channels, units or lines differ, or the chance is out of range.

    Notes
    -----
    Linear structures have functions that don't depend on the excitation (homogeneity; Worden & Tomlinson 2001,
    chapter 2). Lines are tested together after Benjamini & Hochberg (1995), see
    `chladni.spectral.comparison.compare_responses`; where nothing changed its share of false discoveries is the
    chance of any. Whatever else changes between levels, such as temperature or a slipping stinger, looks the same.
    """
    if len(responses) < 2:
        raise EstimateError(
            f"{counted(len(responses), 'level')} given; linearity shows between two levels of excitation at least"
        )
    if not 0 < false_alarm < 1:
        raise EstimateError(f"false_alarm is {false_alarm}; it must lie between 0 and 1")
    first, *others = responses
    for number, other in enumerate(others, start=2):
        _require_same_channels(first, other, number)
    share = false_alarm / len(others)
    comparisons = tuple(compare_responses(first, other, false_discovery=share) for other in others)
    measured = [_distance(first, other, one) for other, one in zip(others, comparisons, strict=True)]
    difference, expected, significant = (np.stack(part) for part in zip(*measured, strict=True))
    verdict = _verdict(difference, significant)
    return LinearityCheck(
        comparisons=comparisons,
        difference=difference,
        expected=expected,
        significant_share=significant,
        verdict=verdict,
        finding=_sentence(verdict, comparisons, difference, expected, significant),
    )


def _require_same_channels(first: FrequencyResponse, other: FrequencyResponse, number: int) -> None:
    names = [[channel.name for channel in (*r.responses, *r.references)] for r in (first, other)]
    if names[0] != names[1]:
        raise EstimateError(
            f"level 1 has channels {', '.join(names[0])}, level {number} {', '.join(names[1])}: select the same ones "
            "in the same order"
        )


def _distance(
    first: FrequencyResponse, other: FrequencyResponse, compared: ResponseComparison
) -> tuple[Real, Real, Real]:
    """Relative difference of each function, what random error makes of it, and the share of lines it doesn't."""
    lines = np.isfinite(compared.change_db)

    def total(power: Real) -> Real:
        return np.asarray(np.where(lines, power, 0.0).sum(axis=2), dtype=np.float64)

    level = total(np.abs(first.values) ** 2)
    level = np.where(level > 0, level, np.nan)
    apart = total(np.abs(other.values - first.values) ** 2)
    # One sigma of the magnitude is one of the real and one of the imaginary part.
    random = 2 * (total(first.std**2) + total(other.std**2))
    count = lines.sum(axis=2)
    share = np.divide(compared.significant.sum(axis=2), count, out=np.full(count.shape, np.nan), where=count > 0)
    return np.sqrt(apart / level), np.sqrt(random / level), share


def _verdict(difference: Real, significant: Real) -> LinearityVerdict:
    if np.isnan(significant).all():
        return "undecided"
    changed = np.nan_to_num(significant) > 0
    if not changed.any():
        return "linear"
    return "nearly linear" if np.max(difference[changed]) <= NEARLY else "nonlinear"


def _sentence(
    verdict: LinearityVerdict,
    comparisons: tuple[ResponseComparison, ...],
    difference: Real,
    expected: Real,
    significant: Real,
) -> str:
    levels = counted(len(comparisons) + 1, "level")
    if verdict == "undecided":
        return f"linearity can't be checked: no line is excited at all of {levels}"
    if verdict == "linear":
        # A difference that isn't significant proves little where the error is large: so both are told.
        return (
            f"linear: between {levels} no line changes by more than its random error (functions by up to "
            f"{np.nanmax(difference):.1%}, where {np.nanmax(expected):.1%} is expected)"
        )
    # The function whose change is largest among those that changed for sure.
    worst = np.unravel_index(int(np.nanargmax(np.where(significant > 0, difference, -1.0))), difference.shape)
    compared = comparisons[int(worst[0])]
    names = f"{compared.responses[worst[1]].name} / {compared.references[worst[2]].name}"
    change = _most_changed(compared)
    return (
        f"{verdict}: {names} changes by {difference[worst]:.0%} between level 1 and {int(worst[0]) + 2} where random "
        f"error explains {expected[worst]:.1%} ({significant[worst]:.0%} of the lines){change}; modes hold for their "
        "level only"
    )


def _most_changed(compared: ResponseComparison) -> str:
    """Say what became of the peak whose height changed most in its unit."""
    paired = [peak for peak in compared.peaks if peak.before is not None and peak.after is not None]
    if not paired:
        return ""
    most = max(paired, key=_height_change)
    before, after = most.before, most.after
    if before is None or after is None:
        return ""
    return (
        f"; the peak of {most.channels[0]} goes from {before.frequency_hz:.4g} to {after.frequency_hz:.4g} Hz "
        f"(+- {most.shift_std_hz:.2g}) and from {before.height:.3g} to {after.height:.3g} {before.unit}"
    )


def _height_change(change: PeakChange) -> float:
    if change.before is None or change.after is None:
        return 0.0
    return abs(change.after.height - change.before.height)

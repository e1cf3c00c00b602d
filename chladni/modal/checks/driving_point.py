"""Driving points: found by point and direction, and judged by the power that goes in there."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.special

from chladni.signals.arrays import Complex, Mask, Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.unit_text import in_unit
from chladni.signals.wording import counted
from chladni.spectral.forms import MOTION_ORDER, convert_form
from chladni.spectral.line_scatter import std_or_scatter
from chladni.spectral.peaks import find_response_peaks
from chladni.spectral.response_advice import half_power_lines

DrivingPointVerdict = Literal["sound", "reversed", "not a driving point", "phase error", "undecided"]
# A phase that amplifiers and filters may add without a sensor being wrong (ISO 7626-2 asks for matched channels).
PHASE_ALLOWED_DEG = 5.0
# Directions whose cosine is farther from one belong to two sensors mounted by eye, not to one axis.
SAME_DIRECTION = 1e-3
PEAKS_JUDGED = 30
# Student's distribution is the normal one to six digits.
LARGE_FREEDOM = 1e7


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingPoint:
    """Judgement of one function whose response is measured where and along which the reference excites.

    Attributes
    ----------
    response, reference
        Names of its channels.
    sign
        1, or -1 when the directions in the setup are opposite: the function was judged times this.
    lines
        Excited lines that were judged.
    wrong_lines
        Lines on which the structure would give out power, beyond the random error and 5 degrees of phase.
    wrong_hz
        Lowest and highest of them, None when there are none.
    peaks, wrong_peaks
        Resonances whose sign is sure, and those of them with the wrong one.
    pairs
        Neighbouring resonances far enough apart for an antiresonance between them.
    missing_hz
        The pairs that have none.
    verdict
        What follows from the numbers.
    finding
        The same in a sentence, with what to do.
    """

    response: str
    reference: str
    sign: int
    lines: int
    wrong_lines: int
    wrong_hz: tuple[float, float] | None
    peaks: int
    wrong_peaks: int
    pairs: int
    missing_hz: tuple[tuple[float, float], ...]
    verdict: DrivingPointVerdict
    finding: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingPointCheck:
    """All driving points of a set of functions; none is an answer too.

    Attributes
    ----------
    points
        One for each function that is a driving point.
    finding
        The gravest of their sentences, or why there is none.
    """

    points: tuple[DrivingPoint, ...]
    finding: str

    @property
    def sound(self) -> bool:
        """Whether there is a driving point and none of them is in doubt."""
        return bool(self.points) and all(point.verdict in {"sound", "undecided"} for point in self.points)


def driving_points(responses: Sequence[Channel], references: Sequence[Channel]) -> tuple[tuple[int, int, int], ...]:
    """Find the functions whose response is measured at the point and along the direction of the reference.

    Parameters
    ----------
    responses, references
        Channels with point and direction; those without either match nothing.

    Returns
    -------
    tuple of (response, reference, sign)
        Indices; the sign is -1 where the two directions are opposite.

    Examples
    --------
    >>> hammer = Channel(name="f", point="tip", direction=(0.0, 0.0, -1.0))
    >>> sensor = Channel(name="a", point="tip", direction=(0.0, 0.0, 1.0))
    >>> driving_points([sensor], [hammer])
    ((0, 0, -1),)
    """
    found = [
        (row, column, same_place(answer, source))
        for row, answer in enumerate(responses)
        for column, source in enumerate(references)
    ]
    return tuple(entry for entry in found if entry[2])


def same_place(one: Channel, other: Channel) -> int:
    """Give 1 for channels at one point along one direction, -1 for opposite directions, 0 for two places."""
    return same_direction(one, other) if one.point is not None and one.point == other.point else 0


def same_direction(one: Channel, other: Channel) -> int:
    """Give 1 for channels along one direction, -1 for opposite ones, 0 for others or unknown ones."""
    if one.direction is None or other.direction is None:
        return 0
    cosine = float(np.dot(one.direction, other.direction))
    return int(np.sign(cosine)) if abs(cosine) >= 1 - SAME_DIRECTION else 0


def check_driving_point(
    response: FrequencyResponse,
    *,
    functions: Sequence[tuple[int, int, int]] | None = None,
    false_alarm: float = 0.01,
) -> DrivingPointCheck:
    """Judge driving points before any fit: a structure takes power in wherever it is driven.

    Parameters
    ----------
    response
        Functions in any form whose responses are motions.
    functions
        Driving points as (response, reference, sign), for channels without point and direction; default
        `driving_points`, those of them whose response is a motion.
    false_alarm
        Chance that the scatter of a sound driving point gives it any wrong line or peak, 0 to 1.

    Returns
    -------
    DrivingPointCheck
        A point is ``reversed`` when all its resonances have the wrong sign, ``not a driving point`` when they differ
        in sign, ``phase error`` when the resonances are right and other lines are not, ``undecided`` when noise hides
        all signs.

    Raises
    ------
    EstimateError
        When a response of `functions` is no motion, a function isn't there, or `false_alarm` is out of range.

    Notes
    -----
    Power in is F^2 Re(Y)/2 with the mobility Y, so Re(Y) >= 0 on *every* line; at resonances that is Im(receptance)
    < 0 and Im(accelerance) > 0 for e^{+j omega t} (Ewins 2000, sections 2.10 and 3.7). Each line is tested against
    Student's distribution with 2 (n - q) degrees of freedom, n effective averages, q references (the normal one when
    n isn't known). Between resonances of one sign Im(Y) goes through zero once, from below: the antiresonance. It is
    asked for where both modes, as wide and as high as they are, outweigh each other at their own half-power points.
    """
    if not 0 < false_alarm < 1:
        raise EstimateError(f"false_alarm is {false_alarm}; it must lie between 0 and 1")
    found = driving_points(response.responses, response.references) if functions is None else tuple(functions)
    if not found:
        return DrivingPointCheck(points=(), finding=_no_driving_point(response))
    # The power that goes in is told of motions; a response whose unit nobody knows still has its frequencies.
    chosen = found if functions is not None else _of_motions(response, found)
    if not chosen:
        bare = response.responses[found[0][0]]
        finding = f"the driving point {bare.name} isn't judged: it is {in_unit(bare.unit)}, which is no motion"
        return DrivingPointCheck(points=(), finding=finding)
    points = tuple(_judged(_one_function(response, row, column), sign, false_alarm) for row, column, sign in chosen)
    worst = min(points, key=lambda point: _GRAVITY.index(point.verdict))
    return DrivingPointCheck(points=points, finding=worst.finding)


def _of_motions(
    response: FrequencyResponse, functions: Sequence[tuple[int, int, int]]
) -> tuple[tuple[int, int, int], ...]:
    return tuple(one for one in functions if response.responses[one[0]].unit in MOTION_ORDER)


_GRAVITY: tuple[DrivingPointVerdict, ...] = ("reversed", "not a driving point", "phase error", "undecided", "sound")


def _no_driving_point(response: FrequencyResponse) -> str:
    bare = [c.name for c in (*response.responses, *response.references) if c.point is None or c.direction is None]
    if bare:
        return (
            f"no driving point is known: {', '.join(bare[:3])}{' ...' if len(bare) > 3 else ''} without point or "
            "direction in the setup file"
        )
    return "no response is measured at the point and along the direction of a reference: shapes stay unscaled"


def _one_function(response: FrequencyResponse, row: int, column: int) -> FrequencyResponse:
    if not (0 <= row < len(response.responses) and 0 <= column < len(response.references)):
        raise EstimateError(
            f"no function ({row}, {column}) among {len(response.responses)} responses x "
            f"{len(response.references)} references"
        )
    # Each further reference spent one average on every function.
    known = response.provenance.effective_averages
    averages = max(known - (len(response.references) - 1), 1.0) if known else 0.0
    return replace(
        response,
        values=response.values[row : row + 1, column : column + 1],
        std=response.std[row : row + 1, column : column + 1],
        coherence=response.coherence[row : row + 1],
        responses=response.responses[row : row + 1],
        references=response.references[column : column + 1],
        provenance=replace(response.provenance, effective_averages=averages),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Mobility:
    """Mobility of one driving point on its usable lines, and how many sigma make a sign sure."""

    frequency_hz: Real
    values: Complex
    std: Real
    sure: float
    peaks: Whole


def _judged(function: FrequencyResponse, sign: int, false_alarm: float) -> DrivingPoint:
    mobility = _mobility(function, sign, false_alarm)
    wrong = _gives_out_power(mobility)
    sigmas = mobility.values.real[mobility.peaks] / mobility.std[mobility.peaks]
    right_peaks = int(np.count_nonzero(sigmas > mobility.sure))
    wrong_peaks = int(np.count_nonzero(sigmas < -mobility.sure))
    pairs, missing = _antiresonances(mobility)
    wrong_hz = mobility.frequency_hz[wrong]
    verdict = _verdict(right_peaks, wrong_peaks, int(wrong_hz.size))
    point = DrivingPoint(
        response=function.responses[0].name,
        reference=function.references[0].name,
        sign=sign,
        lines=mobility.frequency_hz.size,
        wrong_lines=int(wrong_hz.size),
        wrong_hz=(float(wrong_hz[0]), float(wrong_hz[-1])) if wrong_hz.size else None,
        peaks=right_peaks + wrong_peaks,
        wrong_peaks=wrong_peaks,
        pairs=pairs,
        missing_hz=missing,
        verdict=verdict,
        finding="",
    )
    return replace(point, finding=_sentence(point))


def _mobility(function: FrequencyResponse, sign: int, false_alarm: float) -> _Mobility:
    mobility = convert_form(function, "mobility")
    values = mobility.values[0, 0]
    usable = mobility.excited & np.isfinite(values) & (mobility.frequency_hz > 0)
    std = std_or_scatter(values[usable], mobility.std[0, 0, usable])
    usable[usable] = np.isfinite(std)
    frequency_hz = mobility.frequency_hz[usable]
    # A function without any scatter, from a model, is as sure as its rounding.
    std = np.maximum(std[np.isfinite(std)], 1e-12 * np.abs(values[usable]).max(initial=0.0))
    # Without error bars of its own a function has peaks, and no line whose sign is sure.
    found = find_response_peaks(function, count=PEAKS_JUDGED) if frequency_hz.size else ()
    peaks = sorted({int(np.argmin(np.abs(frequency_hz - peak.frequency_hz))) for peak in found})
    averages = function.provenance.effective_averages
    freedom = max(2 * (averages - 1), 1.0) if averages else LARGE_FREEDOM
    # The chance is shared by all lines, of which the peaks are some.
    sure = -float(scipy.special.stdtrit(freedom, false_alarm / max(frequency_hz.size, 1)))
    return _Mobility(
        frequency_hz=frequency_hz,
        values=np.asarray(sign * values[usable], dtype=np.complex128),
        std=std,
        sure=sure,
        peaks=np.array(peaks, dtype=np.int64),
    )


def _gives_out_power(mobility: _Mobility) -> Mask:
    """Lines whose phase is surely farther from zero than 90 degrees and what is allowed."""
    allowed = np.radians(PHASE_ALLOWED_DEG)
    inside = mobility.values.real * np.cos(allowed) + np.abs(mobility.values.imag) * np.sin(allowed)
    return np.asarray(inside < -mobility.sure * mobility.std)


def _antiresonances(mobility: _Mobility) -> tuple[int, tuple[tuple[float, float], ...]]:
    """Count the pairs of resonances that ask for an antiresonance, and name those without."""
    magnitude, peaks = np.abs(mobility.values), mobility.peaks
    widths = np.array([half_power_lines(magnitude, int(peak)) for peak in peaks])
    heights = magnitude[peaks]
    pairs, missing = 0, []
    for first in range(len(peaks) - 1):
        low, high = int(peaks[first]), int(peaks[first + 1])
        # h/2 at a mode's own half-power point against h' b'/(2 delta) of its neighbour's flank, twice for safety.
        flanks = 2 * heights[first : first + 2] * widths[first : first + 2] / (high - low)
        if high - low < 2 or not flanks[0] < heights[first + 1] or not flanks[1] < heights[first]:
            continue
        # A resonance narrower than a line may lie on either side of its own highest line.
        between = slice(low + 1, high)
        reactive = mobility.values.imag[between] / mobility.std[between]
        lowest, highest = int(np.argmin(reactive)), int(np.argmax(reactive))
        if reactive[lowest] > -mobility.sure and reactive[highest] < mobility.sure:
            continue
        pairs += 1
        if not (reactive[lowest] < 0 < reactive[highest] and lowest < highest):
            missing.append((float(mobility.frequency_hz[low]), float(mobility.frequency_hz[high])))
    return pairs, tuple(missing)


def _verdict(right_peaks: int, wrong_peaks: int, wrong_lines: int) -> DrivingPointVerdict:
    if wrong_peaks:
        return "not a driving point" if right_peaks else "reversed"
    if wrong_lines:
        return "phase error"
    return "sound" if right_peaks else "undecided"


def _sentence(point: DrivingPoint) -> str:
    who = f"driving point {point.response} / {point.reference}"
    if point.verdict == "reversed":
        return (
            f"{who}: all {counted(point.peaks, 'resonance')} give power out (Re of the mobility is negative): sensor "
            "or force is reversed; turn the sign of one direction in the setup file"
        )
    if point.verdict == "not a driving point":
        return (
            f"{who}: {point.wrong_peaks} of {counted(point.peaks, 'resonance')} give power out, the others take it "
            "in: the sensor isn't where and along which the force acts; don't scale shapes by it"
        )
    if point.verdict == "phase error":
        low, high = point.wrong_hz or (np.nan, np.nan)
        return (
            f"{who}: the resonances take power in, but {point.wrong_lines} of {counted(point.lines, 'line')} between "
            f"{low:.4g} and {high:.4g} Hz give it out by more than {PHASE_ALLOWED_DEG:g} degrees: a delay or filter "
            "between the channels, or a sensor beside the point"
        )
    if point.verdict == "undecided":
        return f"{who}: no resonance stands out of the noise, so its sign can't be told; take more averages"
    gaps = "".join(f"; none is seen between {low:.4g} and {high:.4g} Hz" for low, high in point.missing_hz[:1])
    return (
        f"{who}: sound; {counted(point.peaks, 'resonance')} and all {counted(point.lines, 'line')} take power in, "
        f"{point.pairs - len(point.missing_hz)} of {counted(point.pairs, 'pair')} of resonances have their "
        f"antiresonance{gaps}"
    )

"""Signs that a frequency response is biased, in words."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.signals.frequency_response import FrequencyResponse

# H2/H1 = 1/coherence: 5 % apart in the median is more than a calibration's uncertainty.
SPREAD_WORTH_A_WORD = 0.05
HARDLY_COHERENT = 0.3
# Four lines in the half-power bandwidth keep the bias of a peak near 2 % (Bendat & Piersol 2010, section 8.5.1).
LINES_PER_PEAK = 4.0
# Peaks are judged where the estimate is sure enough for a width to mean something.
TRUSTED_COHERENCE = 0.5
PROMINENCE = 3.0


def response_notes(response: FrequencyResponse) -> FrequencyResponse:
    """Add the notes on H1/H2 spread, resolution and number of averages to a response."""
    notes = [*_spread_note(response), *_resolution_notes(response), *_averages_note(response)]
    return replace(response, provenance=response.provenance.with_notes(*notes))


def half_power_lines(magnitude: NDArray[np.float64], peak: int) -> float:
    """Give the width of a peak at 1/sqrt(2) of its height in lines, interpolated; infinite when it has no foot.

    Examples
    --------
    >>> round(half_power_lines(np.array([0.0, 0.5, 1.0, 0.5, 0.0]), 2), 3)
    1.172
    """
    level = magnitude[peak] / np.sqrt(2)
    left = _crossing(magnitude[peak::-1], level)
    return left + _crossing(magnitude[peak:], level)


def _crossing(falling: NDArray[np.float64], level: float) -> float:
    # Written so that NaN, a line that isn't trusted, ends the peak as well.
    below = np.flatnonzero(~(falling > level))
    if below.size == 0 or not np.isfinite(falling[below[0]]):
        return float("inf")
    after = int(below[0])
    return after - 1 + float((falling[after - 1] - level) / (falling[after - 1] - falling[after]))


def _spread_note(response: FrequencyResponse) -> list[str]:
    if len(response.references) != 1 or not response.excited.any():
        return []
    notes = []
    for channel, coherence in zip(response.responses, response.coherence, strict=True):
        median = float(np.median(coherence[response.excited]))
        if median < HARDLY_COHERENT:
            notes.append(
                f"{channel.name}: coherence is {median:.2g} in the median; the reference explains little of it"
            )
        elif 1 / median - 1 > SPREAD_WORTH_A_WORD:
            notes.append(
                f"{channel.name}: H2 lies above H1 by {1 / median - 1:.0%} (median of the excited lines); noise, "
                "leakage, a second source or nonlinearity biases one of them or both"
            )
    return notes


def _resolution_notes(response: FrequencyResponse) -> list[str]:
    # Whole periods don't leak: their lines are exact, however few.
    if response.provenance.averaging == "periodic":
        return []
    spacing = float(response.frequency_hz[1] - response.frequency_hz[0])
    notes = []
    for row, channel in enumerate(response.responses):
        narrowest = _narrowest_peak(response, row)
        if narrowest is None:
            continue
        peak, width = narrowest
        notes.append(
            f"{channel.name}: the peak at {response.frequency_hz[peak]:.4g} Hz is {width:.1f} lines wide at half "
            f"power and reads low by about {1 / (3 * width**2):.0%} or more; ask for "
            f"{width * spacing / LINES_PER_PEAK:.2g} Hz or finer"
        )
    return notes


def _narrowest_peak(response: FrequencyResponse, row: int) -> tuple[int, float] | None:
    found: list[tuple[float, int]] = []
    # Peaks of noise are narrow too.
    trusted = response.excited & (response.coherence[row] > TRUSTED_COHERENCE)
    for column in range(len(response.references)):
        magnitude = np.where(trusted, np.abs(response.values[row, column]), np.nan)
        if not np.isfinite(magnitude).any():
            continue
        prominent = magnitude > PROMINENCE * np.nanmedian(magnitude)
        inner = (magnitude[1:-1] > magnitude[:-2]) & (magnitude[1:-1] >= magnitude[2:]) & prominent[1:-1]
        found += [(half_power_lines(magnitude, int(peak)), int(peak)) for peak in np.flatnonzero(inner) + 1]
    narrow = [entry for entry in found if entry[0] < LINES_PER_PEAK]
    if not narrow:
        return None
    width, peak = min(narrow)
    return peak, width


def _averages_note(response: FrequencyResponse) -> list[str]:
    averages = response.provenance.effective_averages
    if averages > len(response.references):
        return []
    note = (
        f"{averages:.3g} effective averages can't part {len(response.references)} references from noise, and "
        "coherence is 1 whatever the data; ask for a coarser resolution or a longer record"
    )
    return [note]

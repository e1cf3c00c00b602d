"""Signs that a frequency response is biased, in words."""

from dataclasses import replace

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.wording import counted, rounded_up

# H2/H1 = 1/coherence: 5 % apart in the median is more than a calibration's uncertainty.
SPREAD_WORTH_A_WORD = 0.05
HARDLY_COHERENT = 0.3
# Four lines in the half-power bandwidth keep the bias of a peak near 2 % (Bendat & Piersol 2010, section 8.5.1).
LINES_PER_PEAK = 4.0
# Segments end to end, below which averages tell little from chance.
FEWEST_SEGMENTS = 4
# A longer segment is worth asking for from here.
MUCH_LONGER = 1.05
# Peaks are judged where the estimate is sure enough for a width to mean something.
TRUSTED_COHERENCE = 0.5
PROMINENCE = 3.0


def response_notes(response: FrequencyResponse) -> FrequencyResponse:
    """Add the notes on H1/H2 spread, resolution and number of averages to a response."""
    notes = [*_spread_note(response), *_resolution_notes(response), *_averages_note(response)]
    return replace(response, provenance=response.provenance.with_notes(*notes))


def longest_segment_s(account: Provenance, *, segments: float = FEWEST_SEGMENTS) -> float:
    """Longest segment of which so many fit end to end into what was averaged, or the longest record between hits.

    0 where that isn't known: functions of a file, whole periods.
    """
    if account.averaging == "impact":
        return account.longest_s
    if account.averaging == "periodic" or not account.averages:
        return 0.0
    whole_s = account.segment_s * (1 + (account.averages - 1) * (1 - account.overlap))
    return min(whole_s / segments, account.longest_s or whole_s)


def closer_lines(account: Provenance, *, step_hz: float, wanted_hz: float, longest_s: float | None = None) -> str:
    """Say how to get lines so close: by an option as far as the record allows, beyond by what to measure.

    Parameters
    ----------
    account
        Of the estimate.
    step_hz, wanted_hz
        Distance of its lines, and the one that is wanted.
    longest_s
        Longest segment that may be asked for; None for `longest_segment_s`.
    """
    times = _times(step_hz / wanted_hz)
    if account.averaging == "periodic":
        return f"a period {times} as long helps"
    longest_s = longest_segment_s(account) if longest_s is None else longest_s
    if not longest_s:
        return f"lines {rounded_up(wanted_hz, digits=2)} Hz apart help, from records {times} as long"
    if longest_s * wanted_hz >= 1:
        return f"ask for a resolution of {rounded_up(wanted_hz, digits=2)} Hz"
    if account.averaging == "impact":
        further = f"records of {1 / wanted_hz:.2g} s help: hit at longer intervals"
    else:
        further = f"a record {_times(1 / (longest_s * wanted_hz))} as long helps"
    if longest_s < MUCH_LONGER * account.segment_s:
        return further
    return f"ask for a resolution of {rounded_up(1 / longest_s)} Hz; {further} further"


def _times(factor: float) -> str:
    return f"{factor:.0f} times" if factor >= 10 else f"{factor:.2g} times"


def half_power_lines(magnitude: Real, peak: int) -> float:
    """Give the width of a peak at 1/sqrt(2) of its height in lines, interpolated; infinite when it has no foot.

    Examples
    --------
    >>> round(half_power_lines(np.array([0.0, 0.5, 1.0, 0.5, 0.0]), 2), 3)
    1.172
    """
    level = magnitude[peak] / np.sqrt(2)
    left = _crossing(magnitude[peak::-1], level)
    return left + _crossing(magnitude[peak:], level)


def _crossing(falling: Real, level: float) -> float:
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
    account = response.provenance
    # Whole periods don't leak: their lines are exact, however few.
    if account.averaging == "periodic":
        return []
    spacing = float(response.frequency_hz[1] - response.frequency_hz[0])
    notes = []
    for row, channel in enumerate(response.responses):
        narrowest = _narrowest_peak(response, row)
        if narrowest is None:
            continue
        peak, width = narrowest
        closer = closer_lines(account, step_hz=spacing, wanted_hz=width * spacing / LINES_PER_PEAK)
        notes.append(
            f"{channel.name}: the peak at {response.frequency_hz[peak]:.4g} Hz is {width:.1f} lines wide at half "
            f"power and {_reads_low(account, width)}; {closer}"
        )
    return notes


def _reads_low(account: Provenance, width: float) -> str:
    """By how much: a window averages over the peak; of a transient that has died away the lines are exact."""
    if account.averaging == "impact":
        # |H| of a resonance half a line off its top.
        return f"reads low by up to {1 - 1 / np.hypot(1, 1 / width):.0%} between the lines"
    return f"reads low by about {1 / (3 * width**2):.0%} or more"


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
    hits = response.provenance.averaging == "impact"
    note = (
        f"{averages:.3g} effective averages can't part {counted(len(response.references), 'reference')} from noise, "
        "and coherence is 1 whatever the data; "
        f"{'take more hits' if hits else 'ask for a coarser resolution, or measure longer'}"
    )
    return [note]

"""Pulses of a hammer's force: where they are, how wide, and whether they are cut off."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries

# Nobody swings a hammer twice within 0.15 s: a second pulse that soon is a rebound of the same hit.
REBOUND_S = 0.15
# A pulse of a hammer lasts from 0.1 ms (steel tip) to some 10 ms (sledge with a soft tip).
LONGEST_PULSE_S = 0.03
# The trigger as a share of the typical peak: low enough for most weak hits to be named as such.
TRIGGER_SHARE = 0.1
# White noise of a million samples stays within 5 sigma of its mean: a rise of 10 sigma from a valley is a signal.
NOISE_SIGMAS = 10.0
# A rounded crest rises above its highest samples by far less than this share of the peak; a clipped one lost more.
CLIPPED_SHARE = 0.03


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pulses:
    """The pulses of one channel.

    Attributes
    ----------
    force
        ``[sample]``, freed of its offset and turned so that pulses point upwards; 0 where nothing was measured.
    unit
        Unit of the force.
    sign
        1.0, or -1.0 when the pulses pointed downwards.
    noise
        Standard deviation of the silence between pulses, from the median deviation.
    level
        Trigger level, positive.
    starts, peaks, widths
        One entry a hit: first sample above the level, highest sample, samples above half the peak around it.
    ignored
        Bumps above the noise that stay below the level.
    """

    force: Real
    unit: str
    sign: float
    noise: float
    level: float
    starts: Whole
    peaks: Whole
    widths: Whole
    ignored: int


def find_pulses(series: TimeSeries, channel: str, *, level: float | None) -> Pulses:
    """Find groups of pulses above `level` (a magnitude; default a tenth of the typical peak).

    Raises
    ------
    EstimateError
        When there is no such channel, or it has no valid sample.
    """
    row = series.index(channel)
    measured = series.values[row].astype(np.float64)
    usable = np.isfinite(measured) if series.valid is None else series.valid[row] & np.isfinite(measured)
    if not usable.any():
        raise EstimateError(f"{channel!r} has no valid sample")
    # A hammer rests most of the time: median and median deviation are those of the silence.
    offset = float(np.median(measured[usable]))
    deviation = np.where(usable, measured - offset, 0.0)
    sign = 1.0 if deviation.max() >= -deviation.min() else -1.0
    force = sign * deviation
    noise = 1.4826 * float(np.median(np.abs(deviation[usable])))
    floor = max(NOISE_SIGMAS * noise, 1e-6 * float(force.max()))
    starts, peaks = _groups(force, floor, round(REBOUND_S * series.sample_rate_hz))
    threshold = TRIGGER_SHARE * typical_peak(force, peaks) if level is None else abs(level)
    threshold = max(threshold, floor) if level is None else threshold
    bumps = starts.size
    starts, peaks = _groups(force, threshold, round(REBOUND_S * series.sample_rate_hz))
    return Pulses(
        force=force,
        unit=series.channels[row].unit,
        sign=sign,
        noise=noise,
        level=threshold,
        starts=starts,
        peaks=peaks,
        widths=np.array([_width(force, peak) for peak in peaks], dtype=np.int64),
        ignored=max(0, bumps - starts.size),
    )


def _groups(force: Real, threshold: float, apart: int) -> tuple[Whole, Whole]:
    """First sample above the threshold, and highest sample, of each group of samples less than `apart` apart."""
    above = np.flatnonzero(force > threshold)
    if not above.size:
        return above, above
    breaks = np.flatnonzero(np.diff(above) > apart) + 1
    groups = np.split(above, breaks)
    starts = np.array([group[0] for group in groups])
    peaks = np.array([group[np.argmax(force[group])] for group in groups])
    return starts, peaks


def typical_peak(force: Real, peaks: Whole) -> float:
    """Typical peak: median of the stronger half, so that neither bumps below nor one overload above shift it."""
    if not peaks.size:
        return 0.0
    whole = [peak for peak in peaks if not is_clipped(force, int(peak))]
    heights = np.sort(force[whole or peaks])
    return float(np.median(heights[heights.size // 2 :]))


def _width(force: Real, peak: int) -> int:
    """Samples around the peak that stay above half of it."""
    half = force[peak] / 2
    below = np.flatnonzero(force[peak:] < half)
    after = int(below[0]) if below.size else force.size - peak
    reversed_below = np.flatnonzero(force[peak::-1] < half)
    before = int(reversed_below[0]) if reversed_below.size else peak + 1
    return after + before - 1


def is_clipped(x: Real, peak: int) -> bool:
    """Whether the crest is cut flat: three samples or more at one height while both flanks point well above it."""
    height = x[peak]
    below = np.flatnonzero(np.abs(x - height) > 1e-9 * abs(height))
    cut = int(np.searchsorted(below, peak))
    first = int(below[cut - 1]) + 1 if cut else 0
    last = int(below[cut]) - 1 if cut < below.size else x.size - 1
    count = last - first + 1
    if count < 3 or first < count or last + count >= x.size:
        return False
    # Slopes are taken over as many samples as are flat: a single step of a coarse converter says nothing.
    rise, fall = x[first] - x[first - count], x[last] - x[last + count]
    # A parabola that enters and leaves the flat part with these slopes would rise by this much above it.
    return bool(min(rise, fall) / 4 > CLIPPED_SHARE * height)

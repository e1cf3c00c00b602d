"""Joining of series on one grid. What is set and then kept, such as a command, is held between its samples."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.signals.errors import EstimateError
from chladni.signals.resample import Kernel, Resampled, resample, shift_ns
from chladni.signals.time_series import NS_PER_S, TimeSeries

JoinMethod = Literal["auto", "hold", "band-limited"]


def join(
    series: Sequence[TimeSeries],
    *,
    sample_rate_hz: float | None = None,
    start_time_ns: int | None = None,
    samples: int | None = None,
    method: JoinMethod = "auto",
) -> TimeSeries:
    """Bring series of different rates and offsets to one grid; see `join_resampled` for the error of that."""
    return join_resampled(
        series, sample_rate_hz=sample_rate_hz, start_time_ns=start_time_ns, samples=samples, method=method
    ).series


def join_resampled(
    series: Sequence[TimeSeries],
    *,
    sample_rate_hz: float | None = None,
    start_time_ns: int | None = None,
    samples: int | None = None,
    method: JoinMethod = "auto",
) -> Resampled:
    """Bring series of different rates and offsets to one grid, over the time that all of them have.

    A held channel keeps each value until its next sample (zero-order hold; Astrom & Wittenmark, Computer-Controlled
    Systems, 3rd ed., section 7.2), all others are taken as band-limited.

    Parameters
    ----------
    series
        At least one; channel names unique over all of them.
    sample_rate_hz
        Rate of the grid; by default the lowest of the band-limited ones, whose samples are then copied and not
        computed, or the highest where all are held.
    start_time_ns, samples
        Begin and length of the grid; by default what all series cover, kernels included.
    method
        ``hold`` or ``band-limited`` for all channels; ``auto`` holds those that are commands by their message type
        (`Channel.held`) or whose samples are staircases, see `is_staircase`.

    Returns
    -------
    Resampled
        ``held`` names the channels that were held, each with the reason. The error is that of the others.

    Raises
    ------
    EstimateError
        When there is no series, or no time that all of them cover.
    """
    if not series:
        raise EstimateError("there is no series to join")
    parts = [part for one in series for part in _by_method(one, method)]
    smooth = [part.series for part in parts if not part.held]
    slowest = min(smooth or [part.series for part in parts], key=lambda one: one.sample_rate_hz)
    if not smooth:
        slowest = max((part.series for part in parts), key=lambda one: one.sample_rate_hz)
    rate_hz = slowest.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
    if not (isfinite(rate_hz) and rate_hz > 0):
        raise EstimateError(f"sample rate {rate_hz} Hz must be finite and positive")
    start_ns, count = _common_grid(parts, slowest, rate_hz)
    start_ns = start_ns if start_time_ns is None else start_time_ns
    count = count if samples is None else samples
    placed = [_placed(part, rate_hz, start_ns, count) for part in parts]
    rows = [channel.name for one in series for channel in one.channels]
    return _side_by_side(placed, rows, dict(reason for part in parts for reason in part.held))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Part:
    """Channels of one series that are brought to the grid in one way; `held` has a reason for each, or nothing."""

    series: TimeSeries
    held: tuple[tuple[str, str], ...] = ()


def _by_method(series: TimeSeries, method: JoinMethod) -> list[_Part]:
    """Split a series into its held channels and all others."""
    reasons = {channel.name: _why_held(series, row, method) for row, channel in enumerate(series.channels)}
    held = [(name, why) for name, why in reasons.items() if why]
    smooth = [name for name, why in reasons.items() if not why]
    if not held or not smooth:
        return [_Part(series=series, held=tuple(held))]
    names = [name for name, _ in held]
    return [_Part(series=series.select(smooth)), _Part(series=series.select(names), held=tuple(held))]


def _why_held(series: TimeSeries, row: int, method: JoinMethod) -> str:
    if method != "auto":
        return "as asked for" if method == "hold" else ""
    if series.channels[row].held:
        return "its message type is a command"
    known = series.values[row] if series.valid is None else series.values[row][series.valid[row]]
    return "its samples are a staircase" if is_staircase(known) else ""


def join_note(sources: Sequence[TimeSeries], found: Resampled) -> str:
    """Say to which rate series were brought, which channels were held and why, and how true the others are."""
    sentences = []
    held = dict(found.held)
    rate_hz = found.series.sample_rate_hz
    if len(held) < len(found.series.channels):
        sentences.append(
            f"brought to {rate_hz:.6g} Hz by band-limited resampling: true to {found.error:.1g} of the amplitude up "
            f"to {found.usable_hz:.4g} Hz, falling off above"
        )
    for reason in dict.fromkeys(held.values()):
        names = [name for name, why in held.items() if why == reason]
        listed = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
        sentences.append(f"{listed}: held between samples at {rate_hz:.6g} Hz ({reason})")
    pairs = [(one, row) for one in sources for row in range(len(one.channels))]
    lost_s = max(_valid_s(one, row) - _valid_s(found.series, place) for place, (one, row) in enumerate(pairs))
    if lost_s * rate_hz > 1:
        sentences.append(
            f"up to {lost_s:.3g} s of a channel are left out: at its ends, at gaps, and where others have none"
        )
    return "; ".join(sentences)


def _valid_s(series: TimeSeries, row: int) -> float:
    count = series.samples if series.valid is None else int(np.count_nonzero(series.valid[row]))
    return count / series.sample_rate_hz


def is_staircase(values: NDArray[np.floating]) -> bool:
    """Whether samples stand still and then leap, as what is set now and then does, and no motion.

    Most samples must repeat the one before. A slow signal in coarse digits does so too, but steps from each level to
    the next: a staircase leaps over levels that it shows at other times, or has two levels only.

    Parameters
    ----------
    values
        ``[sample]``; missing ones left out.

    Examples
    --------
    >>> is_staircase(np.repeat([0.0, 3.0, 1.0, 7.0], 5))
    True
    >>> is_staircase(np.round(20 * np.sin(np.arange(2000) / 300)))
    False
    """
    finite = values[np.isfinite(values)]
    leaps = int(np.count_nonzero(np.diff(finite)))
    if not leaps or 2 * leaps > finite.size - 1:
        return False
    levels, level = np.unique(finite, return_inverse=True)
    jumped = np.abs(np.diff(level))
    return levels.size == 2 or 2 * int(np.count_nonzero(jumped > 1)) > leaps


def _placed(part: _Part, rate_hz: float, start_ns: int, count: int) -> Resampled:
    if part.held:
        return _held(part.series, rate_hz, start_ns, count)
    return resample(part.series, sample_rate_hz=rate_hz, start_time_ns=start_ns, samples=count)


def _held(series: TimeSeries, rate_hz: float, start_ns: int, count: int) -> Resampled:
    """Give at each new time the last sample at or before it."""
    ratio = series.sample_rate_hz / rate_hz
    first = (start_ns - series.start_time_ns) * series.sample_rate_hz / NS_PER_S
    # A nanosecond early is the rounding of times.
    early = 1.5 * series.sample_rate_hz / NS_PER_S
    source = np.floor(first + ratio * np.arange(count) + early).astype(np.int64)
    there = (source >= 0) & (source < series.samples)
    taken = np.where(there, source, 0)
    valid = there & (np.isfinite(series.values[:, taken]) if series.valid is None else series.valid[:, taken])
    values = np.where(valid, series.values[:, taken], np.nan).astype(series.values.dtype, copy=False)
    return Resampled(
        series=TimeSeries(
            values=values,
            sample_rate_hz=rate_hz,
            start_time_ns=start_ns,
            channels=series.channels,
            valid=None if valid.all() else valid,
        ),
        usable_hz=inf,
        error=0.0,
        attenuation_db=inf,
    )


def _side_by_side(placed: Sequence[Resampled], rows: Sequence[str], held: Mapping[str, str]) -> Resampled:
    """Put parts on one grid into one series, its rows in the order of the names."""
    first = placed[0].series
    masks = [part.series.valid for part in placed]
    whole = [np.ones(part.series.values.shape, dtype=bool) for part in placed]
    valid = np.concatenate([full if mask is None else mask for mask, full in zip(masks, whole, strict=True)])
    together = TimeSeries(
        values=np.concatenate([part.series.values for part in placed]),
        sample_rate_hz=first.sample_rate_hz,
        start_time_ns=first.start_time_ns,
        channels=tuple(channel for part in placed for channel in part.series.channels),
        valid=None if valid.all() else valid,
    )
    return Resampled(
        series=together.select(list(rows)),
        usable_hz=min(min(part.usable_hz for part in placed), first.sample_rate_hz / 2),
        error=max(part.error for part in placed),
        attenuation_db=min(part.attenuation_db for part in placed),
        held=held,
    )


def _common_grid(parts: Sequence[_Part], slowest: TimeSeries, rate_hz: float) -> tuple[int, int]:
    """Start and length of the grid that lies inside all series, kernels included."""
    same_grid = rate_hz == slowest.sample_rate_hz
    # Relative to the slowest, because nanoseconds since 1970 don't fit a floating point number.
    lows, highs = [], []
    for part in parts:
        one = part.series
        # The last value is held for a sample's length, short of the next.
        low, high = 0.0, one.samples - (1e-6 if part.held else 1.0)
        copied = same_grid and rate_hz == one.sample_rate_hz and shift_ns(one, slowest.start_time_ns) <= 1
        if not part.held and not copied:
            low, high = Kernel.between(one.sample_rate_hz, rate_hz).supported(one.samples)
        begin_ns = one.start_time_ns - slowest.start_time_ns
        lows.append(begin_ns + low * NS_PER_S / one.sample_rate_hz)
        highs.append(begin_ns + high * NS_PER_S / one.sample_rate_hz)
    start_ns = ceil(max(lows))
    if same_grid:
        # On a grid point of the slowest series, so that its samples stay as they are.
        number = ceil(start_ns * rate_hz / NS_PER_S - 1e-6)
        start_ns = round(number / rate_hz * NS_PER_S)
    count = int(np.floor((min(highs) - start_ns) * rate_hz / NS_PER_S + 1e-6)) + 1
    if count < 1:
        spans = "; ".join(
            f"{one.channels[0].name if one.channels else 'none'} from {one.start_time_ns} ns for {one.duration_s:g} s"
            for one in (part.series for part in parts)
        )
        raise EstimateError(f"the series share no time long enough to join them: {spans}")
    return slowest.start_time_ns + start_ns, count

"""Preparation of numbers for drawing: decibels, envelopes, breaks in lines, ticks. Nothing here is an estimate."""

from collections.abc import Sequence
from math import ceil, floor, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Index, Mask, Real

# Share of all cells of a waterfall below the lowest colour and below the highest.
COLOURED_PERCENT = (5.0, 99.8)
LEAKING_LINES = 3


def decibels_of_power(power: NDArray[np.floating]) -> Real:
    """Give 10 lg(power); NaN, which is drawn as a gap, where the power is not positive."""
    # Not minus infinity: one such point would stretch every automatic axis.
    positive = np.where(power > 0, power, np.nan)
    return np.asarray(10 * np.log10(positive), dtype=np.float64)


def decibels_of_amplitude(amplitude: NDArray[np.floating]) -> Real:
    """Give 20 lg(amplitude); NaN, which is drawn as a gap, where the amplitude is not positive."""
    return 2 * decibels_of_power(amplitude)


def thin(values: Real, *, limit: int) -> tuple[Index, int]:
    """Choose the samples that a plot of at most about `limit` points needs: the extremes of each stretch.

    Parameters
    ----------
    values
        ``[sample]``; NaN where nothing was measured. A stretch that holds a NaN keeps one, so that a gap stays
        visible.
    limit
        Most points that may be drawn, at least 3.

    Returns
    -------
    indices : ndarray
        Rising places of the samples to draw; all of them when there are no more than `limit`.
    stretch : int
        Samples that each pair of extremes stands for; 1 when every sample is drawn.
    """
    if values.size <= limit:
        return np.arange(values.size), 1
    # Three a stretch at most: the least, the greatest, and a NaN where there is one.
    stretch = ceil(3 * values.size / limit)
    whole = values[: values.size // stretch * stretch].reshape(-1, stretch)
    starts = np.arange(whole.shape[0]) * stretch
    # argmin would return the NaN itself, and the extreme beside it would be lost.
    missing = np.isnan(whole)
    chosen = [
        starts + np.argmin(np.where(missing, np.inf, whole), axis=1),
        starts + np.argmax(np.where(missing, -np.inf, whole), axis=1),
        (starts + np.argmax(missing, axis=1))[missing.any(axis=1)],
        # The rest that fills no whole stretch is shorter than one: all of it is drawn.
        np.arange(whole.size, values.size),
    ]
    # In the order of time; a constant stretch has its extremes in one sample.
    return np.unique(np.concatenate(chosen)), stretch


def without_repeated_gaps(values: Real) -> Mask:
    """Mark the samples to draw: all that were measured, and the first NaN of each gap, which breaks the line."""
    missing = np.isnan(values)
    repeated = missing & np.concatenate(([False], missing[:-1]))
    return ~repeated


def block_maximum(values: NDArray[Any], *, axis: int, limit: int) -> tuple[NDArray[Any], int]:
    """Shorten one axis to at most `limit` by the largest value of each run of neighbours, so that peaks stay.

    Returns
    -------
    shortened : ndarray
        `values` itself when it fits.
    run : int
        Neighbours that each value stands for. A run that holds only NaN gives NaN.
    """
    length = values.shape[axis]
    run = max(1, ceil(length / limit))
    if run == 1:
        return values, 1
    starts = np.arange(0, length, run)
    # fmax, not max: one missing slice must not blank those beside it.
    return np.fmax.reduceat(values, starts, axis=axis), run


def level_limits(level_db: Real) -> tuple[float, float]:
    """Choose the decibels that a plot shows at first: the upper 100 dB, and never a span of less than 20 dB.

    A line of zero frequency that was detrended to nothing would otherwise flatten everything else.
    """
    known = level_db[np.isfinite(level_db)]
    if known.size == 0:
        return -100.0, 0.0
    low, high = max(float(known.min()), float(known.max()) - 100), float(known.max())
    room = max(0.05 * (high - low), (20 - (high - low)) / 2)
    return low - room, high + room


def colour_range(levels: Sequence[Real], *, most_db: float) -> tuple[float, float]:
    """Choose the decibels that colours run over, one scale for all: what most of the cells hold.

    A few cells outside have the colour of the end: the lines beside 0 Hz, where a trend leaks, would take all colours
    for themselves otherwise.

    Parameters
    ----------
    levels
        ``[slice, line]`` each, in dB; NaN where nothing is known.
    most_db
        Longest range, below its upper end.
    """
    # The line at 0 Hz and the two beside it hold what a window leaks of the mean and of a trend.
    judged = [level[:, LEAKING_LINES:] if level.shape[1] > 2 * LEAKING_LINES else level for level in levels]
    known = np.concatenate([level[np.isfinite(level)] for level in judged])
    if known.size == 0:
        return -most_db, 0.0
    low, high = (float(end) for end in np.percentile(known, COLOURED_PERCENT))
    # Of silence with one tone nearly every cell is the same.
    high = max(high, float(known.max()) - most_db / 2)
    return max(low, high - most_db), high


def line_breaks(frequency_hz: Real) -> Index:
    """Find where a line through chosen frequencies must break: after lines followed by an unusual step.

    A comb with every second line excited has an even step and is joined; a band left out is not bridged.
    """
    # Two lines have one step, and nothing to call it unusual by.
    if frequency_hz.size < 3:
        return np.empty(0, dtype=np.intp)
    steps = np.diff(frequency_hz)
    return np.flatnonzero(steps > 1.5 * np.median(steps)) + 1


def phase_wraps(phase_deg: Real) -> Index:
    """Find where a phase between -180 and 180 degrees jumps round, so that no line is drawn down the plot."""
    return np.flatnonzero(np.abs(np.diff(phase_deg)) > 180) + 1


def with_breaks(x: Real, y: Real, breaks: Index) -> tuple[Real, Real]:
    """Insert a NaN before each index in `breaks`, half-way on the x axis.

    Parameters
    ----------
    x
        ``[point]``.
    y
        ``[point]`` or ``[point, line]``.
    breaks
        Indices from 1 to ``x.size - 1``, rising.
    """
    if breaks.size == 0:
        return x, y
    middles = (x[breaks - 1] + x[breaks]) / 2
    return np.insert(x, breaks, middles), np.insert(y, breaks, np.nan, axis=0)


def ticks(low: float, high: float, *, count: int = 5) -> Real:
    """Give round numbers between `low` and `high`, about `count` of them: steps of 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> ticks(0, 47).tolist()
    [0.0, 10.0, 20.0, 30.0, 40.0]
    """
    if not high > low:
        return np.array([low], dtype=np.float64)
    rough = (high - low) / count
    power = 10.0 ** floor(log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough * (1 - 1e-9))
    counts = np.arange(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1, dtype=np.float64)
    return counts * step

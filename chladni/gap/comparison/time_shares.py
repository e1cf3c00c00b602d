"""When the gap is larger than in the rest of the record."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.comparison.shares import LEAST_EXCESS, relative_residual
from chladni.gap.records.diagnosis import TimeShare
from chladni.signals.arrays import Real

# Ends of a stretch are told to this part of the record, of a short one to so many samples.
PIECES = 64
SHORTEST_PIECE = 8
MOST_TIMES = 6
# More than the usual three: the stretch was chosen among two thousand, some of which stand out by chance.
LEAST_SIGMAS = 5.0
# Pieces without any gap have no logarithm; this far below the mean nothing is told of them.
FLOOR = 1e-9
# Of a normal variable: median size of the difference of two, in standard deviations.
MEDIAN_DIFFERENCE = 0.6745 * np.sqrt(2)


def time_shares(residual: Real, measured: Real, *, sample_rate_hz: float) -> tuple[TimeShare, ...]:
    """Find the stretches of the record in which the gap is larger than in the rest.

    The record is cut into 64 pieces of equal length, fewer when it's short. The stretch of neighbouring pieces told
    first is the one with the largest sum of (share of the gap's power - 1.25 share of time); the next ones are found
    in the same way before and behind it. A stretch counts when its power exceeds the record's mean by five standard
    errors, on a logarithmic scale and with the scatter between neighbouring pieces.

    Parameters
    ----------
    residual, measured
        ``[output, sample]``.
    sample_rate_hz
        Samples a second.

    Returns
    -------
    tuple of TimeShare
        At most six, by falling share, seconds from the first sample. Empty when the gap is there all the time, and
        when there is none.

    Examples
    --------
    >>> measured = np.ones((1, 640))
    >>> residual = np.zeros((1, 640))
    >>> residual[0, 320:480] = 0.1
    >>> time_shares(residual, measured, sample_rate_hz=10.0)
    (TimeShare(start_s=32.0, end_s=48.0, share=1.0),)
    """
    power = np.mean(relative_residual(residual, measured) ** 2, axis=0)
    pieces = min(PIECES, power.size // SHORTEST_PIECE)
    if pieces < 2 or not power.sum() > 0:
        return ()
    edges = np.linspace(0, power.size, pieces + 1).round().astype(np.intp)
    shares, times = np.add.reduceat(power, edges[:-1]) / power.sum(), np.diff(edges) / power.size
    scatter = _scatter(np.log(np.maximum(shares / times, FLOOR)))
    found = [
        TimeShare(
            start_s=float(edges[first] / sample_rate_hz),
            end_s=float(edges[stop] / sample_rate_hz),
            share=float(shares[first:stop].sum()),
        )
        for first, stop in _stretches(shares - LEAST_EXCESS * times, 0, pieces)
        if _stands_out(shares[first:stop], times[first:stop], scatter)
    ]
    return tuple(sorted(found, key=lambda one: -one.share)[:MOST_TIMES])


def _scatter(level: Real) -> float:
    """Standard deviation of a piece's level, from neighbours: a gap that comes and goes changes few of them."""
    return float(np.median(np.abs(np.diff(level))) / MEDIAN_DIFFERENCE)


def _stretches(gain: Real, first: int, stop: int) -> Iterator[tuple[int, int]]:
    """Stretches of largest sum: of the whole, then of what lies before and behind it, and so on."""
    if first >= stop:
        return
    sums = np.concatenate([[0.0], np.cumsum(gain[first:stop])])
    # The sum of every stretch at once, as differences of the running sum.
    every = np.where(np.tri(sums.size, k=-1, dtype=bool), sums[:, None] - sums[None, :], -np.inf)
    end, begin = (int(place) + first for place in np.unravel_index(np.argmax(every), every.shape))
    if gain[begin:end].sum() > 0:
        yield begin, end
        yield from _stretches(gain, first, begin)
        yield from _stretches(gain, end, stop)


def _stands_out(shares: Real, times: Real, scatter: float) -> bool:
    return bool(np.log(shares.sum() / times.sum()) > LEAST_SIGMAS * scatter / np.sqrt(shares.size))

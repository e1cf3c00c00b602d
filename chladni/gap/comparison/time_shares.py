"""When the gap is larger than in the rest of the record."""

from collections.abc import Iterator

import numpy as np
from scipy.special import ndtr, ndtri

from chladni.gap.calibration import BLOCK, LISTED, OUTSIDE, PIECES, ROUNDING, SAME
from chladni.gap.comparison.shares import relative_residual
from chladni.gap.records.diagnosis import TimeShare
from chladni.signals.arrays import Real


def time_shares(residual: Real, measured: Real, *, sample_rate_hz: float) -> tuple[TimeShare, ...]:
    """Find the stretches of the record in which the gap is larger than in the rest.

    The record is cut into 64 pieces of equal length, fewer when it's short. The stretch of neighbouring pieces told
    first is the one with the largest sum of (share of the gap's power - 1.25 share of time); the next ones are found
    in the same way before and behind it. A stretch counts when its power exceeds the
    record's mean by more than chance gives the best of all stretches, as three standard errors do for one, on a
    logarithmic scale and with the scatter between neighbouring pieces.

    Parameters
    ----------
    residual, measured
        ``[output, sample]``.

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
    pieces = min(PIECES, power.size // BLOCK)
    if pieces < 2 or not power.sum() > 0:
        return ()
    edges = np.linspace(0, power.size, pieces + 1).round().astype(np.intp)
    shares, times = np.add.reduceat(power, edges[:-1]) / power.sum(), np.diff(edges) / power.size
    # Beyond three sigma; the stretch was chosen among many, some of which stand out by chance.
    sigmas = -float(ndtri(ndtr(-OUTSIDE) / (pieces * (pieces + 1) / 2)))
    scatter = _scatter(np.log(np.maximum(shares / times, ROUNDING)))
    found = [
        TimeShare(
            start_s=float(edges[first] / sample_rate_hz),
            end_s=float(edges[stop] / sample_rate_hz),
            share=float(shares[first:stop].sum()),
        )
        for first, stop in _stretches(shares - SAME * times, 0, pieces)
        if _stands_out(shares[first:stop], times[first:stop], sigmas * scatter)
    ]
    return tuple(sorted(found, key=lambda one: -one.share)[:LISTED])


def _scatter(level: Real) -> float:
    """Standard deviation of a piece's level, from neighbours: a gap that comes and goes changes few of them."""
    # Of a normal variable: median size of the difference of two, in standard deviations.
    return float(np.median(np.abs(np.diff(level))) / (np.sqrt(2) * ndtri(0.75)))


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
    return bool(np.log(shares.sum() / times.sum()) > scatter / np.sqrt(shares.size))

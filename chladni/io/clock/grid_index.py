"""Grid index of stamped samples, from the knots of a time base."""

from collections.abc import Callable

import numpy as np

from chladni.signals.arrays import Real, Whole

#: Index of samples that have no place on the grid.
NOWHERE = -(1 << 62)
#: Widths of the running median that are tried in turn; the smallest without collisions is the sharpest at gaps.
SMOOTHINGS = (1, 9, 65)
# Slices of the log on which the smoothing is chosen.
_SLICE = 20_000
_SLICES = 8
# Items looked up at a time, so that what is computed on the way stays in the processor's cache.
_BLOCK = 1 << 14


def grid_index(
    time_ns: Whole,
    order: Whole,
    *,
    knots_ns: Whole,
    knots_index: Real,
    rate_hz: float,
    smoothing: int = 1,
    resumed: Whole | None = None,
    resumed_shift: Whole | None = None,
    cut_order: Whole | None = None,
    cuts: Whole | None = None,
) -> Whole:
    """Give the grid index of each item (message, or first sample of a batch).

    Parameters
    ----------
    time_ns
        ``[item]`` rising stamps, steps of the clock undone.
    order
        ``[item]`` samples that came before the item.
    knots_ns, knots_index, rate_hz, smoothing, resumed, resumed_shift, cuts
        As in `TimeBase`. With stretches that resume, the index is the order plus the shift of the stretch. Else it
        is what the stamp says; with a smoothing above 1, the order plus a running median of how far stamps are ahead
        of the order, so that scatter moves no sample and a gap still does.
    cut_order
        ``[step]`` samples before each place where the clock was set. Nothing is smoothed across, and scatter puts no
        sample where one is left out.
    """
    if resumed is not None and resumed_shift is not None and resumed.size:
        counted: Whole = order + resumed_shift[np.searchsorted(resumed, order, side="right") - 1]
        return counted
    knots = (knots_ns - knots_ns[0]).astype(np.float64)
    nearest = np.empty(time_ns.shape, np.int64)
    for start in range(0, time_ns.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        elapsed = (time_ns[part] - knots_ns[0]).astype(np.float64)
        index = np.interp(elapsed, knots, knots_index)
        # Outside the knots the clock runs on at its mean rate.
        index += np.minimum(elapsed, 0.0) * (rate_hz * 1e-9)
        index += np.maximum(elapsed - knots[-1], 0.0) * (rate_hz * 1e-9)
        nearest[part] = np.rint(index, out=index)
    if cut_order is None or cuts is None or not cut_order.size:
        return nearest if smoothing == 1 else _smoothed(nearest, order, smoothing)
    places = np.searchsorted(order, cut_order)
    if smoothing > 1:
        parts = np.unique(np.clip(places, 0, order.size))
        pairs = zip(np.split(nearest, parts), np.split(order, parts), strict=True)
        nearest = np.concatenate([_smoothed(near, part, smoothing) for near, part in pairs if part.size])
    lengths = np.diff(places, prepend=0, append=order.size)
    low = np.repeat(np.append(np.iinfo(np.int64).min, cuts[:, 1]), lengths)
    high = np.repeat(np.append(cuts[:, 0] - 1, np.iinfo(np.int64).max), lengths)
    return np.clip(nearest, low, high)


def side_by_side(index: Whole, time_ns: Whole, cuts: Whole) -> Whole:
    """Part two samples on one point where the point beside is free: their order tells their places.

    One that moves is nearer to the other's point by its stamp, but the count of samples around says that it's the
    one beside. Of two with one stamp it isn't known whether one repeats the other: the one that may belong to the
    free point is left there without a place.

    Parameters
    ----------
    index, time_ns
        ``[..., item]`` grid indices by the stamps alone, and the stamps, rising.
    cuts
        As in `TimeBase`: there points are free on purpose.

    Returns
    -------
    int64 array ``[..., item]``
        New where anything moves, with `NOWHERE` for what has no place.
    """
    steps = np.diff(index, axis=-1)
    twice = steps == 0
    if not twice.any():
        return index
    room = steps > 1
    # A place that is left out between two stretches is none.
    left_out = np.searchsorted(cuts[:, 0], index, side="left")
    room &= np.diff(left_out, axis=-1) == 0
    never = np.zeros_like(twice[..., :1])
    first = np.concatenate((twice & np.concatenate((never, room[..., :-1]), axis=-1), never), axis=-1)
    second = np.concatenate((never, twice & np.concatenate((room[..., 1:], never), axis=-1)), axis=-1) & ~first
    alike = np.concatenate((np.diff(time_ns, axis=-1) == 0, never), axis=-1)
    moved: Whole = np.where(first & alike, NOWHERE, index - first + (second & ~np.roll(alike, 1, axis=-1)))
    return moved


def _smoothed(nearest: Whole, order: Whole, smoothing: int) -> Whole:
    # Imported here because a log with sound stamps never needs it.
    from scipy.ndimage import median_filter

    ahead: Whole = median_filter(nearest - order, size=smoothing, mode="nearest")
    return ahead + order


def choose_smoothing(time_ns: Whole, clock: Callable[..., Whole], *, repeats: int) -> int:
    """Give the smallest smoothing with which at most 0.1 % of the messages, true repeats apart, collide.

    Parameters
    ----------
    time_ns
        ``[message]`` rising.
    clock
        `grid_index` of a time base, called with times, order and smoothing.
    repeats
        Messages with the stamp of another.
    """
    allowed = 1e-3 + 1.1 * repeats / time_ns.size
    slices = min(_SLICES, -(-time_ns.size // _SLICE))
    places = np.linspace(0, max(0, time_ns.size - _SLICE), slices).astype(np.int64)
    for smoothing in SMOOTHINGS:
        collisions = items = 0
        for place in places:
            part = time_ns[place : place + _SLICE]
            index = clock(part, np.arange(part.size), smoothing=smoothing)
            collisions += int(np.count_nonzero(np.diff(index) < 1))
            items += index.size
        if collisions <= allowed * items:
            return smoothing
    return SMOOTHINGS[-1]

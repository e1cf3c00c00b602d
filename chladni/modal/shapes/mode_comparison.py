"""Two sets of modes, before and after, paired by frequency and shape."""

from math import hypot

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.special import ndtri

from chladni.modal.shapes.mac import cross_mac
from chladni.signals.arrays import Real
from chladni.signals.mode_change import ModeChange
from chladni.signals.mode_set import ModeSet

# A mode that moved further than this share of its frequency is another one; what damage, load or temperature do to a
# structure stays below it.
FARTHEST = 0.1
# Shapes less alike than this are not of one mode, whatever the frequencies.
LEAST_MAC = 0.5
FALSE_ALARM = 0.01


def compare_modes(before: ModeSet, after: ModeSet, *, false_alarm: float = FALSE_ALARM) -> tuple[ModeChange, ...]:
    """Pair the modes of two sets and tell what changed that their error bars don't explain.

    Parameters
    ----------
    before, after
        Sets that share channels (by name, or by point and direction).
    false_alarm
        Chance that a structure that hasn't changed shows any change, 0 to 1; shared among all frequencies and
        damping ratios.

    Returns
    -------
    tuple of ModeChange
        By rising frequency, those before the change first.

    Raises
    ------
    EstimateError
        When the sets share no channel.

    Notes
    -----
    Pairs are those that cost least in all (Kuhn 1955): the distance in frequency over a tenth of it, plus 1 - MAC.
    """
    likeness = cross_mac(before, after)
    pairs = cheapest_pairs(before.frequency_hz, after.frequency_hz, likeness)
    limit = float(-ndtri(false_alarm / (4 * max(len(pairs), 1))))
    found = [_paired(before, after, one, other, float(likeness[one, other]), limit) for one, other in pairs]
    gone = sorted(set(range(before.frequency_hz.size)) - {one for one, _ in pairs})
    new = sorted(set(range(after.frequency_hz.size)) - {other for _, other in pairs})
    found += [ModeChange(fate="vanished", before=row, before_hz=float(before.frequency_hz[row])) for row in gone]
    found += [ModeChange(fate="appeared", after=row, after_hz=float(after.frequency_hz[row])) for row in new]
    return tuple(sorted(found, key=_place))


def cheapest_pairs(
    before_hz: Real, after_hz: Real, likeness: Real, *, farthest: float = FARTHEST, least_mac: float = LEAST_MAC
) -> list[tuple[int, int]]:
    """Pair modes by frequencies and the MAC of their shapes ``[before, after]``, at least cost in all.

    Parameters
    ----------
    farthest
        Share of its frequency by which a mode may move.
    least_mac
        Of a pair.
    """
    apart = np.abs(before_hz[:, np.newaxis] / after_hz - 1)
    possible = (apart <= farthest) & (likeness >= least_mac)
    # More than all possible pairs together: an impossible one is only taken for want of any other.
    cost = np.where(possible, apart / farthest + 1 - likeness, 3.0 * (1 + max(likeness.shape, default=1)))
    rows, columns = linear_sum_assignment(cost)
    return [(int(one), int(other)) for one, other in zip(rows, columns, strict=True) if possible[one, other]]


def _paired(before: ModeSet, after: ModeSet, one: int, other: int, likeness: float, limit: float) -> ModeChange:
    shift_hz = float(after.frequency_hz[other] - before.frequency_hz[one])
    shift_std_hz = hypot(float(after.frequency_std_hz[other]), float(before.frequency_std_hz[one]))
    change = float(after.damping_ratio[other] - before.damping_ratio[one])
    change_std = hypot(float(after.damping_std[other]), float(before.damping_std[one]))
    moved = abs(shift_hz) > limit * shift_std_hz or abs(change) > limit * change_std
    return ModeChange(
        fate="changed" if moved else "unchanged",
        before=one,
        after=other,
        before_hz=float(before.frequency_hz[one]),
        after_hz=float(after.frequency_hz[other]),
        shift_hz=shift_hz,
        shift_std_hz=shift_std_hz,
        damping_change=change,
        damping_change_std=change_std,
        mac=likeness,
    )


def _place(change: ModeChange) -> float:
    return change.before_hz if change.before_hz is not None else (change.after_hz or 0.0)

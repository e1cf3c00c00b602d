"""What all pictures of torques over motion share: which maps, which range, which colours."""

import numpy as np

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.robot import Over, TorqueMap
from chladni.signals.arrays import Index

#: A few wild samples of a differentiated motion must not flatten all others.
SHOWN, ROOM = 99.0, 1.15
#: Letters of a motion's name that have room below a small picture, beside its unit.
LONGEST = 34


def maps_over(found: Diagnosis, over: Over) -> list[TorqueMap]:
    """Give the maps over speed or over position that hold anything."""
    return [one for one in found.torque_maps if one.over == over and one.motion.size]


def motion_name(one: TorqueMap) -> str:
    """What the torque is drawn over: the motion of a joint, or of a pair the sum that its gears make of two."""
    if one.ratio is None:
        return one.over
    share = "" if abs(one.ratio) == 1.0 else f"{abs(one.ratio):.3g} × "
    sign = "−" if one.ratio < 0 else "+"
    first, second = one.site.split("~")
    named = f"{first} {sign} {share}{second}"
    # Where the names have no room: the title has both, in this order.
    ways = (f"{one.over} of {named}", named, f"{one.over} of 1st {sign} {share}2nd")
    return next((way for way in ways if len(way) <= LONGEST), ways[-1])


def torque_range(one: TorqueMap) -> tuple[float, float]:
    """Torques that a picture shows: nearly all samples, all means and all of the laws, and zero."""
    lines = [one.mean, one.described, *([] if one.law is None else [one.law])]
    ends = np.percentile(one.torque, [100.0 - SHOWN, SHOWN])
    low, high = (float(end(np.concatenate([ends, *lines, [0.0]]))) for end in (np.min, np.max))
    room = (ROOM - 1.0) * (high - low) or 1.0
    return low - room, high + room


def load_reach(one: TorqueMap) -> float:
    """Load that has full colour."""
    return float(np.percentile(np.abs(one.load), SHOWN)) or 1.0


def turns_of(one: TorqueMap) -> Index:
    """Bins at which a line over them breaks: where the motion turns, friction jumps."""
    none = np.zeros(0, dtype=np.intp)
    return np.flatnonzero(np.diff(np.sign(one.centre))) + 1 if one.over == "velocity" else none

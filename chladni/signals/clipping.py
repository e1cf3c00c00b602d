"""Clipping: samples at the end of a sensor's range, or cut off short of it."""

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Whole
from chladni.signals.sensor_record import SensorRecord, runs
from chladni.signals.unit_text import with_unit

# A range that is named is reached a little early by offset and gain of a real amplifier.
_NEAR_OVERLOAD = 0.999
_SHORTEST_PLATEAU = 3
# Of a record that seems cut off because its values repeat by chance.
_CHANCE = 1e-3


def clipped(record: SensorRecord) -> tuple[Whole, tuple[str, str]]:
    """Give the samples beyond the range, and what to say of them."""
    unit = record.channel.unit
    there = beyond_range(record)
    if there.size:
        reached = with_unit(f"{record.channel.overload:.6g}", unit)
        return there, (f"reaches its range of {reached}", "use a larger range")
    ends = {level: _plateaus(record, level) for level in (record.low, record.high) if level != 0}
    levels = " and ".join(f"{level:.6g}" for level, there in ends.items() if there.size)
    # A tank that is full stays at 100 %; samples alone can't tell that from a sensor at its limit.
    told = (f"is cut off at {with_unit(levels, unit)}", "use a larger range, unless the quantity itself ends there")
    return np.sort(np.concatenate([*ends.values()])), told


def beyond_range(record: SensorRecord) -> Whole:
    """Samples at the end of the range that is named, if one is."""
    limit = _NEAR_OVERLOAD * (record.channel.overload or np.inf)
    if max(record.high, -record.low) < limit:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(np.abs(record.samples) >= limit)


def _plateaus(record: SensorRecord, level: float) -> Whole:
    """Give the samples at an end of the range if they're cut off there, else nothing."""
    there = np.flatnonzero(record.samples == level)
    starts, lengths = runs(there)
    if lengths.size == 0 or lengths.max() < _SHORTEST_PLATEAU or _rests(record, there):
        return there[:0]
    others = record.samples[record.samples != level]
    if _one_way(others):
        return there[:0]
    # A sine piles up at its ends as well, but no more than 2.4 times as on the next value.
    beside = int(np.count_nonzero(others == (others.max() if level == record.high else others.min())))
    long = lengths >= _SHORTEST_PLATEAU
    first, last = starts[long], (starts + lengths - 1)[long]
    entry = np.maximum(record.step(first - 1), record.step(first - 2))
    # A record that begins at its end of the range is judged by how it leaves.
    entry = np.where(first > 1, entry, np.maximum(record.step(last), record.step(last + 1)))
    kinked = entry > max(0.1 * record.typical_step, 4 * record.smallest_step)
    if _by_chance(record, there, lengths) and not np.any(entry > 6 * record.typical_step):
        return there[:0]
    cut_off = there.size >= 3 * beside and kinked.size > 0 and np.count_nonzero(kinked) >= 0.5 * kinked.size
    return there if cut_off else there[:0]


def _by_chance(record: SensorRecord, ends: Whole, lengths: Whole) -> bool:
    """Whether one of these runs may be as long as it is because values repeat everywhere."""
    at_end = int(np.sum(lengths - 1))
    repeating = (record.still.size - at_end) / max(1, record.samples.size - ends.size)
    return bool(lengths.size * repeating ** (int(lengths.max()) - 1) > _CHANCE)


def _one_way(samples: NDArray[np.floating]) -> bool:
    """Whether samples never rise or never fall, as after a step that something follows slowly."""
    steps = np.diff(samples)
    return bool(not np.any(steps > 0) or not np.any(steps < 0))


def _rests(record: SensorRecord, ends: Whole) -> bool:
    # Away from the end of the range a signal that mostly stands still is a command or a state, not a vibration.
    at_end = int(np.count_nonzero(np.diff(ends) == 1))
    return record.still.size - at_end > 0.5 * (record.samples.size - ends.size)

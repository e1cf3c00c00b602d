"""Faults of sensors, noticed in their samples: clipped, dead, dropouts, spikes, not numbers, coarse steps.

Every rule asks for something that no vibration does, so that noise of any length, sines, impacts, sweeps and bursts
pass: a plateau entered with a kink, a hold left with a leap, a leap there and back within three samples.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import with_unit
from chladni.signals.wording import counted

FaultKind = Literal["clipped", "dead", "dropouts", "spikes", "not-a-number", "coarse"]
# A range that is named is reached a little early by offset and gain of a real amplifier.
_NEAR_OVERLOAD = 0.999
_SHORTEST_PLATEAU = 3
# Where values hardly repeat by chance, and where they may.
_SHORTEST_HOLD, _SURE_HOLD = 4, 8
# A leap is this many medians of the local step; Gaussian noise of 10^7 samples reaches 8.
_LEAP = 30.0
_LEAP_BLOCK = 4096
_WIDEST_SPIKE = 3
_QUIET_AROUND = 8
_FEWEST = 16
# Faults of a record that may be due to values that repeat by chance: cut off at its end; held anywhere in it.
_CHANCE, _CHANCE_HELD = 1e-3, 1e-5
# What the whole record shows isn't counted.
_THROUGHOUT = ("dead", "coarse")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorFault:
    """A fault of one channel.

    Attributes
    ----------
    channel
        Name of the channel.
    kind
        ``clipped``, ``dead``, ``dropouts``, ``spikes``, ``not-a-number`` or ``coarse``.
    count
        Samples concerned.
    first_s, last_s
        Time of the first and of the last one, seconds from the start of the series.
    what, remedy
        What was found, and what to do.
    """

    channel: str
    kind: FaultKind
    count: int
    first_s: float
    last_s: float
    what: str
    remedy: str

    @property
    def sentence(self) -> str:
        """What was found in which channel, how often and when, and what to do."""
        often = f" in {counted(self.count, 'sample')} {moments(self.first_s, self.last_s)}"
        often = "" if self.kind in _THROUGHOUT else often
        return f"{self.channel}: {self.what}{often}; {self.remedy}"


def moments(first_s: float, last_s: float) -> str:
    """Say when samples lie that are counted.

    Examples
    --------
    >>> moments(0.0, 0.8125), moments(3.2, 3.2)
    ('between 0 and 0.8125 s', 'at 3.2 s')
    """
    return f"at {first_s:.4g} s" if first_s == last_s else f"between {first_s:.4g} and {last_s:.4g} s"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Record:
    """Good samples of a channel, with what several rules need of them."""

    channel: Channel
    samples: NDArray[np.floating]
    still: Whole
    leaps: Whole
    typical_step: float
    smallest_step: float
    low: float
    high: float

    def step(self, places: Whole) -> NDArray[np.floating]:
        """Magnitude of the steps from these samples to the next ones; 0 outside."""
        inside = np.clip(places, 0, self.samples.size - 2)
        steps = np.abs(self.samples[inside + 1] - self.samples[inside])
        return np.where(inside == places, steps, 0)


def sensor_quality(series: TimeSeries) -> tuple[SensorFault, ...]:
    """Notice faulty sensors.

    Parameters
    ----------
    series
        Samples; missing ones (not `valid`) are no fault of a sensor and are left out.

    Returns
    -------
    faults
        By channel, in the order of the series; empty when all is well. A channel without a fault here may still be
        wrong in ways that samples alone don't tell (gain, mounting, direction).

    Notes
    -----
    Rules, with q the smallest step seen and m the median step between neighbours:

    - clipped: at or above 99.9 % of the channel's overload; or at least three samples in a row at the very top (or
      bottom), three times as many there as on the value next to it, reached with a step above 0.1 m and 4 q (at the
      start of the record: left so), and no more by chance than once in 1000 where values repeat elsewhere (or reached
      with a step above 6 m). A top reached smoothly is where a motion turns or rests, what else goes one way only is
      no vibration, and an end at exactly 0 is that of a quantity of one sign (a speed, a level), which no larger
      range would move.
    - dead: constant, or two or three values within 0.1 % of the mean or 0.01 % of the overload.
    - dropouts: the same value for at least eight samples, or for four to seven where by the share of values that
      repeat no more than 1e-5 such runs are due to chance, not at an end of the range, between steps above 0.1 m
      before and after; in a channel that otherwise moves.
    - spikes: 30 m and 4 q away and back within three samples (m of the 4096 around), steps of the eight samples
      before and after below a quarter of that. Force channels are left out, where that's a hit.
    - not-a-number: NaN or infinite.
    - coarse: three to sixteen different values, in a channel that keeps changing.
    """
    faults: list[SensorFault] = []
    for row, channel in enumerate(series.channels):
        valid = None if series.valid is None else series.valid[row]
        faults += _channel_faults(channel, series.values[row], valid, series.sample_rate_hz)
    return tuple(faults)


def _channel_faults(
    channel: Channel, values: NDArray[np.floating], valid: Mask | None, rate_hz: float
) -> list[SensorFault]:
    faults: list[SensorFault] = []
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        finite = np.isfinite(values)
        # NaN marked as missing is how a gap looks; infinity never is.
        faulty = ~finite if valid is None else np.isinf(values) | (~finite & valid)
        told = ("is no number", "estimates leave out what touches them")
        faults += _fault(channel, "not-a-number", np.flatnonzero(faulty), told)
        valid = finite if valid is None else valid & finite
    place = None
    if valid is not None and not valid.all():
        place = np.flatnonzero(valid)
        values = values[place]
    if values.size >= _FEWEST:
        # A step between the largest numbers is infinite, and compares as such.
        with np.errstate(over="ignore"):
            faults += _faults_of(_record(channel, values), place)
    return [replace(one, first_s=one.first_s / rate_hz, last_s=one.last_s / rate_hz) for one in faults]


def _faults_of(record: _Record, place: Whole | None) -> list[SensorFault]:
    """Apply the rules; `first_s` and `last_s` are indices until the caller knows better."""
    channel = record.channel
    if _is_dead(record) and not _beyond_range(record).size:
        everything = np.arange(record.samples.size)
        return _fault(channel, "dead", everything, _dead_told(record), place)
    clipped, told = _clipped(record)
    faults = _fault(channel, "clipped", clipped, told, place)
    told = ("is held or zero amid motion", "check transmission")
    faults += _fault(channel, "dropouts", _held(record), told, place)
    told = ("leaps away and back", "check connectors and grounding")
    faults += _fault(channel, "spikes", _spikes(record), told, place)
    if _is_coarse(record):
        step = with_unit(f"{record.smallest_step:.3g}", channel.unit)
        told = (f"moves in coarse steps of {step}", "use a smaller range")
        faults += _fault(channel, "coarse", np.arange(record.samples.size), told, place)
    return faults


def _dead_told(record: _Record) -> tuple[str, str]:
    if record.low == record.high == 0:
        return "is 0 throughout", "the sensor isn't connected or nobody fills this field"
    level = with_unit(f"{record.low:.6g}", record.channel.unit)
    if record.low == record.high:
        return f"is {level} throughout", "check cable and supply, or leave it out"
    return f"moves by its last digit only, at {level}", "check cable, supply and range"


def _fault(
    channel: Channel, kind: FaultKind, samples: Whole, told: tuple[str, str], place: Whole | None = None
) -> list[SensorFault]:
    if not samples.size:
        return []
    first, last = (samples if place is None else place[samples])[[0, -1]].astype(float)
    what, remedy = told
    return [
        SensorFault(
            channel=channel.name,
            kind=kind,
            count=samples.size,
            first_s=float(first),
            last_s=float(last),
            what=what,
            remedy=remedy,
        )
    ]


def _record(channel: Channel, samples: NDArray[np.floating]) -> _Record:
    starts = np.unique(np.linspace(0, max(0, samples.size - _LEAP_BLOCK), 64).astype(np.int64))
    some = np.concatenate([np.abs(np.diff(samples[start : start + _LEAP_BLOCK])) for start in starts])
    moving = some[some > 0]
    typical = float(np.median(moving)) if moving.size else 0.0
    smallest = float(moving.min()) if moving.size else 0.0
    still, leaps = _scan(samples, floor=max(0.25 * _LEAP * typical, 4 * smallest))
    return _Record(
        channel=channel,
        samples=samples,
        still=still,
        leaps=leaps,
        typical_step=typical,
        smallest_step=smallest,
        low=float(samples.min()),
        high=float(samples.max()),
    )


def _scan(samples: NDArray[np.floating], *, floor: float) -> tuple[Whole, Whole]:
    """Find steps of zero, and leaps: steps above `floor` and far above the median of their block of 4096."""
    still, leaps = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for start in range(0, samples.size - 1, _LEAP_BLOCK):
        # A block at a time stays in the cache.
        steps = np.abs(np.diff(samples[start : start + _LEAP_BLOCK + 1]))
        if steps.min() == 0:
            still.append(np.flatnonzero(steps == 0) + start)
        if steps.max() > floor:
            limit = max(_LEAP * float(np.median(steps[::8])), floor)
            leaps.append(np.flatnonzero(steps > limit) + start)
    return np.concatenate(still), np.concatenate(leaps)


def _is_dead(record: _Record) -> bool:
    span = record.high - record.low
    if span == 0:
        return True
    # Only against an offset or a stated range is a span small: around zero it may be all there is.
    middle = abs(record.high + record.low) / 2
    tiny = span < max(1e-3 * middle, 1e-4 * (record.channel.overload or 0.0))
    return tiny and np.unique(record.samples).size <= 3


def _is_coarse(record: _Record) -> bool:
    # Two values are a switch; a few that rarely change are a state or a command.
    if not 0.3 * record.samples.size < record.still.size < 0.95 * record.samples.size:
        return False
    return 3 <= np.unique(record.samples).size <= 16


def _clipped(record: _Record) -> tuple[Whole, tuple[str, str]]:
    """Give the samples beyond the range, and what to say of them."""
    unit = record.channel.unit
    there = _beyond_range(record)
    if there.size:
        reached = with_unit(f"{record.channel.overload:.6g}", unit)
        return there, (f"reaches its range of {reached}", "use a larger range")
    ends = {level: _plateaus(record, level) for level in (record.low, record.high) if level != 0}
    levels = " and ".join(f"{level:.6g}" for level, there in ends.items() if there.size)
    # A tank that is full stays at 100 %; samples alone can't tell that from a sensor at its limit.
    told = (f"is cut off at {with_unit(levels, unit)}", "use a larger range, unless the quantity itself ends there")
    return np.sort(np.concatenate([*ends.values()])), told


def _beyond_range(record: _Record) -> Whole:
    """Samples at the end of the range that is named, if one is."""
    limit = _NEAR_OVERLOAD * (record.channel.overload or np.inf)
    if max(record.high, -record.low) < limit:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(np.abs(record.samples) >= limit)


def _plateaus(record: _Record, level: float) -> Whole:
    """Give the samples at an end of the range if they're cut off there, else nothing."""
    there = np.flatnonzero(record.samples == level)
    starts, lengths = _runs(there)
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


def _by_chance(record: _Record, ends: Whole, lengths: Whole) -> bool:
    """Whether one of these runs may be as long as it is because values repeat everywhere."""
    at_end = int(np.sum(lengths - 1))
    repeating = (record.still.size - at_end) / max(1, record.samples.size - ends.size)
    return bool(lengths.size * repeating ** (int(lengths.max()) - 1) > _CHANCE)


def _one_way(samples: NDArray[np.floating]) -> bool:
    """Whether samples never rise or never fall, as after a step that something follows slowly."""
    steps = np.diff(samples)
    return bool(not np.any(steps > 0) or not np.any(steps < 0))


def _rests(record: _Record, ends: Whole) -> bool:
    # Away from the end of the range a signal that mostly stands still is a command or a state, not a vibration.
    at_end = int(np.count_nonzero(np.diff(ends) == 1))
    return record.still.size - at_end > 0.5 * (record.samples.size - ends.size)


def _held(record: _Record) -> Whole:
    if record.still.size > 0.25 * record.samples.size:
        return record.still[:0]
    starts, lengths = _runs(record.still)
    long = lengths >= _shortest_hold(record) - 1
    starts, lengths = starts[long], lengths[long]
    entered = record.step(starts - 1) > 0.1 * record.typical_step
    left = record.step(starts + lengths) > max(0.1 * record.typical_step, 4 * record.smallest_step)
    level = record.samples[starts]
    chosen = entered & left & (level != record.high) & (level != record.low)
    return _filled(starts[chosen], lengths[chosen] + 1)


def _shortest_hold(record: _Record) -> int:
    """Samples of the same value that are hardly due to chance."""
    repeating = record.still.size / record.samples.size
    by_chance = record.samples.size * repeating ** np.arange(_SHORTEST_HOLD - 1, _SURE_HOLD - 1)
    return _SHORTEST_HOLD + int(np.count_nonzero(by_chance > _CHANCE_HELD))


def _spikes(record: _Record) -> Whole:
    if record.channel.unit == "N" or record.channel.role == "reference" or record.leaps.size < 2:
        return record.leaps[:0]
    away, back = record.leaps[:-1], record.leaps[1:]
    close = back - away <= _WIDEST_SPIKE
    away, back = away[close], back[close]
    # Of quarters, neither differences nor their sum are beyond the largest number.
    at, back_at = (np.stack([record.samples[place], record.samples[place + 1]]) / 4 for place in (away, back))
    there, again = at[1] - at[0], back_at[1] - back_at[0]
    # Vibration that begins with a leap goes on with others; a spike stands alone.
    around = np.arange(1, _QUIET_AROUND + 1)
    nearby = np.maximum(record.step(away[:, None] - around), record.step(back[:, None] + around)).max(axis=1)
    chosen = (np.abs(there + again) < 0.3 * np.abs(there)) & (nearby / 4 < 0.25 * np.abs(there))
    return _filled(away[chosen] + 1, (back - away)[chosen])


def _runs(places: Whole) -> tuple[Whole, Whole]:
    """First of each run of consecutive whole numbers, and its length."""
    breaks = np.flatnonzero(np.diff(places, prepend=-2) != 1)
    return places[breaks], np.diff(breaks, append=places.size)


def _filled(starts: Whole, lengths: Whole) -> Whole:
    if not starts.size:
        return starts
    return np.concatenate([np.arange(start, start + length) for start, length in zip(starts, lengths, strict=True)])

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
from chladni.signals.clipping import beyond_range, clipped
from chladni.signals.sensor_record import SensorRecord, runs, sensor_record
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import with_unit
from chladni.signals.wording import counted

FaultKind = Literal["clipped", "dead", "dropouts", "spikes", "not-a-number", "coarse"]
# Where values hardly repeat by chance, and where they may.
_SHORTEST_HOLD, _SURE_HOLD = 4, 8
_WIDEST_SPIKE = 3
_QUIET_AROUND = 8
_FEWEST = 16
# Runs of a record that may be due to values that repeat by chance, where it seems held.
_CHANCE_HELD = 1e-5
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
            faults += _faults_of(sensor_record(channel, values), place)
    return [replace(one, first_s=one.first_s / rate_hz, last_s=one.last_s / rate_hz) for one in faults]


def _faults_of(record: SensorRecord, place: Whole | None) -> list[SensorFault]:
    """Apply the rules; `first_s` and `last_s` are indices until the caller knows better."""
    channel = record.channel
    if _is_dead(record) and not beyond_range(record).size:
        everything = np.arange(record.samples.size)
        return _fault(channel, "dead", everything, _dead_told(record), place)
    cut_off, told = clipped(record)
    faults = _fault(channel, "clipped", cut_off, told, place)
    told = ("is held or zero amid motion", "check transmission")
    faults += _fault(channel, "dropouts", _held(record), told, place)
    told = ("leaps away and back", "check connectors and grounding")
    faults += _fault(channel, "spikes", _spikes(record), told, place)
    if _is_coarse(record):
        step = with_unit(f"{record.smallest_step:.3g}", channel.unit)
        told = (f"moves in coarse steps of {step}", "use a smaller range")
        faults += _fault(channel, "coarse", np.arange(record.samples.size), told, place)
    return faults


def _dead_told(record: SensorRecord) -> tuple[str, str]:
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


def _is_dead(record: SensorRecord) -> bool:
    span = record.high - record.low
    if span == 0:
        return True
    # Only against an offset or a stated range is a span small: around zero it may be all there is.
    middle = abs(record.high + record.low) / 2
    tiny = span < max(1e-3 * middle, 1e-4 * (record.channel.overload or 0.0))
    return tiny and np.unique(record.samples).size <= 3


def _is_coarse(record: SensorRecord) -> bool:
    # Two values are a switch; a few that rarely change are a state or a command.
    if not 0.3 * record.samples.size < record.still.size < 0.95 * record.samples.size:
        return False
    return 3 <= np.unique(record.samples).size <= 16


def _held(record: SensorRecord) -> Whole:
    if record.still.size > 0.25 * record.samples.size:
        return record.still[:0]
    starts, lengths = runs(record.still)
    long = lengths >= _shortest_hold(record) - 1
    starts, lengths = starts[long], lengths[long]
    entered = record.step(starts - 1) > 0.1 * record.typical_step
    left = record.step(starts + lengths) > max(0.1 * record.typical_step, 4 * record.smallest_step)
    level = record.samples[starts]
    chosen = entered & left & (level != record.high) & (level != record.low)
    return _filled(starts[chosen], lengths[chosen] + 1)


def _shortest_hold(record: SensorRecord) -> int:
    """Samples of the same value that are hardly due to chance."""
    repeating = record.still.size / record.samples.size
    by_chance = record.samples.size * repeating ** np.arange(_SHORTEST_HOLD - 1, _SURE_HOLD - 1)
    return _SHORTEST_HOLD + int(np.count_nonzero(by_chance > _CHANCE_HELD))


def _spikes(record: SensorRecord) -> Whole:
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


def _filled(starts: Whole, lengths: Whole) -> Whole:
    if not starts.size:
        return starts
    return np.concatenate([np.arange(start, start + length) for start, length in zip(starts, lengths, strict=True)])

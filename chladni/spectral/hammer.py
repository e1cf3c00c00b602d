"""Hits of a hammer, and the reasons to leave one out of an average."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import with_unit
from chladni.spectral.double_hit import second_pulse
from chladni.spectral.force_pulses import Pulses, is_clipped, typical_peak

# At equal noise, a hit of a quarter of the usual force has a sixteenth of the usual ratio of signal to noise power.
WEAK_SHARE = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Hit:
    """One hit of the hammer.

    Attributes
    ----------
    record
        Its number in the log, the first hit is 1; rejected hits count too.
    time_s
        When the force crosses the trigger level, seconds since the first sample.
    peak
        Largest force, in the channel's unit, with its sign.
    """

    record: int
    time_s: float
    peak: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Rejection:
    """A hit that was left out, and why; `record` and `time_s` as in `Hit`."""

    record: int
    time_s: float
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Impacts:
    """The hits of an impact test.

    Attributes
    ----------
    force
        Name of the force channel.
    trigger_level
        Force at which a hit begins, in the channel's unit, with the sign of the pulses.
    pretrigger_s, record_s
        A record begins `pretrigger_s` before the trigger and lasts `record_s`.
    longest_s
        Longest record that fits between the hits as they usually follow each other.
    pulse_s
        Typical width of the force pulse at half its height.
    accepted, rejected
        In order of time.
    notes
        Sentences of advice.
    """

    force: str
    trigger_level: float
    pretrigger_s: float
    record_s: float
    longest_s: float
    pulse_s: float
    accepted: tuple[Hit, ...]
    rejected: tuple[Rejection, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judge:
    """Looks at one hit after the other and collects every reason against it."""

    series: TimeSeries
    pulses: Pulses
    before: int
    length: int
    double_hit_share: float

    def verdicts(self) -> tuple[tuple[Hit, ...], tuple[Rejection, ...]]:
        """Give the accepted and the rejected hits."""
        accepted, rejected = [], []
        for at, start in enumerate(self.pulses.starts):
            record, time_s = at + 1, float(start / self.series.sample_rate_hz)
            reasons = self._reasons(at)
            if reasons:
                rejected.append(Rejection(record=record, time_s=time_s, reason="; ".join(reasons)))
            else:
                height = self.pulses.sign * self.pulses.force[self.pulses.peaks[at]]
                accepted.append(Hit(record=record, time_s=time_s, peak=float(height)))
        return tuple(accepted), tuple(rejected)

    def _reasons(self, at: int) -> list[str]:
        first = int(self.pulses.starts[at]) - self.before
        inside = slice(max(first, 0), min(first + self.length, self.pulses.force.size))
        # All reasons, not the first one: whoever repeats the measurement wants to mend them all at once.
        found = [
            self._overload(inside),
            self._double_hit(at, inside),
            self._weak(at),
            self._ringing(at),
            self._missing(inside),
            self._beyond(at, first),
        ]
        return [reason for reason in found if reason]

    def _overload(self, inside: slice) -> str:
        over = []
        for channel, values in zip(self.series.channels, self.series.values[:, inside], strict=True):
            # Missing samples are a reason of their own and must not hide an overload.
            x = np.nan_to_num(values.astype(np.float64))
            limited = channel.overload is not None and bool(np.any(np.abs(x) >= channel.overload))
            if limited or any(is_clipped(side, int(np.argmax(side))) for side in (x, -x)):
                over.append(f"{channel.name} reads up to {with_unit(f'{np.abs(x).max():.4g}', channel.unit)}")
        return f"overload: {', '.join(over)}" if over else ""

    def _double_hit(self, at: int, inside: slice) -> str:
        force, peak = self.pulses.force, int(self.pulses.peaks[at])
        second = second_pulse(self.pulses, at, inside, share=self.double_hit_share)
        if second is None:
            return ""
        height = with_unit(f"{force[second]:.3g}", self.pulses.unit)
        return (
            f"double hit: a second pulse of {height} ({force[second] / force[peak]:.0%}), "
            f"{(second - peak) / self.series.sample_rate_hz * 1e3:.1f} ms after the first"
        )

    def _weak(self, at: int) -> str:
        height = float(self.pulses.force[self.pulses.peaks[at]])
        typical = typical_peak(self.pulses.force, self.pulses.peaks)
        return (
            f"too weak: its peak is {height / typical:.0%} of the usual one" if height < WEAK_SHARE * typical else ""
        )

    def _ringing(self, at: int) -> str:
        since = int(self.pulses.starts[at] - self.pulses.starts[at - 1]) if at else self.length
        if since >= self.length:
            return ""
        return f"the hit {since / self.series.sample_rate_hz:.3g} s before still rings in this record"

    def _missing(self, inside: slice) -> str:
        valid = self.series.valid
        return "samples are missing in it" if valid is not None and not valid[:, inside].all() else ""

    def _beyond(self, at: int, first: int) -> str:
        # Of a hit that begins with the log only silence is missing; of one that is under way, the force.
        if self.pulses.starts[at] == 0:
            return "its pulse begins before the log"
        return "its record ends after the log" if first + self.length > self.pulses.force.size else ""

"""Watches samples as they come: which lines and levels rose or fell beyond their scatter, which sensors died."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.comparison import LevelChange, PeakChange
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.unit_text import with_unit
from chladni.spectral.accumulator import AutoSpectraAccumulator
from chladni.spectral.comparison import compare_densities
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.segmentation import Segmentation

#: Segments of a window that is compared, and its least length.
WINDOW_SEGMENTS: Final = 16
WINDOW_S: Final = 5.0
#: Windows that make the baseline: their scatter among each other tells what is usual.
BASELINE: Final = 4
#: Share of false changes among those told of one window; a day has ten thousand windows.
FALSE_DISCOVERY: Final = 1e-5
#: A change counts when so many windows in a row show it.
IN_A_ROW: Final = 2
#: Lines whose scatter is judged together.
LINES_TOGETHER: Final = 32
#: Changes of one window told one by one.
MOST_TOLD: Final = 6
#: A level that changed by less isn't worth a word, however sure.
LEAST_DB: Final = 1.0
#: A sensor that moved shows one value only: after so long, and so many times its longest rest before, it is dead.
DEAD_S: Final = 1.0
DEAD_RESTS: Final = 10.0

ChangeKind = Literal["line", "level", "sensor"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalChange:
    """Something that changed beyond scatter.

    Attributes
    ----------
    kind
        ``line``: a line rose, fell, came or went; ``level``: the level of a channel changed; ``sensor``: a sensor
        that died, or is alive again.
    time_ns
        When it was found, nanoseconds since the Unix epoch.
    channel
        Name of the channel.
    text
        A sentence.
    """

    kind: ChangeKind
    time_ns: int
    channel: str
    text: str


class ChangeWatch:
    """Compares the present with a baseline, window by window; mutable.

    The baseline is the first four windows. Where they scatter more among each other than stationary noise does, the
    error bars are widened by as much, over bands of 32 lines. What two windows in a row show is told, and then the
    present becomes the baseline.

    Parameters
    ----------
    channels, sample_rate_hz
        Of every block.
    segmentation
        Segments and their window.
    """

    def __init__(self, channels: Sequence[Channel], sample_rate_hz: float, segmentation: Segmentation) -> None:
        self.channels = tuple(channels)
        self._rate_hz = sample_rate_hz
        self._plan = segmentation
        seconds = max(WINDOW_S, segmentation.length_of(WINDOW_SEGMENTS) / sample_rate_hz)
        self._window_samples = round(seconds * sample_rate_hz)
        self._window = self._new()
        self._seen = 0
        self._usual: list[PowerSpectralDensity] = []
        self._baseline: PowerSpectralDensity | None = None
        self._before: set[tuple[str, str]] = set()
        self._rests = _Rests(len(self.channels))
        self._full: deque[tuple[PowerSpectralDensity, int]] = deque()

    @property
    def waiting(self) -> int:
        """How many windows there are to judge."""
        return len(self._full)

    def update(self, block: TimeSeries) -> tuple[SignalChange, ...]:
        """Take the next block; give what changed."""
        return (*self.take(block), *self.judge())

    def judge(self) -> tuple[SignalChange, ...]:
        """Compare the windows that are full; may run in a thread beside `take`."""
        told: list[SignalChange] = []
        while self._full:
            told += self._judged(*self._full.popleft())
        return tuple(told)

    def take(self, block: TimeSeries) -> tuple[SignalChange, ...]:
        """Take the next block, without judging; give which sensors died or are alive again."""
        told = self._rests.changes(block)
        self._window.update(block)
        self._seen += block.samples
        if self._seen < self._window_samples:
            return told
        try:
            density = power_spectral_density(self._window.result())
        except EstimateError:
            # Too many gaps for a single segment.
            density = None
        self._window, self._seen = self._new(), 0
        if density is not None and density.provenance.averages >= WINDOW_SEGMENTS // 2:
            self._full.append((density, block.start_time_ns + round(block.duration_s * NS_PER_S)))
        return told

    def begin_anew(self) -> None:
        """Forget the baseline: the present is what is usual."""
        self._usual, self._baseline, self._before = [], None, set()

    def _new(self) -> AutoSpectraAccumulator:
        return AutoSpectraAccumulator(self.channels, self._rate_hz, self._plan)

    def _judged(self, density: PowerSpectralDensity, end_ns: int) -> tuple[SignalChange, ...]:
        if self._baseline is None:
            self._usual.append(density)
            if len(self._usual) == BASELINE:
                self._baseline = _baseline(self._usual)
                self._usual = []
            return ()
        moving = [
            channel.name
            for row, channel in enumerate(self.channels)
            if density.values[row].any() and self._baseline.values[row].any()
        ]
        if not moving:
            return ()
        base = self._baseline.select(moving)
        own = density.select(moving)
        # A line that nothing ever showed on has no relative scatter.
        scatter = np.divide(base.std, base.values, out=np.zeros_like(base.std), where=base.values > 0)
        widened = replace(own, std=own.values * scatter)
        found = compare_densities(base, _positive(widened, own), false_discovery=FALSE_DISCOVERY)
        all_of_them: tuple[PeakChange | LevelChange, ...] = (*found.peaks, *found.overall)
        changes = {_key(one): one for one in all_of_them if _counts(one)}
        again = self._before & set(changes)
        self._before = set(changes)
        if len(again) == 0:
            return ()
        told = [_told(changes[key], end_ns) for key in changes if key in again]
        self.begin_anew()
        if len(told) > MOST_TOLD:
            more = replace(told[MOST_TOLD], text=f"and {len(told) - MOST_TOLD} more lines and levels changed")
            told = [*told[:MOST_TOLD], more]
        return tuple(told)


def _positive(widened: PowerSpectralDensity, own: PowerSpectralDensity) -> PowerSpectralDensity:
    """The wider of both error bars."""
    with np.errstate(invalid="ignore"):
        return replace(own, std=np.fmax(widened.std, own.std))


def _baseline(windows: Sequence[PowerSpectralDensity]) -> PowerSpectralDensity:
    """Mean of windows, with the error bar of one window as they scatter among each other."""
    values = np.stack([one.values for one in windows])
    mean = values.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(mean > 0, values / mean - 1, 0.0)
        expected = np.where(mean > 0, windows[0].std / windows[0].values, 0.0)
    scatter = (relative**2).sum(axis=0) / (len(windows) - 1)
    usual = _smooth(scatter)
    chance = _smooth(expected**2)
    widening = np.sqrt(np.maximum(1.0, np.divide(usual, chance, out=np.ones_like(usual), where=chance > 0)))
    return replace(windows[0], values=mean, std=mean * expected * widening)


def _smooth(power: Real) -> Real:
    """Mean over neighbouring lines."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(power, min(LINES_TOGETHER, power.shape[-1]), axis=-1, mode="nearest"))


def _counts(change: PeakChange | LevelChange) -> bool:
    if isinstance(change, LevelChange):
        return change.significant and abs(change.change_db) >= LEAST_DB
    return change.fate != "unchanged"


def _key(change: PeakChange | LevelChange) -> tuple[str, str]:
    """What makes two changes the same one, in two windows."""
    if isinstance(change, LevelChange):
        return change.channel, "up" if change.change_db > 0 else "down"
    peak = change.before or change.after
    channel = change.channels[0] if change.channels else ""
    # To two digits: the peak of another window stands a little beside.
    return channel, f"{change.fate} {0.0 if peak is None else peak.frequency_hz:.2g}"


def _told(change: PeakChange | LevelChange, time_ns: int) -> SignalChange:
    if isinstance(change, LevelChange):
        way = "rose" if change.change_db > 0 else "fell"
        text = (
            f"the level of {change.channel} {way} by {abs(change.change_db):.2g} dB, from "
            f"{with_unit(f'{change.before:.3g}', change.unit)} to {with_unit(f'{change.after:.3g}', change.unit)} RMS"
        )
        return SignalChange(kind="level", time_ns=time_ns, channel=change.channel, text=text)
    channel = change.channels[0] if change.channels else ""
    text = _line(change)
    return SignalChange(kind="line", time_ns=time_ns, channel=channel, text=f"{text} in {channel}")


def _line(change: PeakChange) -> str:
    before, after = change.before, change.after
    if before is None and after is not None:
        return f"a line came up at {after.frequency_hz:.5g} Hz, {with_unit(f'{after.height:.3g}', after.unit)},"
    if after is None and before is not None:
        return f"the line at {before.frequency_hz:.5g} Hz is gone"
    if before is None or after is None:
        raise AssertionError("a change of nothing")
    return f"the line at {before.frequency_hz:.5g} Hz moved to {after.frequency_hz:.5g} Hz"


class _Rests:
    """Finds sensors that moved once and show one value only."""

    def __init__(self, channels: int) -> None:
        self._last = np.full(channels, np.nan)
        self._resting_s = np.zeros(channels)
        self._longest_s = np.zeros(channels)
        self._moved = np.zeros(channels, np.bool_)
        self._dead = np.zeros(channels, np.bool_)

    def changes(self, block: TimeSeries) -> tuple[SignalChange, ...]:
        """Take the next block."""
        if not block.samples:
            return ()
        low, high = np.fmin.reduce(block.values, axis=1), np.fmax.reduce(block.values, axis=1)
        # A channel without a number in the block says nothing: its topic is silent, and that is told elsewhere.
        known = np.isfinite(low)
        still = known & (low == high) & ((low == self._last) | np.isnan(self._last))
        moving = known & ~still
        # How long a sensor that lives may rest, as a setpoint does.
        rested_s = np.where(moving & ~self._dead, np.fmax(self._resting_s, _longest_rest_s(block, moving)), 0.0)
        self._longest_s = np.fmax(self._longest_s, rested_s)
        self._resting_s = np.where(still, self._resting_s + block.duration_s, np.where(known, 0.0, self._resting_s))
        self._moved |= moving & ~np.isnan(self._last)
        limit_s = np.maximum(DEAD_S, DEAD_RESTS * self._longest_s)
        dead = self._moved & (self._resting_s >= limit_s)
        died, revived = np.flatnonzero(dead & ~self._dead), np.flatnonzero(self._dead & moving)
        told = [self._told(block, int(row), "shows one value only", float(low[row])) for row in died]
        told += [self._told(block, int(row), "moves again", None) for row in revived]
        self._dead = np.where(moving, False, self._dead | dead)
        self._last = np.where(known, block.values[:, -1], self._last)
        return tuple(told)

    def _told(self, block: TimeSeries, row: int, what: str, value: float | None) -> SignalChange:
        channel = block.channels[row]
        since = ""
        if value is not None:
            shown = with_unit(f"{value:.4g}", channel.unit)
            since = f" for {self._resting_s[row]:.2g} s, {shown}; its sensor may be dead"
        return SignalChange(
            kind="sensor",
            time_ns=block.start_time_ns,
            channel=channel.name,
            text=f"{channel.name} {what}{since}",
        )


def _longest_rest_s(block: TimeSeries, moving: Mask) -> Real:
    """Longest time that a channel that moves kept one value within a block."""
    longest = np.zeros(len(block.channels))
    # Noise never rests; only what shows one value twice is looked at.
    resting = (block.values[:, 1:] == block.values[:, :-1]).any(axis=1)
    for row in np.flatnonzero(moving & resting):
        edges = np.flatnonzero(np.diff(block.values[row]) != 0)
        longest[row] = float(np.diff(edges, prepend=-1, append=block.samples - 1).max()) / block.sample_rate_hz
    return longest

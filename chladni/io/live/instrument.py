"""Instruments: what takes samples itself, as sound cards and data acquisition do, behind one small protocol."""

import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.live.followed_log import Silence
from chladni.io.live.reception import Samples, Told
from chladni.io.setup import Setup, refined
from chladni.signals.channel import Channel, find_channel
from chladni.signals.errors import LogError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import NS_PER_S, TimeSeries, is_sample_rate
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.number_lists import NumberLists

#: Seconds of samples that wait to be analysed; what comes beyond is left out, and counted.
WAITING_S: Final = 5.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Taken:
    """Samples that an instrument took.

    Attributes
    ----------
    first
        Number of the first of them since the start; numbers left out are samples that were lost.
    values
        ``[channel, sample]``, in each channel's unit.
    """

    first: int
    values: NDArray[np.floating]


class Instrument(ABC):
    """The protocol: channels, a rate, and samples with their numbers.

    An instrument is read by a thread of its own as fast as it gives samples. It raises `LogError` or `OSError` from
    `read` when it fails, and gives None when it has ended.
    """

    name: str
    channels: tuple[Channel, ...]
    sample_rate_hz: float

    @abstractmethod
    def start(self) -> None:
        """Begin to take samples."""

    @abstractmethod
    def read(self, timeout_s: float, /) -> Taken | None:
        """Give the next samples, none when `timeout_s` has passed without any; None when there won't be more."""

    @abstractmethod
    def stop(self) -> None:
        """End."""


class LiveInstrument:
    """Blocks of samples of an instrument, see `chladni.io.live.door.LiveSamples`.

    Parameters
    ----------
    instrument
        What takes the samples.
    channels
        Names; None for all.
    setup
        Units, sensitivities and points by the channels' names.
    patience_s
        Seconds without samples after which it counts as ended; None waits for ever.
    waiting_s
        Seconds of samples that may wait.

    Raises
    ------
    LogError
        When there is no such channel, or the instrument doesn't start.
    """

    def __init__(
        self,
        instrument: Instrument,
        *,
        channels: Sequence[str] | None = None,
        setup: Setup | None = None,
        patience_s: float | None = None,
        waiting_s: float = WAITING_S,
    ) -> None:
        self.name = instrument.name
        self.number_lists: tuple[NumberLists, ...] = ()
        self._instrument = instrument
        self._setup = setup or Setup()
        if not is_sample_rate(instrument.sample_rate_hz):
            raise LogError(f"{self.name}: {instrument.sample_rate_hz} samples/s is no rate")
        refinements = [self._refined(channel) for channel in instrument.channels]
        self._rows = np.arange(len(refinements))
        if channels is not None:
            self._rows = np.array([find_channel(instrument.channels, name) for name in dict.fromkeys(channels)])
        self._channels = tuple(refinements[row][0] for row in self._rows)
        self._factors = np.array([refinements[row][1] for row in self._rows])[:, np.newaxis]
        self._silence = Silence(self.name, patience_s)
        self._most = max(1, round(waiting_s * instrument.sample_rate_hz))
        self._lock, self._ready = threading.Lock(), threading.Event()
        self._held: list[Taken] = []
        self._left_out = 0
        self._next = 0
        self._ended: str | None = None
        self._stopped = threading.Event()
        self._errors: queue.SimpleQueue[str] = queue.SimpleQueue()
        instrument.start()
        self._start_ns = time.time_ns()
        self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
        self._thread.start()

    @property
    def geometry(self) -> Geometry:
        """Points and lines of the setup file."""
        return self._setup.geometry

    @property
    def silent_channels(self) -> tuple[str, ...]:
        """All channels come together."""
        return ()

    def rate_hz(self, _channels: Sequence[Channel], /, **_fitted: bool) -> float | None:
        """The rate is that of the instrument's own clock."""
        return None

    def receive(self, timeout_s: float) -> Samples:
        """Give the samples that have come, at the latest after `timeout_s`."""
        self._ready.wait(timeout_s)
        with self._lock:
            held, self._held = self._held, []
            left_out, self._left_out = self._left_out, 0
            ended = self._ended
            self._ready.clear()
        told = [Told(kind="source", text=text) for text in self._silence.heard(bool(held))]
        if left_out:
            what = f"{self.name}: {counted(left_out, 'sample')} skipped: this computer can't follow"
            told.append(Told(kind="skipped", text=f"{what}; their places stay free", samples=left_out))
        blocks = [block for taken in held for block in self._blocks(taken, told)]
        if ended:
            told.append(Told(kind="source", text=f"{self.name}: {ended}"))
        elif self._silence.over:
            ended = "silent"
            told.append(Told(kind="source", text=f"{self.name}: nothing came for {self._silence.patience_s:g} s"))
        return Samples(blocks=tuple(blocks), told=tuple(told), ended=ended is not None)

    def finish(self) -> Samples:
        """Give what waits."""
        got = self.receive(0.0)
        return replace(got, ended=True)

    def close(self) -> None:
        """Stop the instrument."""
        self._stopped.set()
        self._instrument.stop()
        self._thread.join(timeout=5.0)

    def _refined(self, channel: Channel) -> tuple[Channel, float]:
        own = [one for one in self._setup.channels if one.path == channel.name]
        return refined(channel, 1.0, own[0]) if own else (channel, 1.0)

    def _run(self) -> None:
        why = "the instrument has ended"
        while not self._stopped.is_set():
            try:
                taken = self._instrument.read(0.1)
            except (LogError, OSError) as error:
                why = f"the instrument failed: {error}"
                break
            if taken is None:
                break
            if taken.values.shape[1]:
                self._hold(taken)
        with self._lock:
            self._ended = why
        self._ready.set()

    def _hold(self, taken: Taken) -> None:
        with self._lock:
            waiting = sum(one.values.shape[1] for one in self._held)
            if waiting + taken.values.shape[1] > self._most:
                self._left_out += taken.values.shape[1]
                return
            self._held.append(taken)
        self._ready.set()

    def _blocks(self, taken: Taken, told: list[Told]) -> list[TimeSeries]:
        rate_hz = self._instrument.sample_rate_hz
        if taken.first < self._next:
            what = f"{self.name}: samples from number {taken.first} on came again; they are left out"
            told.append(Told(kind="late", text=what, samples=taken.values.shape[1]))
            return []
        lost = taken.first - self._next
        at_ns = self._start_ns + round(taken.first / rate_hz * NS_PER_S)
        if lost:
            told.append(Told(kind="gap", time_ns=at_ns, text=f"{counted(lost, 'sample')} missing", samples=lost))
        self._next = taken.first + taken.values.shape[1]
        values = taken.values[self._rows]
        if np.any(self._factors != 1.0):
            values = values * self._factors
        valid = np.isfinite(values)
        return [
            TimeSeries(
                values=values,
                sample_rate_hz=rate_hz,
                start_time_ns=at_ns,
                channels=self._channels,
                valid=None if valid.all() else valid,
            )
        ]

"""A log that is still being written: averages that run, modes that are followed, and what changes."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chladni.apps.live_grid import LiveGrid, LiveOptions
from chladni.apps.live_modes import ModeLook, ModeLooks, Schedule
from chladni.apps.modes import Band
from chladni.io.live.door import LiveSamples, open_live
from chladni.io.live.instrument import Instrument
from chladni.io.live.reception import MessageSource, Samples
from chladni.io.setup import Setup
from chladni.io.stamps import StampRequest
from chladni.signals.channel import Channel, Names, as_names
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.live_state import EventKind, LiveEvent, LiveState
from chladni.signals.process_memory import trim_memory
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted, near_matches
from chladni.spectral.change_watch import SignalChange
from chladni.spectral.running import TIME_CONSTANT_S
from chladni.spectral.severity import Machine
from chladni.spectral.windows import Window

if TYPE_CHECKING:
    from chladni.robots.robot import Robot
    from chladni.robots.torque_residual import TorqueResidual
    from chladni.signals.waterfall import Waterfall

#: How long a source is waited for; a state comes at least as often while samples do.
POLL_S: Final = 0.02
#: ... and how long messages are gathered that come one by one.
GATHER_S: Final = 0.01
#: How often averages are renewed, and modes looked for.
AVERAGES_EVERY_S: Final = 0.5
MODES_EVERY_S: Final = 5.0
#: ... and waterfalls, which are large: several at a time would be most of the memory that is used.
WATERFALLS_EVERY_S: Final = 2.5
#: How often memory that is free is given back to the system.
TRIM_EVERY_S: Final = 60.0
#: Windows that wait to be compared with what is usual; a minute of them, or more.
MOST_WINDOWS_WAITING: Final = 12


def live(
    source: "str | Path | MessageSource | Instrument | LiveSamples",
    *,
    channels: Names | None = None,
    references: Names | None = None,
    band_hz: Band | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    time_constant_s: float = TIME_CONSTANT_S,
    modes_every_s: float = MODES_EVERY_S,
    machine: Machine | None = None,
    robot: "Robot | Path | str | None" = None,
    setup: Setup | Path | str | None = None,
    stamp: StampRequest = "auto",
    sample_rate_hz: float | None = None,
    patience_s: float | None = None,
    stop: threading.Event | None = None,
) -> Iterator[LiveState]:
    """Follow a source of samples: running averages, modes, and what changes beyond scatter.

    Parameters
    ----------
    source
        Path of an MCAP log that a recorder is still writing, followed to its footer; ``-``, MCAP on standard input;
        ``ws://HOST:PORT``, a Foxglove WebSocket server. Or what gives messages or blocks of samples itself.
    channels
        Message paths; None for every channel whose samples are uniform.
    references
        Excitations; None takes the channels whose role is reference, else the first force that changes.
    band_hz
        Where modes are looked for and levels are measured; None for everywhere.
    resolution_hz, window, overlap
        Of spectra, as for `chladni.psd`; lines of None are such that a segment takes 2 s at most.
    time_constant_s
        Of the exponential averages.
    modes_every_s
        How often modes are looked for in the responses alone; 0 for never.
    machine
        Class and foundation, for the zone of severity.
    robot
        Robot file or description: the torque that it doesn't explain is averaged as ``torque_residual.JOINT``.
    setup, stamp, sample_rate_hz
        As for `chladni.open_log`.
    patience_s
        Seconds without anything new after which the source counts as ended; None waits for ever.
    stop
        Ends it when set, with a last state.

    Returns
    -------
    Iterator[LiveState]
        A state whenever samples came, something happened, or averages were renewed; the last has `ended` set.

    Raises
    ------
    LogError
        When the source can't be opened or is no log; what happens later is told in the states.
    SetupError
        When the setup file or an option doesn't fit.

    Examples
    --------
    >>> for state in live("arm.mcap"):  # doctest: +SKIP
    ...     for event in state.events:
    ...         print(f"{event.time_s:.1f} s: {event.text}")
    """
    options = LiveOptions(
        references=None if references is None else as_names(references),
        band_hz=band_hz,
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        time_constant_s=time_constant_s,
        modes_every_s=modes_every_s,
        machine=machine,
        robot=_robot(robot),
    )
    if isinstance(source, str | Path | MessageSource | Instrument):
        samples = open_live(
            source,
            channels=None if channels is None else as_names(channels),
            setup=setup,
            stamp=stamp,
            sample_rate_hz=sample_rate_hz,
            patience_s=patience_s,
        )
    else:
        samples = source
    return _states(samples, options, stop or threading.Event())


def _states(samples: LiveSamples, options: LiveOptions, stop: threading.Event) -> Iterator[LiveState]:
    session = _Session(samples, options)
    try:
        yield from session.run(stop)
    finally:
        session.close()


class _Session:
    """One run from the first sample to the last."""

    def __init__(self, samples: LiveSamples, options: LiveOptions) -> None:
        self._samples = samples
        self._options = options
        self._grids: dict[tuple[Channel, ...], LiveGrid] = {}
        self._spectra_due = Schedule(AVERAGES_EVERY_S)
        self._pairs_due = Schedule(2 * AVERAGES_EVERY_S)
        self._levels_due = Schedule(2 * AVERAGES_EVERY_S)
        self._falls_due = Schedule(WATERFALLS_EVERY_S)
        self._trim_due = Schedule(TRIM_EVERY_S)
        self._torques: dict[tuple[Channel, ...], TorqueResidual | None] = {}
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="modes")
        self._looks = ModeLooks(self._worker, every_s=options.modes_every_s)
        self._judging: Future[tuple[SignalChange, ...]] | None = None
        self._start_ns: int | None = None
        self._end_ns = 0
        self._told: set[str] = set()
        self._events: list[LiveEvent] = []
        self._values: dict[str, Any] = {}

    def run(self, stop: threading.Event) -> Iterator[LiveState]:
        """Give states until the source ends or `stop` is set."""
        while True:
            ending = stop.is_set()
            got = self._samples.finish() if ending else self._samples.receive(POLL_S)
            blocks = self._take(got)
            ended = got.ended or ending
            self._judge(ended=ended)
            fresh = self._renew(ended=ended)
            if blocks or self._events or fresh or ended:
                yield self._state(blocks, fresh=fresh, ended=ended)
            if ended:
                return
            if self._trim_due.due:
                trim_memory()
                self._trim_due.done(0.0)
            if not any(block.duration_s > POLL_S for block in blocks):
                # Single messages cost as much as some together.
                time.sleep(GATHER_S)

    def _judge(self, *, ended: bool) -> None:
        """Compare full windows with what is usual, in the thread: it takes longer than a picture may wait."""
        # What is fed faster than it can be judged waits here: windows that wait would take ever more memory.
        behind = any(grid.watch.waiting > MOST_WINDOWS_WAITING for grid in self._grids.values())
        if self._judging is not None and (ended or behind or self._judging.done()):
            self._tell_changes(self._judging.result())
            self._judging = None
        if ended:
            for grid in self._grids.values():
                self._tell_changes(grid.watch.judge())
        elif self._judging is None and self._grids:
            # The grid with most windows first, or one that is fed fast would keep the others waiting.
            grid = max(self._grids.values(), key=lambda one: one.watch.waiting)
            if grid.watch.waiting:
                self._judging = self._worker.submit(grid.watch.judge)

    def _tell_changes(self, changes: Iterable[SignalChange]) -> None:
        for change in changes:
            self._tell(change.kind, change.text, change.time_ns)

    def close(self) -> None:
        """Let go of the source and of the thread."""
        self._samples.close()
        self._worker.shutdown(wait=True, cancel_futures=True)

    # --- samples ---

    def _take(self, got: Samples) -> tuple[TimeSeries, ...]:
        taken = []
        # What is told with the first samples has its time from their start on, too.
        if self._start_ns is None and got.blocks:
            self._start_ns = got.blocks[0].start_time_ns
        for told in got.told:
            self._tell(told.kind, told.text, told.time_ns, told.samples)
        residuals = [one for one in map(self._residual, got.blocks) if one is not None]
        for block in (*got.blocks, *residuals):
            try:
                self._average(block)
            except EstimateError as error:
                self._tell(
                    "skipped",
                    f"{counted(block.samples, 'sample')} left out of the averages: {error}",
                    None,
                    block.samples,
                )
                continue
            self._end_ns = max(self._end_ns, block.start_time_ns + round(block.duration_s * NS_PER_S))
            taken.append(block)
        if taken:
            self._require_references()
        return tuple(taken)

    def _require_references(self) -> None:
        """Tell which references no channel is; they may come."""
        known = [channel.name for channels in self._grids for channel in channels]
        for name in self._options.references or ():
            if name not in known:
                self._once(
                    f"no frequency response to {name} yet: no channel is named so; {near_matches(name, known)}"
                )

    def _average(self, block: TimeSeries) -> None:
        grid = self._grids.get(block.channels) or self._begin(block)
        self._tell_changes(grid.take(block, self._samples.silent_channels))

    def _residual(self, block: TimeSeries) -> TimeSeries | None:
        """Torque that the robot's description doesn't explain; None for blocks that don't hold its joints."""
        if self._options.robot is None:
            return None
        if block.channels not in self._torques:
            from chladni.robots.torque_residual import TorqueResidual

            try:
                made = TorqueResidual.of(self._options.robot, self._samples.number_lists, block)
            except SetupError as error:
                made = None
                self._once(str(error))
            self._torques[block.channels] = made
        torque = self._torques[block.channels]
        return None if torque is None else torque.take(block)

    def _begin(self, block: TimeSeries) -> LiveGrid:
        grid = LiveGrid(block.channels, block.sample_rate_hz, self._options)
        for note in grid.averages.notes:
            self._tell("note", note, None)
        self._grids[block.channels] = grid
        return grid

    def _tell(self, kind: EventKind, text: str, time_ns: int | None, samples: int = 0) -> None:
        start_ns = self._start_ns
        at_ns = self._end_ns if time_ns is None else time_ns
        time_s = 0.0 if start_ns is None or not at_ns else (at_ns - start_ns) / NS_PER_S
        self._events.append(LiveEvent(kind=kind, time_s=time_s, text=text, samples=samples))

    def _once(self, text: str) -> None:
        """Tell what needn't be told again."""
        if text not in self._told:
            self._told.add(text)
            self._tell("note", text, None)

    # --- averages ---

    def _renew(self, *, ended: bool) -> bool:
        """Renew what it's time for; at the end, all. Give whether spectra are fresh."""
        if not self._grids:
            return False
        fresh = self._in_turn(self._spectra_due, self._renew_spectra, ended=ended)
        self._in_turn(self._falls_due, self._renew_waterfalls, ended=ended)
        self._in_turn(self._levels_due, self._renew_levels, ended=ended)
        self._in_turn(self._pairs_due, self._renew_response, ended=ended)
        if self._options.modes_every_s > 0:
            self._renew_modes(ended=ended)
        return fresh

    def _in_turn(self, schedule: Schedule, renew: Callable[[bool], None], *, ended: bool) -> bool:
        """Renew something if it's time; give whether it was."""
        if not (ended or schedule.due):
            return False
        begun_s = time.monotonic()
        renew(ended)
        schedule.done(time.monotonic() - begun_s)
        return True

    @contextmanager
    def _waiting_for_more(self, ended: bool) -> Iterator[None]:
        """Leave out what can't be estimated yet; at the end it's told."""
        try:
            yield
        except EstimateError as error:
            if ended:
                self._once(str(error))

    def _renew_spectra(self, ended: bool) -> None:
        found: dict[str, list[Any]] = {name: [] for name in ("densities", "exponential", "peak_hold")}
        for channels, grid in self._grids.items():
            rate_hz = self._samples.rate_hz(channels, fitted=ended)
            averages = grid.averages
            with self._waiting_for_more(ended):
                found["densities"] += averages.densities("linear", sample_rate_hz=rate_hz)
                found["exponential"] += averages.densities("exponential", sample_rate_hz=rate_hz)
                found["peak_hold"] += averages.densities("peak-hold", sample_rate_hz=rate_hz)
        self._values |= {name: tuple(some) for name, some in found.items()}

    def _renew_waterfalls(self, ended: bool) -> None:
        falls: list[Waterfall] = []
        self._values["waterfalls"] = ()
        for channels, grid in self._grids.items():
            with self._waiting_for_more(ended):
                falls.append(grid.averages.waterfall(sample_rate_hz=self._samples.rate_hz(channels, fitted=ended)))
        self._values["waterfalls"] = tuple(falls)

    def _renew_levels(self, ended: bool) -> None:
        found: dict[str, list[Any]] = {"levels": [], "severities": []}
        for grid in self._grids.values():
            averages = grid.averages
            with self._waiting_for_more(ended):
                found["levels"].append(averages.levels())
                severity = averages.severity()
                found["severities"] += [] if severity is None else [severity]
        self._values |= {name: tuple(some) for name, some in found.items()}
        self._values["still"] = tuple(name for grid in self._grids.values() for name in grid.still)

    def _renew_response(self, ended: bool) -> None:
        for_modes = self._options.modes_every_s > 0 and (ended or self._looks.due)
        for channels, grid in self._grids.items():
            if not (for_modes or grid.responds):
                continue
            with self._waiting_for_more(ended):
                found = grid.response(self._samples.rate_hz(channels, fitted=ended))
                if found is not None:
                    self._values |= dict(zip(("response", "coherence"), found, strict=True))

    # --- modes ---

    def _renew_modes(self, *, ended: bool) -> None:
        for look in self._looks.finished(wait=ended):
            self._enter(look)
        if not (ended or self._looks.due):
            return
        grid = max(self._grids.values(), key=lambda one: len(one.channels))
        job = None
        with self._waiting_for_more(ended):
            job, notes = grid.mode_job(self._time_s)
            for note in notes:
                self._once(note)
        if job is None:
            return
        if ended:
            self._enter(job.look())
        else:
            self._looks.begin(job)

    def _enter(self, look: ModeLook) -> None:
        if look.whole is not None:
            self._values["modes"] = look.whole
        for text in self._looks.follow(look):
            self._tell("mode", text, None)
        if look.recent is not None:
            self._values |= {"recent": look.recent, "tracked": self._looks.tracked}

    # --- states ---

    @property
    def _time_s(self) -> float:
        return 0.0 if self._start_ns is None else (self._end_ns - self._start_ns) / NS_PER_S

    def _state(self, blocks: tuple[TimeSeries, ...], *, fresh: bool, ended: bool) -> LiveState:
        events, self._events = tuple(self._events), []
        return LiveState(
            title=self._samples.name,
            start_time_ns=self._start_ns or 0,
            time_s=self._time_s,
            series=blocks,
            events=events,
            fresh=fresh,
            geometry=self._samples.geometry,
            ended=ended,
            **self._values,
        )


def _robot(given: "Robot | Path | str | None") -> "Robot | None":
    if not isinstance(given, str | Path):
        return given
    # MuJoCo takes a moment to load.
    from chladni.robots.loading import load_robot

    return load_robot(given)

"""A measured log held against a model: which channel is which signal, and the model driven by the log."""

import re
import weakref
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from chladni.apps.findings import reading_sentences, require_channels
from chladni.apps.measured_charts import comparison_charts, scores
from chladni.io.log import open_log
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.core.reading import InstrumentReading
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, ModelError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import si_factor
from chladni.viewers.bench.tools import Assignment, MeasuredLog

#: Samples of one comparison: simulated in well under a second, also by a model of many bodies.
MOST_SAMPLES = 500_000


class OpenedLog:
    """A log on the disk; a private copy is removed when it's closed.

    Raises
    ------
    LogError
        When it can't be read, or nothing in it.
    """

    def __init__(self, path: Path, title: str, *, private: bool, reading: Mapping[str, Any] | None = None) -> None:
        self.title = title
        try:
            self._log = open_log(path, **(reading or {}))
        except (LogError, SetupError) as error:
            # By the name that the user knows: a dropped log lies under another one.
            raise type(error)(str(error).replace(str(path), title)) from error
        # Also when the program ends before the page is closed.
        self._removal = weakref.finalize(self, _remove, path) if private else None
        with ExitStack() as closing:
            # Whatever goes wrong until it's known to hold something, nobody else will close it.
            closing.callback(self.close)
            self.channels: tuple[Channel, ...] = self._log.channels
            info = self._log.info()
            self.duration_s: float = info.duration_s
            self.damage = reading_sentences(self._log, everything=True)
            require_channels(self._log, title)
            closing.pop_all()

    def read(self, names: Sequence[str], start_s: float, end_s: float) -> TimeSeries:
        """Give channels on their common grid."""
        return self._log.read(list(names), start_s=start_s, end_s=end_s)

    def close(self) -> None:
        """Let go of the file, and remove it when it was a private copy."""
        self._log.close()
        if self._removal is not None:
            self._removal()


def _remove(path: Path) -> None:
    path.unlink(missing_ok=True)


def terminals(model: Model) -> tuple[tuple[Terminal, ...], tuple[Terminal, ...]]:
    """Give inputs and outputs of a model."""
    compiled = model.compile()
    return compiled.inputs, compiled.outputs


def assign(model: Model, channels: Sequence[Channel]) -> dict[str, str]:
    """Guess which channel of a log is which input or output of a model.

    By the channel that the model names; else, among channels of the same unit that are free, the one whose name
    shares most words with the signal's; else the only one of that unit. Whatever stays open is left out: a page shows
    the guess, and the user has the last word.
    """
    inputs, outputs = terminals(model)
    wanted = [*inputs, *outputs]
    known = {channel.name for channel in channels}
    found = {one.name: one.channel for one in wanted if one.channel in known and one.channel is not None}
    # Names for all signals first: the only channel of a unit may be another signal's by name.
    for rule in (_by_name, _by_unit):
        for terminal in wanted:
            if terminal.name not in found:
                free = [one for one in channels if one.name not in found.values() and _fits(one, terminal)]
                guess = rule(terminal, free)
                if guess is not None:
                    found[terminal.name] = guess
    return found


def compare(
    model: Model, log: MeasuredLog, assignment: Assignment, start_s: float, seconds: float
) -> InstrumentReading:
    """Drive a model by a log's inputs, and hold its outputs against the log's.

    Parameters
    ----------
    assignment
        Channel by name of the model's input or output. Inputs that the log doesn't hold are zero.
    start_s, seconds
        Stretch of the log.

    Returns
    -------
    InstrumentReading
        For each measured output: time, spectrum, transfer function, measured and simulated; NRMSE, that is RMS of
        (measured - simulated) over RMS of measured.

    Raises
    ------
    LogError
        When channels have different grids, or there is nothing in that stretch.
    SetupError
        When a unit doesn't fit, nothing is assigned, or the stretch is too long or has gaps.
    ModelError
        When the model can't be simulated.
    """
    from chladni.models.integrator.simulate import simulate

    if not isinstance(log, OpenedLog):
        raise TypeError(f"{type(log).__name__} is no OpenedLog")
    inputs, outputs = ([one for one in group if one.name in assignment] for group in terminals(model))
    # Before reading: a wrong choice should not wait for a large log.
    _require_choice(inputs, outputs, log, assignment)
    # Once each: two signals may be the same channel.
    series = log.read(list(dict.fromkeys(assignment.values())), start_s, start_s + seconds)
    _require_whole(series, log)
    driving, measured = (_renamed(series, group, assignment) for group in (inputs, outputs))
    simulation = simulate(model, driving)
    simulated = _matching(simulation.outputs, outputs)
    charts, words = comparison_charts(driving, measured, simulated, start_s=start_s)
    return InstrumentReading(charts=charts, quantities=scores(measured, simulated), flags=(*simulation.flags, *words))


def _by_name(terminal: Terminal, free: Sequence[Channel]) -> str | None:
    shared = {channel.name: len(_words(terminal.name) & _words(channel.name)) for channel in free}
    best = max(shared, key=lambda name: shared[name], default=None)
    # Two that are as good as each other are no guess.
    return best if best is not None and shared[best] and list(shared.values()).count(shared[best]) == 1 else None


def _by_unit(_terminal: Terminal, free: Sequence[Channel]) -> str | None:
    return free[0].name if len(free) == 1 else None


def _words(name: str) -> set[str]:
    return set(re.findall(r"[a-z]+|\d+", name.lower()))


def _fits(channel: Channel, terminal: Terminal) -> bool:
    return si_factor(channel.unit)[1] == si_factor(terminal.unit)[1]


def _require_choice(
    inputs: Sequence[Terminal], outputs: Sequence[Terminal], log: OpenedLog, assignment: Assignment
) -> None:
    for what, group in (("input", inputs), ("output", outputs)):
        if not group:
            raise SetupError(f"{log.title}: no channel is chosen for any {what} of the model; choose one above")
    channels = {channel.name: channel for channel in log.channels}
    for terminal in (*inputs, *outputs):
        channel = channels[assignment[terminal.name]]
        # A log that says nothing about units is taken at its word.
        if channel.unit != "1" and not _fits(channel, terminal):
            raise SetupError(
                f"{log.title}: {channel.name} is in {channel.unit}, {terminal.name} in {terminal.unit}; "
                "choose another channel"
            )


def _require_whole(series: TimeSeries, log: OpenedLog) -> None:
    if series.samples > MOST_SAMPLES:
        most_s = MOST_SAMPLES / series.sample_rate_hz
        raise SetupError(f"{log.title}: {series.duration_s:g} s are too long to compare; take at most {most_s:.3g} s")
    if not series.all_valid():
        raise SetupError(f"{log.title}: samples are missing between these times; take a stretch without a gap")


def _renamed(series: TimeSeries, group: Sequence[Terminal], assignment: Assignment) -> TimeSeries:
    """Give the rows of these signals under the model's names."""
    rows = {channel.name: row for row, channel in enumerate(series.channels)}
    chosen = [rows[assignment[terminal.name]] for terminal in group]
    return TimeSeries(
        values=series.values[chosen],
        sample_rate_hz=series.sample_rate_hz,
        start_time_ns=series.start_time_ns,
        channels=tuple(Channel(name=terminal.name, unit=terminal.unit) for terminal in group),
    )


def _matching(simulated: TimeSeries, group: Sequence[Terminal]) -> TimeSeries:
    """Give the rows of these outputs under the model's names, whatever channels the simulation calls them by."""
    rows: Mapping[str, int] = {channel.name: row for row, channel in enumerate(simulated.channels)}
    chosen = []
    for terminal in group:
        # A simulation names its outputs by the channels of the model file where it has any.
        row = rows.get(terminal.channel or terminal.name, rows.get(terminal.name))
        if row is None:
            raise ModelError(f"the simulation gave no {terminal.name}; it gave {', '.join(rows)}")
        chosen.append(row)
    return TimeSeries(
        values=simulated.values[chosen],
        sample_rate_hz=simulated.sample_rate_hz,
        start_time_ns=simulated.start_time_ns,
        channels=tuple(Channel(name=terminal.name, unit=terminal.unit) for terminal in group),
    )

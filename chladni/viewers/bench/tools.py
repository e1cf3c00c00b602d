"""What a page can do besides drawing, handed in by the floor above: pages compute nothing."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.core.reading import Chart, InfluenceTable, InstrumentReading
from chladni.signals.channel import Channel

#: Channel of the log by name of the model's input or output; what the log doesn't hold is left out.
Assignment = Mapping[str, str]


class MeasuredLog(Protocol):
    """A log that is held against the simulation."""

    @property
    def title(self) -> str:
        """Its name, for people."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What it holds."""

    @property
    def duration_s(self) -> float:
        """Its length."""

    @property
    def damage(self) -> tuple[str, ...]:
        """Sentences about what is lost of it; none for a whole one."""

    def close(self) -> None:
        """Let go of the file, and remove it when it was a private copy."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One setting of an instrument that is kept for comparison."""

    label: str
    values: Values
    options: Options


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """What a file of rows says now: its variants, and the mistake that keeps newer ones out, or nothing."""

    variants: tuple[Variant, ...]
    mistake: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """What a page shows: the last good setting.

    Attributes
    ----------
    model
        Of that setting.
    reading
        All of it.
    charts
        Those on the page, with the curves of kept variants.
    """

    instrument: Instrument
    model: Model
    reading: InstrumentReading
    charts: tuple[Chart, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Export:
    """Something a page can save.

    Attributes
    ----------
    label
        On the button.
    file_name
        ``{name}`` stands for the instrument.
    build
        Gives the bytes.
    """

    label: str
    file_name: str
    media_type: str
    build: Callable[[Shown], bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tools:
    """What pages call; every one may raise `ChladniError`, which the page shows in one line.

    Attributes
    ----------
    read
        ``read(instrument, values, options, charts)``: numbers and the named charts of one setting, all charts when
        None; called for each turn of a knob.
    influence
        Influence coefficients at one setting.
    watch
        ``watch(instrument, path)`` gives a function that looks at a file of rows.
    open_log
        Open a log; `private` says that the file is a copy of its own, removed with `close`.
    terminals
        Inputs and outputs of a model.
    assign
        Which channel is probably which input or output.
    compare
        ``compare(model, log, assignment, start_s, seconds)``: the measured beside the simulated.
    exports
        What can be saved.
    """

    read: Callable[[Instrument, Values, Options, Collection[str] | None], InstrumentReading]
    influence: Callable[[Instrument, Values, Options], InfluenceTable]
    watch: Callable[[Instrument, Path], Callable[[], Rows]]
    open_log: Callable[[Path, str, bool], MeasuredLog]
    terminals: Callable[[Model], tuple[tuple[Terminal, ...], tuple[Terminal, ...]]]
    assign: Callable[[Model, Sequence[Channel]], Assignment]
    compare: Callable[[Model, MeasuredLog, Assignment, float, float], InstrumentReading]
    exports: tuple[Export, ...] = ()

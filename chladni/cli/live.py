"""``chladni live``: a log that is still being written, a server, an instrument."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from chladni.cli import options
from chladni.cli.levels import MachineName
from chladni.cli.opening import opens_files
from chladni.cli.output import Output
from chladni.cli.places import require_places
from chladni.cli.words import number, unit, with_error
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.apps.live_document import EventBook
    from chladni.signals.live_state import LiveState
    from chladni.viewers.rerun.live_targets import Painter, Target

MEGABYTE = 1_000_000
TURN_S = 1e-3
ENDING = b"\nending: the last averages are written; Ctrl-C again ends without them\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class Following:
    """Which samples are followed, and how they are averaged."""

    channel: Annotated[
        list[str] | None,
        typer.Option(metavar="PATH", help="Only this channel, named in full; may be repeated.", show_default=False),
    ] = None
    reference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATH", help="Channel of the excitation; a force is taken if not given.", show_default=False
        ),
    ] = None
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LO-HI", help="Modes and levels between these frequencies, in Hz.", show_default=False),
    ] = None
    resolution: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            help="Distance of the frequency lines; such that a segment takes 2 s at most if not given.",
            show_default=False,
        ),
    ] = None
    window: Annotated[str, typer.Option(metavar="NAME", help="Any SciPy window.")] = "hann"
    overlap: Annotated[float, typer.Option(metavar="SHARE", help="Overlap of segments, 0 to 1.")] = 0.5
    time_constant: Annotated[
        float, typer.Option(metavar="S", help="After so long a segment has faded to 1/e in exponential averages.")
    ] = 10.0
    modes_every: Annotated[
        float, typer.Option(metavar="S", help="How often modes are looked for in responses alone; 0 for never.")
    ] = 5.0
    machine: Annotated[
        MachineName | None,
        typer.Option(help="Class and foundation, for the zone of ISO 20816-3.", show_default=False),
    ] = None
    robot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Robot file, URDF or MJCF: the torque that it doesn't explain.", show_default=False
        ),
    ] = None
    setup: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Setup file: points, directions, units, sensitivities.", show_default=False
        ),
    ] = None
    stamp: Annotated[
        Literal["auto", "header", "publish", "log"],
        typer.Option(help="The time of a sample: its own stamp, when published, when logged."),
    ] = "auto"
    rate: options.Rate = None
    end_after: Annotated[
        float | None,
        typer.Option(metavar="S", help="End when nothing came for so long; else wait for ever.", show_default=False),
    ] = None

    def states(self, source: str, stop: threading.Event) -> "Iterator[LiveState]":
        """Follow a source so."""
        from chladni.apps.live import live as follow

        return follow(
            source,
            channels=self.channel,
            references=self.reference,
            band_hz=self.band,
            resolution_hz=self.resolution,
            window=self.window,
            overlap=self.overlap,
            time_constant_s=self.time_constant,
            modes_every_s=self.modes_every,
            machine=self.machine,
            robot=self.robot,
            setup=self.setup,
            stamp=self.stamp,
            sample_rate_hz=self.rate,
            patience_s=self.end_after,
            stop=stop,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Showing:
    """Where states are drawn to as they come."""

    view: Annotated[
        bool | None,
        typer.Option("--view/--no-view", help="Open the viewer; it is, unless --save or --web is given."),
    ] = None
    save: Annotated[
        Path | None,
        typer.Option(metavar="OUT.rrd", help="Write a recording as samples come.", show_default=False),
    ] = None
    keep: Annotated[
        float, typer.Option(metavar="MB", help="The recording takes so many megabytes at most; 0 for no bound.")
    ] = 4000.0
    web: Annotated[bool, typer.Option("--web", help="Serve to a browser on this computer only.")] = False

    def __post_init__(self) -> None:
        from chladni.signals.errors import SetupError

        if not (self.keep == 0 or 10 <= self.keep < float("inf")):
            raise SetupError(
                f"--keep {self.keep:g} MB is too little for a recording; give 10 or more, or 0 for no bound"
            )
        if self.save is not None and self.web:
            raise SetupError("--save writes a file and --web serves a page; give one of them")

    def targets(self, out: Output) -> "list[Target]":
        """Open them."""
        from chladni.viewers.rerun.live_targets import RecordingFile, Viewer

        targets: list[Target] = []
        if self.save is not None:
            targets.append(RecordingFile(self.save, keep_bytes=round(self.keep * MEGABYTE) or None))
        if self.web:
            served = Viewer(web=True)
            targets.append(served)
            out.line(f"{served.address}")
            out.line("Open this address in a browser on this computer (nobody else can reach it); Ctrl-C ends.")
        elif self.save is None if self.view is None else self.view:
            targets.append(Viewer())
        return targets


@opens_files
def live(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="An MCAP log that is being written; - for MCAP on standard input; ws://HOST:PORT, a Foxglove "
            "server; audio:DEVICE.",
            show_default=False,
        ),
    ],
    *,
    following: Following,
    showing: Showing,
    json: options.Json = None,
    figures: options.Figures = None,
    report: options.Report = None,
) -> None:
    """Averages, modes and what changes, of a log that is being written; Ctrl-C ends it with everything written."""
    from chladni.apps.live_document import EventBook, live_document, live_study
    from chladni.signals.process_memory import return_memory

    is_file = source != "-" and "://" not in source and not source.startswith("audio:")
    require_places(
        reads=[Path(source) if is_file else None, following.setup, following.robot],
        writes={"--json": json, "--save": showing.save, "--report": report},
        folders={"--figures": figures},
    )
    out, book = Output(json), EventBook()
    return_memory()
    # Samples, pictures and modes take turns at Python's lock: shorter turns, sooner pictures.
    sys.setswitchinterval(TURN_S)
    with _stopping() as stop:
        last = _follow(following.states(source, stop), out, book, showing.targets(out))
    findings = _told(out, last, book)
    out.pictures(live_study(last, findings), figures=figures, report=report)
    out.json(live_document, last, book)


def _follow(states: "Iterator[LiveState]", out: Output, book: "EventBook", targets: "list[Target]") -> "LiveState":
    """Show states until the last, which is given back."""
    from chladni.signals.live_state import LiveEvent, LiveState
    from chladni.viewers.rerun.live_targets import Painter

    painters = [Painter(target) for target in targets]
    last, said = LiveState(title=""), False
    try:
        for last in states:
            said = said or _greet(out, last)
            told = [text for painter in painters for text in painter.show(last)]
            _say(out, book, (*last.events, *(LiveEvent(kind="source", time_s=last.time_s, text=one) for one in told)))
    finally:
        for painter in painters:
            for text in painter.close():
                _say(out, book, (LiveEvent(kind="source", time_s=last.time_s, text=text),))
        _places(out, painters)
    return last


def _places(out: Output, painters: "list[Painter]") -> None:
    from chladni.viewers.rerun.live_targets import RecordingFile

    for painter in painters:
        target = painter.target
        if isinstance(target, RecordingFile):
            earlier = f", and before it {target.earlier}" if target.earlier.exists() else ""
            out.line(f"recording: {target.path}{earlier}")


def _greet(out: Output, state: "LiveState") -> bool:
    """Say what is followed, once samples come."""
    if not state.series:
        return False
    for series in state.series:
        names = ", ".join(channel.name for channel in series.channels[:6])
        more = f" and {len(series.channels) - 6} more" if len(series.channels) > 6 else ""
        out.line(f"{state.title}: {number(series.sample_rate_hz)} Hz, {names}{more}; Ctrl-C ends")
    return True


def _say(out: Output, book: "EventBook", events: Any) -> None:
    book.add(events)
    for event in events:
        out.line(f"{event.time_s:10.2f} s  {event.text}")


def _told(out: Output, state: "LiveState", book: "EventBook") -> tuple[str, ...]:
    """Print what the averages have come to."""
    from chladni.apps.live_document import still_channels

    still = still_channels(state)
    for density, levels in zip(state.densities, state.levels, strict=False):
        out.table(
            f"Levels after {state.time_s:.1f} s, {counted(density.provenance.averages, 'average')}",
            ["channel", "RMS", "unit", "peak", "crest factor", "kurtosis"],
            [
                [
                    channel.name,
                    with_error(float(levels.rms[row, 0]), float(levels.rms_std[row, 0])),
                    unit(channel.unit),
                    number(float(levels.peak[row, 0])),
                    number(float(levels.crest_factor[row, 0])),
                    number(float(levels.kurtosis[row, 0])),
                ]
                for row, channel in enumerate(levels.channels)
                if channel.name not in still
            ],
        )
    if state.tracked:
        out.table(
            "Modes of the present, from responses alone",
            ["mode", "frequency [Hz]", "damping ratio [%]", "MAC", "seen"],
            [
                [
                    str(mode.number),
                    with_error(mode.frequency_hz, mode.frequency_std_hz),
                    with_error(100 * mode.damping_ratio, 100 * mode.damping_std),
                    f"{mode.mac:.2f}",
                    str(mode.looks),
                ]
                for mode in state.tracked
            ],
        )
    notes = {note: None for density in state.densities for note in density.provenance.notes}
    return (*(f"{event.time_s:.2f} s: {event.text}" for event in book.events[-40:]), *notes)


@contextmanager
def _stopping() -> Iterator[threading.Event]:
    """Let the first Ctrl-C, SIGTERM or SIGHUP end the averages in order; a second one ends the program."""
    stop = threading.Event()
    before: dict[int, Any] = {}

    def end(which: int, _frame: Any) -> None:
        if stop.is_set():
            signal.signal(which, before.get(which) or signal.SIG_DFL)
            signal.raise_signal(which)
        stop.set()
        # Who sees nothing for seconds presses again, and then nothing is written. `print` isn't safe in here.
        with suppress(OSError):
            os.write(2, ENDING)

    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            which = getattr(signal, name, None)
            if which is not None and signal.getsignal(which) != signal.SIG_IGN:
                before[which] = signal.signal(which, end)
    try:
        yield stop
    finally:
        for which, handler in before.items():
            signal.signal(which, handler)

"""The bench: pages of the virtual instruments, with everything that they can do."""

from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chladni.apps.bench_exports import exports
from chladni.apps.measured_log import OpenedLog, assign, compare, terminals
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.reading import InfluenceTable, InstrumentReading
from chladni.viewers.bench import instrument_panel, serve
from chladni.viewers.bench.tools import MeasuredLog, Rows, Tools, Variant

if TYPE_CHECKING:
    from chladni.viewers.bench.server import BenchServer
    from chladni.viewers.bench.theme import Ground


def open_bench(
    instruments: Iterable[Instrument],
    *,
    port: int = 0,
    log: Path | None = None,
    reading: Mapping[str, Any] | None = None,
    variants: Path | None = None,
) -> "BenchServer":
    """Give a server of the pages of these instruments, bound to this computer only.

    Parameters
    ----------
    instruments
        A page is made of each.
    port
        0 takes a free one.
    log
        Log or data file that every page holds beside its simulation.
    reading
        How it and those dropped on a page are read: options of `chladni.open`.
    variants
        CSV or TOML file of rows, each a variant; read again whenever it changes.

    Returns
    -------
    BenchServer
        ``address`` is where it's reached; ``run()`` serves until ``stop()`` or Ctrl-C.

    Raises
    ------
    SetupError
        When Panel isn't installed, or the port is taken.
    LogError
        When the log can't be read.
    """
    if log is not None:
        # Told here, in the terminal, rather than on a page that has to be opened first.
        OpenedLog(log, log.name, private=False, reading=reading).close()
    return serve(instruments, tools(reading), port=port, log=log, variants=variants)


def notebook(
    instrument: Instrument,
    *,
    log: Path | None = None,
    reading: Mapping[str, Any] | None = None,
    variants: Path | None = None,
    ground: "Ground" = "light",
) -> Any:
    """Give the page of an instrument as a Panel object, which a notebook shows when it's the last word of a cell.

    Parameters
    ----------
    instrument
        Such as ``chladni.models.instruments.pneumatic_motor.INSTRUMENT``.
    log
        Log or data file to hold beside the simulation.
    reading
        How it is read: options of `chladni.open`.
    variants
        CSV or TOML file of rows, each a variant.
    ground
        ``light`` or ``dark``.

    Raises
    ------
    SetupError
        When Panel isn't installed.
    """
    return instrument_panel(instrument, tools(reading), ground=ground, log=log, variants=variants)


def tools(reading: Mapping[str, Any] | None = None) -> Tools:
    """Give what pages call; `reading` says how logs are opened."""

    def open_log(path: Path, title: str, private: bool) -> MeasuredLog:
        return OpenedLog(path, title, private=private, reading=reading)

    return Tools(
        read=_read,
        influence=_influence,
        watch=_watch,
        open_log=open_log,
        terminals=terminals,
        assign=assign,
        compare=compare,
        exports=exports(),
    )


def _read(
    instrument: Instrument, values: Values, options: Options, charts: Collection[str] | None
) -> InstrumentReading:
    from chladni.models.analysis.instrument_reading import read_instrument

    return read_instrument(instrument, values, options, charts=charts)


def _influence(instrument: Instrument, values: Values, options: Options) -> InfluenceTable:
    from chladni.models.analysis.influence import influence

    return influence(instrument, values, options)


def _watch(instrument: Instrument, path: Path) -> Callable[[], Rows]:
    from chladni.models.files.variants_file import VariantsWatch

    # The watch remembers the last right state, so that it lives as long as the page.
    watch = VariantsWatch(path, instrument.parameters, instrument.options)
    # A row says only what differs.
    numbers = instrument.parameters.numbers()
    words = {option.name: option.default for option in instrument.options}

    def look() -> Rows:
        state = watch.poll()
        rows = (
            Variant(label=row.name, values={**numbers, **row.values}, options={**words, **row.options})
            for row in state.variants
        )
        return Rows(variants=tuple(rows), mistake=state.mistake)

    return look

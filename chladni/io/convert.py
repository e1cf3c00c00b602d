"""Convert between MCAP logs and the files of other tools."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chladni.io.atomic import Place, require_place
from chladni.io.files.formats import MCAP, WRITTEN_SUFFIXES, call_with_options, writer_of
from chladni.io.log import Log, open_log
from chladni.io.loss import Unread
from chladni.io.regular_file import require_regular
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

if TYPE_CHECKING:
    from chladni.signals.join import JoinMethod


@dataclass(frozen=True, slots=True, kw_only=True)
class Conversion:
    """What a conversion wrote.

    Attributes
    ----------
    source, target
        The files.
    channels
        Names of the channels in the target, as they are read back.
    samples
        Samples of all channels together, missing ones included.
    duration_s
        From the first sample of all to the end of the last.
    losses
        Sentences on what the target doesn't hold or calls otherwise.
    notes
        Sentences on what was inferred from the source or left out of it.
    unread
        What of the source no channel was made of; none where channels were named.
    """

    source: Path
    target: Path
    channels: tuple[str, ...]
    samples: int
    duration_s: float
    losses: tuple[str, ...]
    notes: tuple[str, ...]
    unread: tuple[Unread, ...] = ()


def convert(
    source: Path | str,
    target: Path | str,
    *,
    channels: Sequence[str] | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    sample_rate_hz: float | None = None,
    resample_hz: float | None = None,
    join: "JoinMethod" = "auto",
    layout: str | None = None,
    overwrite: bool = False,
    reading: Mapping[str, Any] | None = None,
    writing: Mapping[str, Any] | None = None,
) -> Conversion:
    """Convert a log or data file to another kind; the kinds are told by the suffixes.

    Parameters
    ----------
    source, target
        ``.mcap`` or one of `chladni.io.files.formats.FILE_SUFFIXES`; a target one of `WRITTEN_SUFFIXES` there.
    channels
        Names of the channels to convert; all by default.
    start_s, end_s
        Time window, seconds from the first sample.
    sample_rate_hz
        True rate of the samples, where the source doesn't say it; nothing is resampled.
    resample_hz
        Bring all channels to this rate.
    join
        How, see `chladni.signals.join.join_resampled`: ``band-limited``, ``hold``, or what each channel tells.
    layout
        Of a log: ``messages`` or ``batches``, see `chladni.io.mcap.writer.write_mcap`. By default messages, when all
        names are message paths, else batches, which keep any name.
    overwrite
        Whether an existing target may be replaced.
    reading, writing
        Options of the reader and the writer, such as ``{"time_unit": "ms"}`` of `read_csv`,
        ``{"full_scale": "10 V"}`` of `read_wav`, ``{"binary": False}`` of `write_uff`.

    Raises
    ------
    LogError
        When the source can't be read, the target exists, or a kind can't hold the channels.
    SetupError
        When a suffix or an option isn't known.
    """
    source, target = Path(source), Path(target)
    _require_paths(source, target, overwrite=overwrite)
    rate = {} if sample_rate_hz is None else {"sample_rate_hz": sample_rate_hz}
    with open_log(source, **{**(reading or {}), **rate}) as log:
        series, notes = _read(log, channels, start_s, end_s, resample_hz, join)
        unread = log.unread if channels is None else ()
    options = dict(writing or {}) | ({} if layout is None else {"layout": layout})
    names, losses = _write(series, target, overwrite=overwrite, options=options)
    return Conversion(
        source=source,
        target=target,
        channels=names,
        samples=sum(part.values.size for part in series),
        duration_s=_duration_s(series),
        losses=losses,
        notes=tuple(f"{source}: {note}" for note in notes),
        unread=unread,
    )


def _require_paths(source: Path, target: Path, *, overwrite: bool) -> None:
    written = (MCAP, *WRITTEN_SUFFIXES)
    if target.suffix.lower() not in written:
        raise SetupError(f"{target}: the suffix {target.suffix!r} isn't written; supported are {', '.join(written)}")
    require_regular(source, LogError)
    # Said before the question of overwriting, whose answer would destroy the source.
    if Place.of(target).is_same(Place.of(source)):
        raise SetupError(f"{target}: is the source itself; name another target")
    require_place(target, overwrite=overwrite)


def _read(
    log: Log,
    channels: Sequence[str] | None,
    start_s: float | None,
    end_s: float | None,
    resample_hz: float | None,
    join: "JoinMethod",
) -> tuple[tuple[TimeSeries, ...], tuple[str, ...]]:
    """Give the series, and sentences on what was inferred or lost."""
    series = log.read_groups(channels, start_s=start_s, end_s=end_s, one_clock=resample_hz is not None)
    notes = (*(loss.what for loss in log.damage), *log.notes)
    if resample_hz is None:
        return series, notes
    from chladni.signals.join import join_note, join_resampled

    found = join_resampled(series, sample_rate_hz=resample_hz, method=join)
    joined = found.series if channels is None else found.series.select(log.names(channels))
    return (joined,), (*notes, join_note(series, found))


def _write(
    series: tuple[TimeSeries, ...], target: Path, *, overwrite: bool, options: dict[str, Any]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Write, and give the names in the target and the losses."""
    names = tuple(channel.name for part in series for channel in part.channels)
    if target.suffix.lower() == MCAP:
        from chladni.io.mcap.writer import write_mcap

        series, shifted = _since_1970(series)
        # Message paths come from a log and fit messages; other names only fit the columns of a batch.
        options.setdefault("layout", "messages" if all(name.startswith("/") for name in names) else "batches")
        written = call_with_options(write_mcap, series, {"path": target, "overwrite": overwrite} | options)
        renamed = tuple(f"{old}: called {new} in the log." for old, new in written.names.items() if old != new)
        return tuple(written.names[name] for name in names), shifted + renamed
    losses: tuple[str, ...] = call_with_options(
        writer_of(target), series, {"path": target, "overwrite": overwrite} | options
    )
    return names, losses


def _since_1970(series: tuple[TimeSeries, ...]) -> tuple[tuple[TimeSeries, ...], tuple[str, ...]]:
    """Shift series that start before time 0, which a log can't stamp: a pretrigger, or jitter about a start at 0."""
    first_ns = min((part.start_time_ns for part in series), default=0)
    if first_ns >= 0:
        return series, ()
    shifted = tuple(replace(part, start_time_ns=part.start_time_ns - first_ns) for part in series)
    return shifted, (f"All times are {-first_ns / 1e9:g} s later in the log, which holds none before 0.",)


def _duration_s(series: tuple[TimeSeries, ...]) -> float:
    first_ns = min((part.start_time_ns for part in series), default=0)
    return max(((part.start_time_ns - first_ns) / 1e9 + part.duration_s for part in series), default=-inf)

"""Convert between MCAP logs and the files of other tools."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any, Final

from chladni.io.files.contents import FileContents
from chladni.io.mcap.log_file import DATA_SUFFIXES
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

LOG_SUFFIX = ".mcap"
FILE_SUFFIXES: Final = DATA_SUFFIXES
"""Suffixes of data files that are read and written, besides that of logs."""


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
    """

    source: Path
    target: Path
    channels: tuple[str, ...]
    samples: int
    duration_s: float
    losses: tuple[str, ...]
    notes: tuple[str, ...]


def convert(
    source: Path | str,
    target: Path | str,
    *,
    channels: Sequence[str] | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    sample_rate_hz: float | None = None,
    layout: str | None = None,
    overwrite: bool = False,
    reading: Mapping[str, Any] | None = None,
    writing: Mapping[str, Any] | None = None,
) -> Conversion:
    """Convert a log or data file to another kind; the kinds are told by the suffixes.

    Parameters
    ----------
    source, target
        One of ``.mcap``, ``.csv``, ``.txt``, ``.wav``, ``.mat``, ``.npz``, ``.uff``, ``.unv`` each.
    channels
        Names of the channels to convert; all by default.
    start_s, end_s
        Time window, seconds from the first sample.
    sample_rate_hz
        From a log: rate to bring all channels to. From a file without time base: the rate of its rows.
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
    contents = _read(source, channels, start_s, end_s, sample_rate_hz, dict(reading or {}))
    options = dict(writing or {}) | ({} if layout is None else {"layout": layout})
    names, losses = _write(contents.series, target, overwrite=overwrite, options=options)
    return Conversion(
        source=source,
        target=target,
        channels=names,
        samples=sum(part.values.size for part in contents.series),
        duration_s=_duration_s(contents.series),
        losses=losses,
        notes=contents.notes,
    )


def _require_paths(source: Path, target: Path, *, overwrite: bool) -> None:
    for path in (source, target):
        if path.suffix.lower() not in (LOG_SUFFIX, *FILE_SUFFIXES):
            raise SetupError(
                f"{path}: the suffix {path.suffix!r} isn't known; supported are "
                f"{', '.join((LOG_SUFFIX, *FILE_SUFFIXES))}"
            )
    if not source.is_file():
        raise LogError(f"{source}: no such file")
    # Said before the question of overwriting, whose answer would destroy the source.
    if target.exists() and target.samefile(source):
        raise SetupError(f"{target}: is the source itself; name another target")
    if target.exists() and not overwrite:
        raise LogError(f"{target}: exists already; ask for overwriting (--overwrite) or name another file")


def _read(
    source: Path,
    channels: Sequence[str] | None,
    start_s: float | None,
    end_s: float | None,
    sample_rate_hz: float | None,
    options: dict[str, Any],
) -> FileContents:
    if source.suffix.lower() == LOG_SUFFIX:
        return _read_log(source, channels, start_s, end_s, sample_rate_hz, options)
    if sample_rate_hz is not None:
        options["sample_rate_hz"] = sample_rate_hz
    contents: FileContents = _call(_reader(source), source, options)
    return FileContents(series=_cut(source, contents.series, channels, start_s, end_s), notes=contents.notes)


def _read_log(
    source: Path,
    channels: Sequence[str] | None,
    start_s: float | None,
    end_s: float | None,
    sample_rate_hz: float | None,
    options: dict[str, Any],
) -> FileContents:
    from chladni.io.log import open_log

    with _call(open_log, source, options) as log:
        one_clock = sample_rate_hz is not None
        series = tuple(log.read_groups(channels, start_s=start_s, end_s=end_s, one_clock=one_clock))
        notes = tuple(f"{source}: {loss.what}" for loss in log.damage)
        if sample_rate_hz is None:
            return FileContents(series=series, notes=notes)
        joined, note = _on_one_grid(series, sample_rate_hz)
        return FileContents(
            series=(joined if channels is None else joined.select(log.names(channels)),), notes=(*notes, note)
        )


def _on_one_grid(series: tuple[TimeSeries, ...], sample_rate_hz: float) -> tuple[TimeSeries, str]:
    """Resample, and say how true that is and what it costs."""
    from chladni.signals.resampling import join_resampled

    found = join_resampled(series, sample_rate_hz=sample_rate_hz)
    valid_s = [seconds for part in series for seconds in _valid_s(part)]
    lost_s = max(before - after for before, after in zip(valid_s, _valid_s(found.series), strict=True))
    note = (
        f"resampled to {sample_rate_hz:g} Hz: true to {found.error:.1g} of the amplitude up to "
        f"{found.usable_hz:.4g} Hz, falling off above"
    )
    if lost_s * sample_rate_hz > 1:
        note += f"; up to {lost_s:.3g} s of a channel are left out: at its ends, at gaps, and where others have none"
    return found.series, note


def _valid_s(part: TimeSeries) -> list[float]:
    """Seconds of samples that each channel has."""
    if part.valid is None:
        return [part.duration_s] * len(part.channels)
    return [int(count) / part.sample_rate_hz for count in part.valid.sum(axis=1)]


def _cut(
    source: Path,
    series: tuple[TimeSeries, ...],
    channels: Sequence[str] | None,
    start_s: float | None,
    end_s: float | None,
) -> tuple[TimeSeries, ...]:
    known = [channel.name for part in series for channel in part.channels]
    unknown = [name for name in channels or () if name not in known]
    if unknown:
        raise LogError(f"{source}: no channel {unknown[0]!r}; channels: {', '.join(known)}")
    if channels is not None:
        wanted = [[name for name in channels if name in {c.name for c in part.channels}] for part in series]
        series = tuple(part.select(names) for part, names in zip(series, wanted, strict=True) if names)
    if start_s is None and end_s is None:
        return series
    # One clock for all series of a file: seconds count from the earliest sample, as in a log.
    origin_ns = min(part.start_time_ns for part in series)
    return tuple(_window(part, origin_ns, start_s, end_s) for part in series)


def _window(part: TimeSeries, origin_ns: int, start_s: float | None, end_s: float | None) -> TimeSeries:
    offset_s = (part.start_time_ns - origin_ns) / 1e9
    return part.window(
        start_s=None if start_s is None else start_s - offset_s, end_s=None if end_s is None else end_s - offset_s
    )


def _write(
    series: tuple[TimeSeries, ...], target: Path, *, overwrite: bool, options: dict[str, Any]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Write, and give the names in the target and the losses."""
    names = tuple(channel.name for part in series for channel in part.channels)
    if target.suffix.lower() == LOG_SUFFIX:
        from chladni.io.mcap.writer import write_mcap

        series, shifted = _since_1970(series)
        # Message paths come from a log and fit messages; other names only fit the columns of a batch.
        options.setdefault("layout", "messages" if all(name.startswith("/") for name in names) else "batches")
        written = _call(write_mcap, series, {"path": target, "overwrite": overwrite} | options)
        renamed = tuple(f"{old}: called {new} in the log." for old, new in written.names.items() if old != new)
        return tuple(written.names[name] for name in names), shifted + renamed
    losses: tuple[str, ...] = _call(_writer(target), series, {"path": target, "overwrite": overwrite} | options)
    return names, losses


def _since_1970(series: tuple[TimeSeries, ...]) -> tuple[tuple[TimeSeries, ...], tuple[str, ...]]:
    """Shift series that start before time 0, which a log can't stamp: a pretrigger, or jitter about a start at 0."""
    first_ns = min((part.start_time_ns for part in series), default=0)
    if first_ns >= 0:
        return series, ()
    shifted = tuple(replace(part, start_time_ns=part.start_time_ns - first_ns) for part in series)
    return shifted, (f"All times are {-first_ns / 1e9:g} s later in the log, which holds none before 0.",)


def _call(function: Callable[..., Any], first: object, options: dict[str, Any]) -> Any:
    """Call a reader or writer, with an option it doesn't have turned into one line."""
    # Options come from the command line by name: a wrong one is an input error, not a defect of chladni.
    from inspect import signature

    known = [name for name in signature(function).parameters if name not in ("path", "series")]
    for name in options:
        if name not in signature(function).parameters:
            raise SetupError(f"{function.__name__} has no option {name!r}; it has {', '.join(known)}")
    return function(first, **options)


def _reader(path: Path) -> Callable[..., FileContents]:
    from chladni.io.files import csv, mat, npz, uff, wav

    suffix = path.suffix.lower()
    readers: dict[str, Callable[..., FileContents]] = {
        ".wav": wav.read_wav,
        ".mat": mat.read_mat,
        ".npz": npz.read_npz,
        ".uff": uff.read_uff,
        ".unv": uff.read_uff,
    }
    return readers.get(suffix, csv.read_csv)


def _writer(path: Path) -> Callable[..., tuple[str, ...]]:
    from chladni.io.files import csv, mat, npz, uff, wav

    suffix = path.suffix.lower()
    writers: dict[str, Callable[..., tuple[str, ...]]] = {
        ".wav": wav.write_wav,
        ".mat": mat.write_mat,
        ".npz": npz.write_npz,
        ".uff": uff.write_uff,
        ".unv": uff.write_uff,
    }
    return writers.get(suffix, csv.write_csv)


def _duration_s(series: tuple[TimeSeries, ...]) -> float:
    first_ns = min((part.start_time_ns for part in series), default=0)
    return max(((part.start_time_ns - first_ns) / 1e9 + part.duration_s for part in series), default=-inf)

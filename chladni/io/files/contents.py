"""What a data file holds, and the way of its columns to SI."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.repeats import digests_of, repeats_of
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted

if TYPE_CHECKING:
    from chladni.io.clock.time_base import TimeBase
    from chladni.signals.frequency_response import FrequencyResponse
    from chladni.signals.mode_set import ModeSet

# As for the topics of a log, see `chladni.io.shared_grid`: points of one grid are never farther apart than this share
# of a period, and a grid isn't this many times as long as the samples on it.
_ALIGNED, _SPARSE = 0.01, 100


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FileContents:
    """The time series of a data file, and what else it holds.

    Attributes
    ----------
    series
        One for each sample rate, start and length.
    notes
        Sentences on what was inferred or left out.
    unread
        (name, reason) of each part that was left out: a column of text, an object of MATLAB.
    time_bases
        What the file's own times say about the clock of each series, None where it states a rate instead; one for
        each series, or empty when the file has no times at all.
    functions, modes
        Frequency responses and modes that the file holds ready-made; None when there are none.
    geometry
        Measurement points and lines, where the file has them.
    """

    series: tuple[TimeSeries, ...]
    notes: tuple[str, ...] = ()
    unread: tuple[tuple[str, str], ...] = ()
    time_bases: tuple["TimeBase | None", ...] = ()
    functions: "FrequencyResponse | None" = None
    modes: "ModeSet | None" = None
    geometry: Geometry = field(default_factory=Geometry)


def with_notes(contents: FileContents, notes: Iterable[str]) -> FileContents:
    """Put notes before those that there are."""
    return replace(contents, notes=(*notes, *contents.notes))


NOTHING: Final = FileContents(series=())
"""What a part of a file holds of which nothing is told."""


def joined(parts: Sequence[FileContents]) -> FileContents:
    """Put what several parts of a file hold into one."""
    return FileContents(
        series=tuple(series for part in parts for series in part.series),
        notes=tuple(note for part in parts for note in part.notes),
        unread=tuple(left_out for part in parts for left_out in part.unread),
        time_bases=tuple(base for part in parts for base in part.time_bases or (None,) * len(part.series)),
    )


def unit_in_si(name: str, label: str) -> tuple[float, str]:
    """Give the factor to SI and the SI unit of a column by its label; its name settles what a label may mean.

    Raises
    ------
    SetupError
        When the label is no unit, or leaves the unit open.
    """
    from chladni.signals.unit_labels import quantity_of_name, read_label

    return read_label(label, quantity=quantity_of_name(name))


def _unit_of_channel(channel: Channel) -> tuple[float, str]:
    try:
        return unit_in_si(channel.name, channel.unit)
    except SetupError as error:
        raise SetupError(f"channel {channel.name!r}: {error}; or state its unit yourself") from error


def unit_of(name: str, found: str | None, units: Mapping[str, str] | None) -> str:
    """Give the unit that the caller states for a column, else the one `found` in the file, else ``1``."""
    return (units or {}).get(name, found or "1")


def series_of_rows(
    rows: Sequence[NDArray[Any]],
    channels: Sequence[Channel],
    *,
    sample_rate_hz: float,
    start_time_ns: int = 0,
) -> TimeSeries:
    """Stack rows whose units are any into one series in SI; samples that are no finite numbers count as missing."""
    units = [_unit_of_channel(channel) for channel in channels]
    # Row by row into place: of large files there is no third copy. Integers become double, which has 53 bits of them.
    single = all(row.dtype == np.float32 for row in rows)
    values = np.empty((len(rows), len(rows[0])), np.float32 if single else np.float64)
    for place, (row, (factor, _)) in enumerate(zip(rows, units, strict=True)):
        # A damaged row may hold what no processor casts without a word; it counts as missing.
        with np.errstate(invalid="ignore", over="ignore"):
            values[place] = row
            # Values already in SI stay untouched, to the bit.
            if factor != 1.0:
                values[place] *= factor
    return TimeSeries(
        values=values,
        sample_rate_hz=sample_rate_hz,
        start_time_ns=start_time_ns,
        channels=tuple(replace(channel, unit=unit) for channel, (_, unit) in zip(channels, units, strict=True)),
        valid=finite_mask(values),
    )


def finite_mask(values: NDArray[np.floating]) -> Mask | None:
    """Mark the finite values; None when all are."""
    finite = np.isfinite(values)
    return None if finite.all() else finite


def placed_rows(
    stamps_ns: Whole,
    rows: Sequence[NDArray[np.floating]],
    channels: Sequence[Channel],
    *,
    where: str,
) -> FileContents:
    """Put rows sampled at the given times on a uniform grid, in SI; what's missing in between becomes a gap.

    Raises
    ------
    LogError
        When the times have no rate, or are too few to tell one.
    """
    from chladni.io.clock.clock_verdict import breaks_sentence
    from chladni.io.clock.uniform import place

    # A record with a pretrigger begins before 0, which no clock does: the fit is about differences only.
    origin_ns = int(stamps_ns.min(initial=2**62))
    try:
        kept, base = _fitted(stamps_ns - origin_ns, np.stack(rows))
        again = stamps_ns.size - kept.size
        stamps_ns, rows = stamps_ns[kept], [row[kept] for row in rows] if again else rows
        grid = place(
            stamps_ns - origin_ns, np.stack(rows), base, channels=tuple(channels), max_samples=_most_values(rows)
        )
    except EstimateError as error:
        raise LogError(f"{where}: the times don't make a sampled signal: {error}") from error
    series = series_of_rows(
        list(grid.values),
        channels,
        sample_rate_hz=grid.sample_rate_hz,
        start_time_ns=grid.start_time_ns + origin_ns,
    )
    notes = [] if base.verdict == "regular" else [f"{where}: the times are {base.verdict}: {base.advice}."]
    if len(base.breaks_s):
        notes.append(f"{where}: {breaks_sentence(base)}.")
    there = np.isfinite(rows).any(axis=0)
    lost = int(np.delete(there, base.strays).sum() - np.isfinite(grid.values).any(axis=0).sum())
    if base.strays.size:
        notes.append(
            f"{where}: {counted(base.strays.size, 'row')} left out, whose time contradicts the count of rows around."
        )
    if again:
        notes.append(f"{where}: {counted(again, 'row')} left out: another one has the same time and the same values.")
    if lost:
        notes.append(f"{where}: {counted(lost, 'sample')} left out: another one came at the same time.")
    base = replace(base, samples=base.samples + again, duplicates=base.duplicates + again)
    return FileContents(series=(series,), notes=tuple(notes), time_bases=(base,))


def _fitted(stamps_ns: Whole, values: NDArray[np.floating]) -> tuple[Whole, "TimeBase"]:
    """Fit a clock to the rows that aren't written twice; give these rows as well."""
    from chladni.io.clock.time_base import fit_time_base

    everything = np.arange(stamps_ns.size)
    repeats = repeats_of(stamps_ns, digests_of(values if values.dtype.kind == "f" else values.astype(np.float64)))
    if repeats is None:
        return everything, fit_time_base(stamps_ns)
    if repeats.differ:
        # Rows of one time that differ are samples; then those that don't may be, too.
        base = fit_time_base(stamps_ns)
        if base.uniform and not base.duplicates:
            return everything, base
    kept = np.flatnonzero(repeats.twin == everything)
    return kept, fit_time_base(stamps_ns[kept])


def on_common_grids(series: Sequence[TimeSeries]) -> tuple[TimeSeries, ...]:
    """Bring series whose samples fall on the points of one grid together; what one doesn't cover is missing there."""
    groups: list[list[TimeSeries]] = []
    for part in series:
        home = next((group for group in groups if _share_a_grid([*group, part])), None)
        if home is None:
            groups.append([part])
        else:
            home.append(part)
    return tuple(group[0] if len(group) == 1 else _laid_together(group) for group in groups)


def _share_a_grid(parts: Sequence[TimeSeries]) -> bool:
    """Whether the grids run together all along, and their span isn't mostly empty."""
    first, last = parts[0], parts[-1]
    offset = _offset(first, last)
    drift = abs(first.sample_rate_hz / last.sample_rate_hz - 1) * max(first.samples, last.samples)
    if abs(offset - round(offset)) + drift > _ALIGNED:
        return False
    places = [(round(_offset(first, part)), part.samples) for part in parts]
    length = max(place + samples for place, samples in places) - min(place for place, _ in places)
    # Two recordings that lie hours apart aren't one measurement.
    return length <= _SPARSE * sum(samples for _, samples in places)


def _offset(first: TimeSeries, other: TimeSeries) -> float:
    """Samples from the first one's start to the other's."""
    return (other.start_time_ns - first.start_time_ns) / NS_PER_S * first.sample_rate_hz


def _laid_together(parts: Sequence[TimeSeries]) -> TimeSeries:
    offsets = [round(_offset(parts[0], part)) for part in parts]
    begin = min(offsets)
    length = max(offset + part.samples for offset, part in zip(offsets, parts, strict=True)) - begin
    rows = sum(len(part.channels) for part in parts)
    values = np.full((rows, length), np.nan, np.result_type(*(part.values.dtype for part in parts)))
    row = 0
    for offset, part in zip(offsets, parts, strict=True):
        known = part.values if part.valid is None else np.where(part.valid, part.values, np.nan)
        values[row : row + len(part.channels), offset - begin : offset - begin + part.samples] = known
        row += len(part.channels)
    return TimeSeries(
        values=values,
        sample_rate_hz=parts[0].sample_rate_hz,
        start_time_ns=parts[offsets.index(begin)].start_time_ns,
        channels=tuple(channel for part in parts for channel in part.channels),
        valid=finite_mask(values),
    )


def one_line(said: object) -> str:
    r"""Give the start of what a library says of a file as one line: it may hold the file's own bytes.

    Examples
    --------
    >>> one_line(ValueError("bad name 'a\x00b'\nand more"))
    "bad name 'a.b'"
    """
    line = str(said).partition("\n")[0][:120]
    return "".join(letter if letter.isprintable() else "." for letter in line)


def one_series(series: Iterable[TimeSeries], kind: str) -> TimeSeries:
    """Give the only series of a file kind that holds one rate; `LogError` naming the rates when there are more."""
    parts = tuple(series)
    if len(parts) != 1:
        rates = ", ".join(f"{part.sample_rate_hz:g} Hz from {part.start_time_ns} ns" for part in parts) or "none"
        raise LogError(
            f"{kind} holds channels of one rate and start, here are {len(parts)} groups ({rates}); choose channels "
            "of one group (--channel NAME), or have them brought to one sample rate (--resample HZ)"
        )
    return parts[0]


def require_no_gaps(series: TimeSeries, kind: str) -> None:
    """Raise `LogError` when a sample is missing and the file kind has no way to say so."""
    missing = ~np.isfinite(series.values)
    if series.valid is not None:
        missing |= ~series.valid
    for row, channel in enumerate(series.channels):
        if missing[row].any():
            first_s = int(np.argmax(missing[row])) / series.sample_rate_hz
            raise LogError(
                f"{channel.name}: {int(missing[row].sum())} samples are missing, the first at {first_s:g} s, and "
                f"{kind} can't mark a gap; choose a stretch without one, or convert to mcap, csv, mat or npz"
            )


def times_to_ns(times: Real, *, unit_ns: int = NS_PER_S, start_ns: int = 0, where: str) -> Whole:
    """Round times to whole nanoseconds since 1970; `LogError` for what is no time within centuries."""
    largest = float(np.abs(times).max(initial=0.0)) * unit_ns + abs(start_ns)
    if not largest < 2**62:
        raise LogError(f"{where}: the times aren't all numbers within 146 years of 1970")
    return np.rint(times * unit_ns).astype(np.int64) + start_ns


def _most_values(rows: Sequence[NDArray[Any]]) -> int:
    # A wrong time far off would otherwise ask for a grid of years between two rows of a table.
    return max(2**22, 256 * len(rows) * len(rows[0]))

"""What a data file holds, and the way of its columns to SI."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, LogError, SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries

MAX_BYTES = 8 * 2**30
"""Most memory that the arrays of one file may take unless the caller allows more."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FileContents:
    """The time series of a data file.

    Attributes
    ----------
    series
        One for each sample rate, start and length.
    notes
        Sentences on what was inferred or left out.
    """

    series: tuple[TimeSeries, ...]
    notes: tuple[str, ...] = ()


def unit_in_si(name: str, label: str) -> tuple[float, str]:
    """Give the factor to SI and the SI unit of a column by its label; its name settles what a label may mean.

    Raises
    ------
    SetupError
        When the label is no unit, or leaves the unit open.
    """
    from chladni.signals.unit_labels import quantity_of_name, read_label

    return read_label(label, quantity=quantity_of_name(name))


def _channel_in_si(values: NDArray[np.floating[Any]], channel: Channel) -> tuple[NDArray[np.floating[Any]], str]:
    try:
        factor, unit = unit_in_si(channel.name, channel.unit)
        # Values already in SI are given back untouched, to the bit.
        return (values if factor == 1.0 else values * factor), unit
    except SetupError as error:
        raise SetupError(f"channel {channel.name!r}: {error}; or state its unit yourself") from error


def unit_of(name: str, found: str | None, units: Mapping[str, str] | None) -> str:
    """Give the unit that the caller states for a column, else the one `found` in the file, else ``1``."""
    return (units or {}).get(name, found or "1")


def series_of_rows(
    rows: Sequence[NDArray[np.floating[Any]]],
    channels: Sequence[Channel],
    *,
    sample_rate_hz: float,
    start_time_ns: int = 0,
) -> TimeSeries:
    """Stack rows whose units are any into one series in SI; samples that are no finite numbers count as missing."""
    converted = [_channel_in_si(row, channel) for row, channel in zip(rows, channels, strict=True)]
    values = np.stack([row for row, _ in converted])
    return TimeSeries(
        values=values,
        sample_rate_hz=sample_rate_hz,
        start_time_ns=start_time_ns,
        channels=tuple(replace(channel, unit=unit) for channel, (_, unit) in zip(channels, converted, strict=True)),
        valid=finite_mask(values),
    )


def finite_mask(values: NDArray[np.floating[Any]]) -> NDArray[np.bool_] | None:
    """Mark the finite values; None when all are."""
    finite = np.isfinite(values)
    return None if finite.all() else finite


def placed_rows(
    stamps_ns: NDArray[np.int64],
    rows: Sequence[NDArray[np.floating[Any]]],
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
    from chladni.signals.time_base import fit_time_base
    from chladni.signals.uniform import place

    # A record with a pretrigger begins before 0, which no clock does: the fit is about differences only.
    origin_ns = int(stamps_ns.min(initial=2**62))
    try:
        base = fit_time_base(stamps_ns - origin_ns)
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
    lost = int(np.isfinite(rows).any(axis=0).sum() - np.isfinite(grid.values).any(axis=0).sum())
    if lost:
        notes.append(f"{where}: {lost} samples came at the same time as another one and are left out.")
    return FileContents(series=(series,), notes=tuple(notes))


def one_series(series: Iterable[TimeSeries], kind: str) -> TimeSeries:
    """Give the only series of a file kind that holds one rate; `LogError` naming the rates when there are more."""
    parts = tuple(series)
    if len(parts) != 1:
        rates = ", ".join(f"{part.sample_rate_hz:g} Hz from {part.start_time_ns} ns" for part in parts) or "none"
        raise LogError(
            f"{kind} holds channels of one rate and start, here are {len(parts)} groups ({rates}); choose channels "
            "of one group, or have them brought to one sample rate"
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


def times_to_ns(
    times: NDArray[np.float64], *, unit_ns: int = NS_PER_S, start_ns: int = 0, where: str
) -> NDArray[np.int64]:
    """Round times to whole nanoseconds since 1970; `LogError` for what is no time within centuries."""
    largest = float(np.abs(times).max(initial=0.0)) * unit_ns + abs(start_ns)
    if not largest < 2**62:
        raise LogError(f"{where}: the times aren't all numbers within 146 years of 1970")
    return np.rint(times * unit_ns).astype(np.int64) + start_ns


def _most_values(rows: Sequence[NDArray[Any]]) -> int:
    # A wrong time far off would otherwise ask for a grid of years between two rows of a table.
    return max(2**22, 256 * len(rows) * len(rows[0]))

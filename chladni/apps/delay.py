"""Time delays between the channels of a log."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from chladni.apps.sources import Span, joined, moving_channels, whole_channels
from chladni.io.log import Log
from chladni.signals.cross_correlation import TimeDelays
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.time_delay import time_delay


def log_delays(
    log: Log,
    *,
    reference: str,
    responses: Sequence[str] | None,
    band_hz: tuple[float, float] | None,
    longest_delay_s: float | None,
    resolution_hz: float | None,
    span: Span,
) -> TimeDelays:
    """Tell by how much named channels come after a reference, or all of its unit that share its sampling grid.

    Arguments are those of `time_delay`; named channels of several sampling grids are joined, with a note.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        As `time_delay` does.
    """
    first = log.name(reference)
    how: dict[str, Any] = {
        "references": first, "band_hz": band_hz, "longest_delay_s": longest_delay_s, "resolution_hz": resolution_hz,
    }  # fmt: skip

    def delays(series: TimeSeries) -> TimeDelays | None:
        # What wasn't asked for by name is left out where it never changes.
        moving = moving_channels(series) if responses is None else [channel.name for channel in series.channels]
        others = [name for name in moving if name != first]
        return time_delay(series.select([first, *others]), **how) if others else None

    notes, parts = _of_its_unit(log, first, span) if responses is None else _named(log, first, responses, span)
    try:
        # No name holds a part while the next one is read.
        found = [one for one in map(delays, parts) if one is not None]
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error
    if not found:
        unit = next(channel.unit for channel in log.channels if channel.name == first)
        raise EstimateError(
            f"{log.path.name}: nothing that changes is in {unit or 'no unit'} as {first} is, on its clock; name "
            "channels in other units with --response (in Python, responses)"
        )
    together = _together(found)
    return replace(together, notes=(*notes, *together.notes))


_Parts = tuple[tuple[str, ...], Iterable[TimeSeries]]


def _named(log: Log, reference: str, responses: Sequence[str], span: Span) -> _Parts:
    names = list(dict.fromkeys([reference, *log.names(responses)]))
    if len(names) == 1:
        raise EstimateError(f"{log.path.name}: {reference} is the only channel; name another one as a response")
    grids = whole_channels(log, names, span, work="a delay", beside=[reference])
    if len(grids) == 1:
        return (), grids[0]
    series, notes = joined(log, names, span)
    return notes, [series]


def _of_its_unit(log: Log, reference: str, span: Span) -> _Parts:
    units = {channel.name: channel.unit for channel in log.channels}
    grids = log.grids(None, start_s=span.start_s, end_s=span.end_s)
    names = next((grid.names for grid in grids if reference in grid.names), (reference,))
    alike = [name for name in names if units[name] == units[reference]]
    (grid,) = whole_channels(log, alike, span, work="a delay", beside=[reference])
    return (), grid


def _together(parts: Sequence[TimeDelays]) -> TimeDelays:
    """Join what was found of some responses each."""
    first, correlation = parts[0], parts[0].correlation
    responses = tuple(channel for one in parts for channel in one.responses)
    return replace(
        first,
        delay_s=np.concatenate([one.delay_s for one in parts]),
        std_s=np.concatenate([one.std_s for one in parts]),
        coherence=np.concatenate([one.coherence for one in parts]),
        inverted=tuple(inverted for one in parts for inverted in one.inverted),
        responses=responses,
        correlation=replace(
            correlation, values=np.concatenate([one.correlation.values for one in parts]), responses=responses
        ),
        notes=tuple(note for one in parts for note in one.notes),
    )

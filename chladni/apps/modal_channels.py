"""Which channels of a log modes are identified from."""

from collections import Counter
from collections.abc import Sequence

from chladni.apps.excitation import FORCE_UNITS, constant_channels
from chladni.apps.sources import Progress, Span, Watched, on_one_grid
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import in_unit
from chladni.spectral.forms import MOTION_ORDER

Chosen = tuple[tuple[str, ...], tuple[str, ...]]


def motions_of_one_unit(channels: Sequence[Channel], *, named: bool) -> Chosen:
    """Choose the responses whose unit is the most common, motions first; say which are left out.

    Modal vectors are ratios of displacements: a rotation or a strain beside them would have no place in the vector.

    Parameters
    ----------
    named
        Whether the user named the channels: then none may be left out.

    Returns
    -------
    Names in their own order, and notes.

    Raises
    ------
    EstimateError
        When named channels have several units.
    """
    counts = Counter(channel.unit for channel in channels)
    if len(counts) <= 1:
        return tuple(channel.name for channel in channels), ()
    if named:
        told = ", ".join(f"{channel.name} {in_unit(channel.unit)}" for channel in channels)
        raise EstimateError(f"modal vectors need responses of one unit, got {told}; name those of one unit")
    unit = max(counts, key=lambda one: (one in MOTION_ORDER, counts[one]))
    names = tuple(channel.name for channel in channels if channel.unit == unit)
    others = [channel.name for channel in channels if channel.unit != unit]
    return names, (f"modal vectors are of the channels {in_unit(unit)}; left out: {some_of(others)}",)


def responses_alone(
    source: Log | TimeSeries, channels: Sequence[str] | None, span: Span, *, progress: Progress
) -> tuple[TimeSeries | Watched, tuple[str, ...]]:
    """Choose the responses that modes are identified from when no excitation was measured.

    Parameters
    ----------
    channels
        Names; None takes the motions of one unit that change, on the sampling grid that holds most of them.

    Returns
    -------
    Their samples, and notes on what was left out.

    Raises
    ------
    LogError, EstimateError
        When a channel is missing, several units or grids are mixed by name, or there is no response.
    """
    if isinstance(source, TimeSeries):
        return _of_series(source, channels, span)
    if channels is not None:
        grid = _of_named(source, source.names(channels), span, progress)
        return grid, grid.notes
    return _of_log(source, span, progress)


def _of_series(series: TimeSeries, channels: Sequence[str] | None, span: Span) -> tuple[TimeSeries, tuple[str, ...]]:
    part = series if span == Span() else series.window(start_s=span.start_s, end_s=span.end_s)
    if channels is not None:
        names, notes = motions_of_one_unit(part.select(list(channels)).channels, named=True)
    else:
        still = constant_channels(part, [channel.name for channel in part.channels], Span())
        names, notes = _moving_motions(part.channels, still)
    if not names:
        raise EstimateError("the series holds no response that changes; nothing to identify modes from")
    return part.select(list(names)), notes


def _of_named(log: Log, names: tuple[str, ...], span: Span, progress: Progress) -> Watched:
    motions_of_one_unit([channel for channel in log.channels if channel.name in names], named=True)
    return on_one_grid(log, names, span, progress=progress)


def _of_log(log: Log, span: Span, progress: Progress) -> tuple[Watched, tuple[str, ...]]:
    known = {channel.name: channel for channel in log.channels}
    offers = [
        _moving_motions([known[name] for name in grid.names], constant_channels(log, grid.names, span))
        for grid in log.grids(start_s=span.start_s, end_s=span.end_s)
    ]
    names, notes = max(offers, key=lambda offer: len(offer[0]), default=((), ()))
    if not names:
        raise EstimateError(f"{log.path.name}: no response changes; nothing to identify modes from")
    elsewhere = [name for chosen, _ in offers for name in chosen if name not in names]
    if elsewhere:
        notes = (*notes, f"on other sampling grids, left out: {some_of(elsewhere)}")
    return _of_named(log, names, span, progress), notes


def _moving_motions(channels: Sequence[Channel], constant: Sequence[str]) -> Chosen:
    """Choose among the responses that change, and say which don't."""
    responses = [one for one in channels if one.role != "reference" and one.unit not in FORCE_UNITS]
    names, notes = motions_of_one_unit([one for one in responses if one.name not in constant], named=False)
    still = [one.name for one in responses if one.name in constant]
    return names, (*notes, f"channels that never change are left out: {some_of(still)}") if still else notes

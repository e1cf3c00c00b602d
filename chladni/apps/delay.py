"""Time delays between the channels of a log."""

from collections.abc import Sequence
from dataclasses import replace

from chladni.apps.sources import Span, joined, moving_channels, require_fitting
from chladni.io.log import Log
from chladni.signals.cross_correlation import TimeDelays
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.delay import time_delay


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
    notes: tuple[str, ...] = ()
    if responses is None:
        series = _of_its_unit(log, first, span)
    else:
        names = list(dict.fromkeys([first, *log.names(responses)]))
        require_fitting(log, names, span, work="a delay")
        series, notes = joined(log, names, span)
    try:
        found = time_delay(
            series,
            references=first,
            band_hz=band_hz,
            longest_delay_s=longest_delay_s,
            resolution_hz=resolution_hz,
        )
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error
    return replace(found, notes=(*notes, *found.notes))


def _of_its_unit(log: Log, reference: str, span: Span) -> TimeSeries:
    units = {channel.name: channel.unit for channel in log.channels}
    for grid in log.grids(None, start_s=span.start_s, end_s=span.end_s):
        if reference in grid.names:
            alike = [name for name in grid.names if units[name] == units[reference]]
            require_fitting(log, alike, span, work="a delay")
            (series,) = log.read_groups(alike, start_s=span.start_s, end_s=span.end_s)
            # A channel that never changes has no delay.
            others = [name for name in moving_channels(series) if name != reference]
            if not others:
                raise EstimateError(
                    f"{log.path.name}: nothing that changes is in {units[reference] or 'no unit'} as {reference} is, "
                    "on its clock; name channels in other units with --response (in Python, responses)"
                )
            return series.select([reference, *others])
    require_fitting(log, [reference], span, work="a delay")
    return log.read([reference], start_s=span.start_s, end_s=span.end_s)

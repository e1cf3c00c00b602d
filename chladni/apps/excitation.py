"""Which channels excite: what a log says, what its units say, and the functions that a file holds ready-made."""

from collections.abc import Sequence
from dataclasses import replace

from chladni.apps.sources import Span, Watched, no_progress, watched_grids
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.channel import Channel, find_channels
from chladni.signals.channel_names import places_of
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.time_series import TimeSeries

FORCE_UNITS = ("N", "N m")
NAMES_TOLD = 6


def excitations(moving: Sequence[Channel]) -> tuple[str, ...]:
    """Name the channels marked as reference, else the first force."""
    marked = tuple(channel.name for channel in moving if channel.role == "reference")
    forces = tuple(channel.name for channel in moving if channel.unit in FORCE_UNITS)
    return marked or forces[:1]


def excitation_names(source: Log | TimeSeries, span: Span, *, otherwise: str = "") -> tuple[str, ...]:
    """Name the excitations that the channels tell: those marked as reference, else the first force that changes.

    Parameters
    ----------
    otherwise
        What else may be done where none is told.

    Raises
    ------
    EstimateError
        When there is none.
    """
    if isinstance(source, Log) and not source.channels:
        # A log that holds no channel says itself what it holds.
        source.grids(start_s=span.start_s, end_s=span.end_s)
    candidates = [one for one in source.channels if one.role == "reference" or one.unit in FORCE_UNITS]
    found: tuple[str, ...] = ()
    if candidates:
        names = [channel.name for channel in candidates]
        still = constant_channels(source, names, span)
        found = excitations([channel for channel in candidates if channel.name not in still])
    if not found:
        held = some_of([channel.name for channel in source.channels], count=NAMES_TOLD)
        raise EstimateError(
            f"no channel that changes is known as an excitation; name it as reference (--reference){otherwise}; "
            f"there are {held}"
        )
    return found


def constant_channels(source: Log | TimeSeries, names: Sequence[str], span: Span) -> tuple[str, ...]:
    """Name the channels among `names` that show one value only."""
    if isinstance(source, TimeSeries):
        chosen = source.select(list(names))
        grids = [Watched(tuple(names), (chosen,), duration_s=chosen.duration_s, progress=no_progress)]
    else:
        grids = list(watched_grids(source, list(names), span))
    found: list[str] = []
    for grid in grids:
        for _ in grid:
            # Watching is all that is wanted.
            pass
        found += grid.constant()
    return tuple(found)


def stored_functions(
    source: Log | TimeSeries, references: Sequence[str] | None, responses: Sequence[str] | None
) -> FrequencyResponse | None:
    """Give the functions that a file holds ready-made, where those are meant.

    They are when no channel is named, or when the channels named are theirs; and always in a file without samples
    over time.

    Raises
    ------
    EstimateError
        When the file holds nothing else, and not the functions that are named.
    """
    held = None if isinstance(source, TimeSeries) else source.functions
    if held is None:
        return None
    known = [channel.name for channel in (*held.responses, *held.references)]
    try:
        if source.channels and not all(places_of(word, known) for word in (*(references or ()), *(responses or ()))):
            return None
        chosen = held if responses is None else held.select(list(responses))
        return chosen if references is None else _of_references(chosen, references)
    except EstimateError as error:
        raise EstimateError(f"{source.path.name}: {error}" if isinstance(source, Log) else str(error)) from error


def _of_references(functions: FrequencyResponse, references: Sequence[str]) -> FrequencyResponse:
    columns = find_channels(functions.references, references, role="reference")
    return replace(
        functions,
        values=functions.values[:, columns],
        std=functions.std[:, columns],
        references=tuple(functions.references[column] for column in columns),
    )

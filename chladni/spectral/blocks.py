"""One way to see a series and a stream of blocks."""

from collections.abc import Iterable, Iterator
from itertools import chain

from chladni.signals.channel import require_channels
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries

Source = TimeSeries | Iterable[TimeSeries]


def leading_part(source: Source, samples: int) -> tuple[tuple[TimeSeries, ...], Iterator[TimeSeries]]:
    """Give the first blocks, together at least `samples` long if there are as many, and all blocks from the first.

    When the first blocks are shorter than `samples`, they are all there are.

    Raises
    ------
    EstimateError
        When the source holds no sample or no channel.
    """
    blocks = iter((source,) if isinstance(source, TimeSeries) else source)
    lead: list[TimeSeries] = []
    length = 0
    # The first blocks are kept and handed out again, so that a source that can be read once is read once.
    for block in blocks:
        lead.append(block)
        length += block.samples
        if length >= samples:
            break
    if length == 0:
        raise EstimateError("there is no sample to average; choose a time window in which the log has data")
    require_channels(lead[0].channels)
    return tuple(lead), chain(lead, blocks)


def samples_known(source: Source, lead: tuple[TimeSeries, ...], enough: int) -> int | None:
    """Give the length of the whole source, or None for a stream that goes on after `enough` samples."""
    # A stream of exactly `enough` samples can't be told from a longer one without reading on.
    length = sum(block.samples for block in lead)
    return length if isinstance(source, TimeSeries) or length < enough else None

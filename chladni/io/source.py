"""What verbs take: a log, a path, a series, or an array with its sample rate."""

import os
from collections.abc import Iterable, Mapping
from typing import Protocol, TypeGuard, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from chladni.io.data_frame import has_times, is_data_frame, named_numbers
from chladni.io.log import Log
from chladni.io.log import open as open_log
from chladni.signals.channel import Names, as_names, numbered, require_channels
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import Arrays, TimeSeries
from chladni.signals.value import Value
from chladni.signals.wording import counted

#: What every verb on samples over time takes.
SeriesLike = Log | TimeSeries | os.PathLike[str] | Arrays
#: Consecutive parts of one series.
Blocks = Iterable[TimeSeries]

# A compressed log of this size holds at most some tens of millions of samples.
IN_MEMORY_BYTES = 48 << 20
VALUES_IN_A_BLOCK = 1 << 21


@runtime_checkable
class _ArrayLike(Protocol):
    def __array__(self) -> object: ...


def is_small(log: Log) -> bool:
    """Whether all samples of a log may be held in memory at once, once more where they are in memory already."""
    return log.size_bytes <= IN_MEMORY_BYTES


def log_or_series(source: SeriesLike, *, sample_rate_hz: float | None = None) -> Log | TimeSeries:
    """Open a path and make a series of an array; a log stays one, and nothing of it is read.

    Parameters
    ----------
    source
        A log, a path to one, a series, an array ``[channel, sample]`` or ``[sample]``, arrays by their channel's
        name, or a data frame of pandas or polars, which becomes a log where a column or its index tells times.
    sample_rate_hz
        Samples a second of an array, or of a file or a data frame that doesn't say it.

    Raises
    ------
    SetupError
        When an array comes without its rate, or a log or a series with another one.
    EstimateError
        When the array is no series, see `TimeSeries.from_arrays`.
    LogError
        When the file can't be read.

    Examples
    --------
    >>> log_or_series([0.0, 1.0, 0.0, -1.0], sample_rate_hz=8.0).duration_s
    0.5
    """
    if isinstance(source, str | os.PathLike):
        return open_log(os.fspath(source), sample_rate_hz=sample_rate_hz)
    if isinstance(source, Log | TimeSeries):
        if sample_rate_hz is not None:
            raise SetupError("sample_rate_hz is for arrays; a log and a series know their own, so leave it out")
        return source
    if isinstance(source, Value):
        raise SetupError(
            f"a {type(source).__name__} holds no samples over time; give a log, a path, a series, or an array"
        )
    if is_data_frame(source):
        if has_times(source, sample_rate_hz=sample_rate_hz):
            return open_log(source, sample_rate_hz=sample_rate_hz)
        if sample_rate_hz is None:
            raise SetupError("no column of the data frame holds times; give sample_rate_hz=, or name one time")
        source = named_numbers(source)
    if sample_rate_hz is None:
        raise SetupError("an array doesn't tell its sample rate; give sample_rate_hz=")
    return TimeSeries.from_arrays(source, sample_rate_hz=sample_rate_hz)


def driven_series(
    responses: SeriesLike, references: ArrayLike, *, sample_rate_hz: float | None
) -> tuple[TimeSeries, tuple[str, ...]]:
    """Give arrays of responses and of what excites them as one series, and the names of the references.

    Raises
    ------
    SetupError
        When the responses aren't an array, or come without their rate.
    EstimateError
        When the two aren't equally long.

    Examples
    --------
    >>> series, names = driven_series(np.ones((2, 8)), np.zeros(8), sample_rate_hz=1.0)
    >>> [channel.name for channel in series.channels], names
    (['reference1', 'ch1', 'ch2'], ('reference1',))
    """
    if isinstance(responses, Log | Value | str | os.PathLike):
        raise SetupError("references are an array; name its channel, or give the responses as an array, too")
    if sample_rate_hz is None:
        raise SetupError("an array doesn't tell its sample rate; give sample_rate_hz=")
    moved = TimeSeries.from_arrays(responses, sample_rate_hz=sample_rate_hz)
    driven = np.atleast_2d(np.asarray(references))
    names = numbered("reference", len(driven))
    drives = TimeSeries.from_arrays(driven, sample_rate_hz=sample_rate_hz, names=names, references=names)
    if drives.samples != moved.samples:
        raise EstimateError(
            f"references have {counted(drives.samples, 'sample')}, responses {moved.samples}; cut them alike"
        )
    together = TimeSeries.from_arrays(
        np.vstack([drives.values, moved.values]),
        sample_rate_hz=sample_rate_hz,
        names=[channel.name for one in (drives, moved) for channel in one.channels],
        references=names,
    )
    return together, names


def are_numbers(given: object) -> bool:
    """Whether an argument is an array of numbers, and no names."""
    numbers = np.asarray(() if isinstance(given, str) else given)
    return bool(numbers.size) and numbers.dtype.kind in "fiu"


def series_of(
    source: SeriesLike,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> TimeSeries:
    """Give what a caller has as one series in memory: the first line of a verb that works on samples.

    Parameters
    ----------
    source, sample_rate_hz
        See `log_or_series`.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.

    Raises
    ------
    LogError
        When the file can't be read, there is no such channel, or channels don't share a grid.
    SetupError
        See `log_or_series`.
    EstimateError
        Also when the series holds no channel.

    Examples
    --------
    >>> series_of({"f": np.ones(8), "a": np.zeros(8)}, sample_rate_hz=4.0, channels="a", start_s=1.0).values.shape
    (1, 4)
    """
    found = log_or_series(source, sample_rate_hz=sample_rate_hz)
    if isinstance(found, Log):
        return found.read(None if channels is None else as_names(channels), start_s=start_s, end_s=end_s)
    chosen = found if channels is None else found.select(channels)
    require_channels(chosen.channels)
    return chosen if start_s is None and end_s is None else chosen.window(start_s=start_s, end_s=end_s)


def blocks_of(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> TimeSeries | Blocks:
    """Give what a caller has as a series where it fits in memory, else as its blocks, read one at a time.

    Consecutive blocks stay what they are. Arguments and errors are as for `series_of`.
    """
    if is_blocks(source):
        if not all(option is None for option in (channels, sample_rate_hz, start_s, end_s)):
            raise SetupError("blocks are averaged as they come; choose channels and times where they are made")
        return source
    found = log_or_series(cast("SeriesLike", source), sample_rate_hz=sample_rate_hz)
    if isinstance(found, TimeSeries) or is_small(found):
        return series_of(found, channels=channels, start_s=start_s, end_s=end_s)
    names = None if channels is None else as_names(channels)
    grid = found.grids(names, start_s=start_s, end_s=end_s)[0]
    seconds = block_seconds(len(grid.names), grid.sample_rate_hz)
    return found.blocks(names, seconds=seconds, start_s=start_s, end_s=end_s)


def extent_of(
    source: Log | TimeSeries,
    *,
    channels: Names | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> tuple[float, float]:
    """Give the sample rate in Hz and the duration in seconds of what `blocks_of` gives, before a sample is read."""
    if isinstance(source, TimeSeries):
        series = series_of(source, channels=channels, start_s=start_s, end_s=end_s)
        return series.sample_rate_hz, series.duration_s
    names = None if channels is None else as_names(channels)
    grid = source.grids(names, start_s=start_s, end_s=end_s)[0]
    return grid.sample_rate_hz, grid.duration_s


def block_seconds(channels: int, sample_rate_hz: float) -> float:
    """How long a block is that memory holds easily, in seconds."""
    return max(1.0, VALUES_IN_A_BLOCK / (channels * sample_rate_hz))


def response_of(
    source: FrequencyResponse | SeriesLike, *, frequency_hz: ArrayLike | None = None
) -> FrequencyResponse:
    """Give frequency responses, those of an array ``[response, reference, frequency]`` with its frequencies.

    Raises
    ------
    SetupError
        When an array comes without frequencies, responses with others, or it's neither.
    EstimateError
        When shapes don't fit, see `FrequencyResponse.from_arrays`.
    """
    if isinstance(source, FrequencyResponse):
        _require_none(frequency_hz)
        return source
    return FrequencyResponse.from_arrays(*_over_frequency(source, frequency_hz))


def density_of(
    source: PowerSpectralDensity | SeriesLike,
    *,
    frequency_hz: ArrayLike | None = None,
    averages: float | None = None,
) -> PowerSpectralDensity:
    """Give power spectral densities, those of an array ``[channel, frequency]``; errors are as for `response_of`."""
    if isinstance(source, PowerSpectralDensity):
        _require_none(frequency_hz)
        _require_none(averages)
        return source
    return PowerSpectralDensity.from_arrays(*_over_frequency(source, frequency_hz), averages=averages)


def _require_none(of_an_array: ArrayLike | None) -> None:
    if of_an_array is not None:
        raise SetupError("frequency_hz and averages are for arrays; spectra know their own, so leave them out")


def _over_frequency(source: object, frequency_hz: ArrayLike | None) -> tuple[ArrayLike, ArrayLike]:
    if isinstance(source, Value | Log | str | os.PathLike | Mapping):
        raise SetupError(
            f"a {type(source).__name__} is no spectrum; give the estimate, or an array with frequency_hz="
        )
    if frequency_hz is None:
        raise SetupError("an array doesn't tell its frequencies; give frequency_hz=")
    return frequency_hz, np.asarray(source)


def is_blocks(source: object) -> TypeGuard[Blocks]:
    """Whether something is blocks of a series, and no array."""
    if isinstance(source, list | tuple):
        return all(isinstance(one, TimeSeries) for one in source)
    known = (str, os.PathLike, Log, Value, Mapping, _ArrayLike)
    return isinstance(source, Iterable) and not isinstance(source, known)

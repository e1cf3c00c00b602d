"""Samples laid onto a grid: all at once, or block by block as a log is read."""

import mmap
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.shared_grid import Group
from chladni.signals.arrays import Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

#: Bytes of a huge page, for which NumPy asks Linux of all large arrays; on x86-64 and ARM, with pages of 4 KiB.
_HUGE_PAGE: Final = 2**21


@dataclass(frozen=True, slots=True, kw_only=True)
class GridRows:
    """Which row of the result each channel of each stream of a group has.

    Attributes
    ----------
    channels
        In the order asked for.
    rows
        For each placement of the group the rows of its stream's channels.
    """

    channels: tuple[Channel, ...]
    rows: tuple[tuple[int, ...], ...]


def grid_rows(group: Group, order: Sequence[Channel]) -> GridRows:
    """Order the channels of a group as they were asked for."""
    names = {channel.name for placement in group.placements for channel in placement.stream.channels}
    channels = tuple(channel for channel in order if channel.name in names)
    row = {channel.name: index for index, channel in enumerate(channels)}
    return GridRows(
        channels=channels,
        rows=tuple(
            tuple(row[channel.name] for channel in placement.stream.channels) for placement in group.placements
        ),
    )


class GridBuffer:
    """Samples ``[row, sample]`` of one stretch of a grid; what no message fills stays NaN and invalid.

    Parameters
    ----------
    group
        The grid.
    channels
        One for each row.
    first, last
        Grid indices of the stretch.
    dtype
        Of the samples.
    """

    def __init__(
        self, group: Group, channels: tuple[Channel, ...], first: int, last: int, dtype: np.dtype[np.floating[Any]]
    ) -> None:
        self._group = group
        self._channels = channels
        self._first = first
        self._values = _memory(len(channels), last - first, dtype)
        # Up to here each row has samples, or NaN. Filling all with NaN first would write most of the memory twice.
        self._reached = [0] * len(channels)
        self._finite = True

    def put(self, rows: Sequence[int], index: Whole, values: NDArray[np.floating]) -> None:
        """Lay samples onto the grid; those outside the stretch are left out.

        Parameters
        ----------
        rows
            Row of each channel of `values`.
        index
            ``[sample]``, grid index.
        values
            ``[channel, sample]``.
        """
        places = index - self._first
        count = self._values.shape[1]
        if not places.size:
            return
        self._finite = self._finite and _surely_finite(values)
        if places[0] >= 0 and places[-1] == places[0] + places.size - 1 and _contiguous(places):
            stop = min(count, int(places[-1]) + 1)
            start = int(places[0])
            if start < stop:
                for row, samples in zip(rows, values, strict=True):
                    self._reach(row, start)
                    self._values[row, start:stop] = samples[: stop - start]
                    self._reached[row] = max(self._reached[row], stop)
            return
        inside = (places >= 0) & (places < count)
        whole = bool(inside.all())
        for row, samples in zip(rows, values, strict=True):
            self._reach(row, count)
            self._values[row, places if whole else places[inside]] = samples if whole else samples[inside]

    def series(self) -> TimeSeries:
        """Give what has been laid down; what is no finite number counts as not measured."""
        for row in range(len(self._reached)):
            self._reach(row, self._values.shape[1])
        valid = None if self._finite else np.isfinite(self._values)
        if valid is not None:
            self._values[~valid] = np.nan
        return TimeSeries(
            values=self._values,
            sample_rate_hz=self._group.rate_hz,
            start_time_ns=self._group.time_ns(self._first),
            channels=self._channels,
            valid=None if valid is None or valid.all() else valid,
        )

    def _reach(self, row: int, place: int) -> None:
        """Fill with NaN what has not been reached before `place`."""
        if self._reached[row] < place:
            self._values[row, self._reached[row] : place] = np.nan
            self._reached[row] = place
            self._finite = False


def _memory(rows: int, samples: int, dtype: np.dtype[np.floating[Any]]) -> NDArray[np.floating]:
    """Memory for ``[row, sample]`` that is taken as it's written to, so that pieces can go as their samples come.

    A huge page is faster, but many rows of a short record: the first samples would take them all.
    """
    size = rows * samples * dtype.itemsize
    if sys.platform == "win32" or size <= _HUGE_PAGE or samples * dtype.itemsize >= _HUGE_PAGE:
        return np.empty((rows, samples), dtype)
    try:
        pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    except OSError as error:
        # As of any other array.
        raise MemoryError(f"{size} bytes of samples: {error.strerror}") from error
    if sys.platform == "linux":
        # Some systems give huge pages unasked; a kernel that has none refuses the wish.
        with suppress(OSError):
            pages.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(pages, dtype).reshape(rows, samples)


def _surely_finite(values: NDArray[np.floating]) -> bool:
    """Whether all are finite; False also when they only may not be."""
    # What isn't finite stays in a sum, which needs no memory, and brings into the cache what is copied next.
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(values.sum()))


def _contiguous(places: Whole) -> bool:
    return bool(np.all(np.diff(places) == 1))

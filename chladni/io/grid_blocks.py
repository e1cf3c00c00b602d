"""A log's samples on their grid, block by block, in memory that doesn't grow with the log."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.grid_buffer import GridBuffer
from chladni.io.shared_grid import Group
from chladni.signals.arrays import Mask, Whole
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

#: Blocks that are filled at a time, at most: so many, or as many as this memory holds.
MOST_BLOCKS: Final = 8
MOST_BYTES: Final = 1 << 28


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedPiece:
    """Samples with their places.

    Attributes
    ----------
    rows
        Row of the result of each channel.
    index
        ``[sample]``, grid index.
    values
        ``[channel, sample]``.
    """

    rows: tuple[int, ...]
    index: Whole
    values: NDArray[np.floating]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockGrid:
    """A stretch of a grid, cut into blocks.

    Attributes
    ----------
    group, channels
        The grid, and one channel for each row.
    first, last
        Grid indices of the stretch.
    block_samples
        Samples of a block; the last one may be shorter.
    dtype
        Of the samples.
    """

    group: Group
    channels: tuple[Channel, ...]
    first: int
    last: int
    block_samples: int
    dtype: np.dtype[Any]

    @property
    def count(self) -> int:
        """Number of blocks."""
        return -(-(self.last - self.first) // self.block_samples)

    def end(self, number: int) -> int:
        """Grid index behind the last sample of a block."""
        return min(self.last, self.first + (number + 1) * self.block_samples)

    @property
    def block_bytes(self) -> int:
        """Size of a block in memory."""
        return max(1, self.block_samples * len(self.channels) * self.dtype.itemsize)

    def parts(self, lowest: Whole, highest: Whole) -> Iterator["BlockGrid"]:
        """Cut the stretch so that the blocks being filled at a time fit into memory, though pieces come in any order.

        A log that is stored in the order of time is one part. One that isn't is read once for each part.

        Parameters
        ----------
        lowest, highest
            ``[piece]``, grid indices of each piece, in the order of the file.
        """
        most = max(MOST_BLOCKS, MOST_BYTES // self.block_bytes)
        reached = np.maximum.accumulate((np.minimum(highest, self.last) - self.first) // self.block_samples)
        given = (np.minimum(complete(lowest, self.last), self.last) - self.first) // self.block_samples
        # A piece is laid down before the blocks that are complete with it are given.
        filling = reached + 1 - np.append(0, given[:-1])
        if int(filling.max(initial=0)) <= most:
            yield self
            return
        for first in range(self.first, self.last, most * self.block_samples):
            yield replace(self, first=first, last=min(self.last, first + most * self.block_samples))

    def buffer(self, number: int) -> GridBuffer:
        """An empty block."""
        start = self.first + number * self.block_samples
        return GridBuffer(self.group, self.channels, start, self.end(number), self.dtype)

    def inside(self, piece: PlacedPiece) -> PlacedPiece:
        """Give the samples of a piece that have a place on the stretch."""
        keep = (piece.index >= self.first) & (piece.index < self.last)
        return piece if keep.all() else replace(piece, index=piece.index[keep], values=piece.values[:, keep])

    def cut(self, index: Whole) -> Iterator[tuple[int, slice | Mask]]:
        """Give the blocks that samples of the stretch fall into, and which samples fall into each."""
        numbers = (index - self.first) // self.block_samples
        if not numbers.size:
            return
        low, high = int(numbers.min()), int(numbers.max())
        if low == high:
            yield low, slice(None)
        elif np.all(np.diff(numbers) >= 0):
            edges = np.searchsorted(numbers, np.arange(low, high + 2))
            yield from ((low + n, slice(a, b)) for n, (a, b) in enumerate(pairwise(edges)) if b > a)
        else:
            yield from ((int(number), numbers == number) for number in np.unique(numbers))


def complete(lowest: Whole, last: int) -> Whole:
    """For each piece the grid index below which no later piece has a sample, from the lowest index of each."""
    following = np.append(lowest[1:], last)[: lowest.size]
    return np.minimum.accumulate(following[::-1])[::-1]


def blocks_of(grid: BlockGrid, pieces: Iterable[PlacedPiece], below: Whole) -> Iterator[TimeSeries]:
    """Lay pieces onto the grid and give each block as soon as nothing more can fall into it.

    Parameters
    ----------
    grid
        Where the samples lie.
    pieces
        In the order of the file.
    below
        As `complete` gives it.
    """
    filling: dict[int, GridBuffer] = {}
    done = 0
    for whole, complete_to in zip(pieces, below.tolist(), strict=True):
        piece = grid.inside(whole)
        for number, part in grid.cut(piece.index):
            if number not in filling:
                filling[number] = grid.buffer(number)
            filling[number].put(piece.rows, piece.index[part], piece.values[:, part])
        while done < grid.count and grid.end(done) <= complete_to:
            yield (filling.pop(done, None) or grid.buffer(done)).series()
            done += 1
    # Where no piece has a sample of the stretch, all of it is a gap.
    for number in range(done, grid.count):
        yield grid.buffer(number).series()

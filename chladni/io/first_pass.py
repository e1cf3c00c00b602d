"""What a pass over the stamps of a log tells: the grid of each stream, and which pieces a second pass has to read."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.placement import Placement, lowest_index
from chladni.signals.arrays import Mask, Whole

#: The placement that a piece belongs to, if any, and which of its messages the piece holds.
Part = tuple[int | None, slice]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PiecePlaces:
    """Where the pieces of a second pass stand on a grid.

    Attributes
    ----------
    parts
        Of each piece that is read, in the order of the file.
    lowest, highest
        ``[piece]``, first grid index, and the one behind the last, of each of them that lies on the grid.
    wanted
        Which pieces are read, as `chladni.io.stream.read_pieces` takes it; None for all.
    """

    parts: Sequence[Part]
    lowest: Whole
    highest: Whole
    wanted: Sequence[bool] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FirstPass:
    """What a pass over the stamps tells.

    Attributes
    ----------
    placements
        One for each stream, in their order.
    sizes
        Stream and number of messages of each piece, in the order of the file.
    every
        Number of messages of each piece before empty ones, and those outside the window, were left out.
    dtype
        That holds the samples.
    """

    placements: tuple[Placement, ...]
    sizes: tuple[tuple[int, int], ...]
    every: tuple[int, ...]
    dtype: np.dtype[Any]

    def places(self, placements: Sequence[Placement], *, within: tuple[int, int] | None = None) -> PiecePlaces:
        """Say where pieces stand on a grid.

        Parameters
        ----------
        placements
            Of the streams on this grid, with indices on it.
        within
            First grid index, and the one behind the last, of what is to be read: pieces beside it aren't. None for
            all pieces.
        """
        parts, wanted = self._parts(placements), None
        lowest, highest = _extents(parts, placements)
        if within is not None:
            needed = (lowest < within[1]) & (highest > within[0])
            wanted = self._among_every(needed)
            parts = list(compress(parts, needed))
            lowest, highest = lowest[needed], highest[needed]
        placed = np.array([member is not None for member, _ in parts], bool)
        return PiecePlaces(parts=parts, lowest=lowest[placed], highest=highest[placed], wanted=wanted)

    def _parts(self, placements: Sequence[Placement]) -> list[Part]:
        """Where each piece stands among the messages of its placement."""
        members = {id(one.stream): number for number, one in enumerate(placements)}
        member_of = [members.get(id(one.stream)) for one in self.placements]
        starts = [0] * len(self.placements)
        parts: list[Part] = []
        for stream, messages in self.sizes:
            start, starts[stream] = starts[stream], starts[stream] + messages
            parts.append((member_of[stream], slice(start, starts[stream])))
        return parts

    def _among_every(self, needed: Mask) -> list[bool]:
        """Say of each piece up to the last needed one whether it is; `needed` leaves out the empty ones."""
        flags = iter(needed.tolist())
        wanted = [bool(size) and next(flags) for size in self.every]
        # Nothing is read behind the last one.
        return wanted[: 1 + max((place for place, one in enumerate(wanted) if one), default=-1)]


def _extents(parts: Sequence[Part], placements: Sequence[Placement]) -> tuple[Whole, Whole]:
    """Lowest and highest grid index of each piece, in the order of the file; nowhere for those without placement."""
    extents = []
    for member, part in parts:
        if member is None:
            extents.append((-NOWHERE, NOWHERE))
            continue
        placement = placements[member]
        ends = placement.index[part] + (1 if placement.counts is None else placement.counts[part])
        # A piece of which nothing has a place on the grid isn't waited for.
        extents.append((lowest_index(placement.index[part], otherwise=-NOWHERE), int(ends.max())))
    lowest, highest = np.array(extents, np.int64).reshape(-1, 2).T
    return lowest, highest

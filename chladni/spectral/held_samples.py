"""Samples that wait for the ones they belong with."""

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.floating[Any]]


class HeldSamples:
    """A queue of ``[channel, sample]`` pieces, joined only when they're needed, so that short blocks cost little."""

    def __init__(self) -> None:
        self.samples = 0
        self._pieces: list[Samples] = []

    def append(self, values: Samples) -> None:
        """Add a copy: whoever made the block may write the next one into the same memory."""
        if values.shape[1]:
            self.replace_pieces([*self._pieces, values.copy()])

    def replace(self, values: Samples) -> None:
        """Hold a copy of these samples only."""
        self.replace_pieces([values.copy()] if values.shape[1] else [])

    def replace_pieces(self, pieces: list[Samples]) -> None:
        """Hold these pieces, which nobody writes to any more."""
        # A list made anew, not one appended to: copies of the queue share pieces.
        self._pieces = pieces
        self.samples = sum(piece.shape[1] for piece in pieces)

    def joined(self, *more: Samples) -> Samples:
        """Give all that is held, and more behind it, as one array."""
        return np.concatenate([*self._pieces, *more], axis=1)

    def copy(self) -> Self:
        """Give an independent queue of the same pieces."""
        twin = type(self)()
        twin.replace_pieces(list(self._pieces))
        return twin

"""Samples that wait for the ones they belong with."""

from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Whole


class HeldSamples:
    """A queue of ``[channel, sample]`` pieces, joined only when they're needed, so that short blocks cost little."""

    def __init__(self) -> None:
        self.samples = 0
        self._pieces: list[NDArray[np.floating]] = []

    def append(self, values: NDArray[np.floating]) -> None:
        """Add a copy: whoever made the block may write the next one into the same memory."""
        if values.shape[1]:
            self.replace_pieces([*self._pieces, values.copy()])

    def replace(self, values: NDArray[np.floating]) -> None:
        """Hold a copy of these samples only."""
        self.replace_pieces([values.copy()] if values.shape[1] else [])

    def replace_pieces(self, pieces: list[NDArray[np.floating]]) -> None:
        """Hold these pieces, which nobody writes to any more."""
        # A list made anew, not one appended to: copies of the queue share pieces.
        self._pieces = pieces
        self.samples = sum(piece.shape[1] for piece in pieces)

    def joined(self, *more: NDArray[np.floating]) -> NDArray[np.floating]:
        """Give all that is held, and more behind it, as one array."""
        return np.concatenate([*self._pieces, *more], axis=1)

    def copy(self) -> Self:
        """Give an independent queue of the same pieces."""
        twin = type(self)()
        twin.replace_pieces(list(self._pieces))
        return twin

    def select(self, rows: Whole) -> Self:
        """Give an independent queue of some of the channels."""
        twin = type(self)()
        twin.replace_pieces([piece[rows] for piece in self._pieces])
        return twin

"""From the pieces that a walk found to one column a field."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.piece import Piece
    from chladni.signals.arrays import Mask, Whole


def scattered(pieces: Sequence[Piece], messages: int) -> NDArray[np.generic]:
    """One value a message; zeros where the piece has none.

    Returns
    -------
    ndarray [message, ...]
    """
    first = pieces[0]
    if len(first.rows) == messages:
        return first.values
    # Only values of fixed width come here (a number or a string's place), so zeros for all are bounded.
    out = np.zeros((messages, *first.values.shape[1:]), np.result_type(*(piece.values for piece in pieces)))
    for piece in pieces:
        out[piece.rows] = piece.values
    return out


def joined(
    pieces: Sequence[Piece], bad: Mask, *, empty: NDArray[np.generic]
) -> tuple[NDArray[np.generic], Whole | None]:
    """All elements of an array field, in the order of messages and, in each, of the wire.

    Parameters
    ----------
    pieces : sequence of Piece
        In the order of the wire.
    bad : bool array [message]
        Messages to leave empty.
    empty : ndarray [0, ...]
        No elements, of the right kind: numbers, or pairs of numbers for strings.

    Returns
    -------
    values : ndarray
        ``[message, element, ...]`` where all sound messages have the same number of elements (and they are not
        a minority), else ``[element, ...]``.
    counts : int64 array [message] or None
        Elements of each message in the second case.
    """
    if _is_whole(pieces, len(bad), 1 + empty.ndim):
        return pieces[0].values, None
    return dense_if_even(*gathered(pieces, bad, empty=empty), bad)


def gathered(pieces: Sequence[Piece], bad: Mask, *, empty: NDArray[np.generic]) -> tuple[NDArray[np.generic], Whole]:
    """All elements of the sound messages, ``[element, ...]`` in the order of `joined`, and how many each has."""
    element_shape = empty.shape[1:]
    flat = np.concatenate([empty, *(piece.values.reshape(-1, *element_shape) for piece in pieces)])
    owner = np.concatenate([np.empty(0, np.int64), *(_owners(piece, element_shape) for piece in pieces)])
    order = np.argsort(owner, kind="stable")
    order = order[~bad[owner[order]]]
    return flat[order], np.bincount(owner[order], minlength=len(bad)).astype(np.int64)


def _is_whole(pieces: Sequence[Piece], messages: int, dimensions: int) -> bool:
    return len(pieces) == 1 and pieces[0].values.ndim == dimensions and len(pieces[0].rows) == messages


def dense_if_even(flat: NDArray[np.generic], counts: Whole, bad: Mask) -> tuple[NDArray[np.generic], Whole | None]:
    """Give elements a row for each message where all sound messages have the same number of them.

    Parameters
    ----------
    flat : ndarray [element, ...]
        Elements of the sound messages.
    counts : int64 array [message]
        Elements of each message; 0 for bad ones.
    bad : bool array [message]

    Returns
    -------
    values, counts
        As `joined` gives them.
    """
    sound = counts[~bad]
    width = int(sound[0]) if len(sound) else 0
    # Rows for bad messages cost as much as sound ones; a few are convenient, a million could be a trap.
    if (sound != width).any() or len(bad) > 2 * len(sound):
        return flat, counts
    if len(sound) == len(bad):
        return flat.reshape(len(bad), width, *flat.shape[1:]), None
    dense = np.zeros((len(bad), width, *flat.shape[1:]), flat.dtype)
    dense[~bad] = flat.reshape(len(sound), width, *flat.shape[1:])
    return dense, None


def _owners(piece: Piece, element_shape: tuple[int, ...]) -> Whole:
    if piece.counts is not None:
        return np.repeat(piece.rows, piece.counts)
    scalars = piece.values.ndim == 1 + len(element_shape)
    return piece.rows if scalars else np.repeat(piece.rows, piece.values.shape[1])

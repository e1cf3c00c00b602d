"""Modal assurance criterion: how far two modal vectors are the same up to a complex factor."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel, Vector
from chladni.signals.errors import EstimateError
from chladni.signals.modal_assurance import ModalAssurance
from chladni.signals.mode_set import ModeSet, Rows

# Cosine of a few hundredths of a degree: setup files hold directions with three or four digits.
_PARALLEL = 1e-6
# Below the smallest normal number a quotient overflows; no motion is that small.
_LEAST = np.finfo(np.float64).tiny


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedChannel:
    """A measured degree of freedom that two sets have in common.

    Attributes
    ----------
    row_a, row_b
        Its row among the channels of either set.
    sign
        -1 where the two sensors count positive in opposite directions, else 1.
    """

    row_a: int
    row_b: int
    sign: float


def mac(a: ModeSet | ArrayLike, b: ModeSet | ArrayLike | None = None, *, rows: Rows | None = None) -> ModalAssurance:
    """Compare each shape of `a` with each of `b`: abs(a^H b)^2/((a^H a)(b^H b)).

    Allemang (2003), "The modal assurance criterion: twenty years of use and abuse", Sound and Vibration 37(8), for
    complex shapes. Two sets of modes are compared over the channels that they share, see `shared_channels`; over a
    single channel all shapes are alike and the result is 1.

    Parameters
    ----------
    a, b
        Modes, or shapes ``[mode, channel]`` or ``[channel, mode]``, real or complex, over the same channels; a single
        shape ``[channel]`` is one mode. Without `b` the modes of `a` are compared with each other: large values off
        the diagonal say that these sensors can't tell two modes apart, or that one mode was found twice.
    rows
        What each row of an array belongs to; needed where the arrays fit either way.

    Returns
    -------
    ModalAssurance
        ``[mode of a, mode of b]``; ``.plot()`` draws it.

    Raises
    ------
    EstimateError
        When the shapes don't fit together, or fit both as rows and as columns and `rows` isn't given; when a shape is
        zero, or holds NaN or infinity; when sets share no channel.

    Examples
    --------
    >>> mac([1.0, 2.0], [[2j, 4j], [2.0, -1.0], [0.0, 0.1]]).values.round(3)
    array([[1. , 0. , 0.8]])
    """
    if b is None:
        b = a
    if isinstance(a, ModeSet) and isinstance(b, ModeSet):
        return ModalAssurance(values=cross_mac(a, b), a_hz=a.frequency_hz, b_hz=b.frequency_hz)
    one, other = _by_mode(a, b, rows)
    return ModalAssurance(values=shape_mac(one, other), a_hz=_known_hz(a, one), b_hz=_known_hz(b, other))


def shape_mac(a: ArrayLike, b: ArrayLike) -> Real:
    """Compare shapes ``[mode, channel]``, or one ``[channel]``; see `mac`, whose matrix this gives."""
    unit_a, unit_b = _unit_length(a, "a"), _unit_length(b, "b")
    if unit_a.shape[1] != unit_b.shape[1]:
        raise EstimateError(
            f"shapes of {unit_a.shape[1]} and {unit_b.shape[1]} channels can't be compared; give both over the same "
            "channels, or give two mode sets, whose shared channels are found"
        )
    product: Real = np.abs(unit_a.conj() @ unit_b.T) ** 2
    # Rounding of the two lengths may exceed 1 by an epsilon, which 1 - MAC must not show as negative.
    return np.minimum(product, 1.0)


def auto_mac(modes: ModeSet) -> Real:
    """Compare the modes of a set with each other, ``[mode, mode]``; the diagonal is 1.

    Large values off the diagonal say that these sensors can't tell the two modes apart, or that one mode was found
    twice.
    """
    return shape_mac(modes.shapes, modes.shapes)


def cross_mac(a: ModeSet, b: ModeSet) -> Real:
    """Compare the modes of two sets over the channels that they share, ``[mode of a, mode of b]``.

    See `shared_channels` for what counts as shared. Over a single channel all shapes are alike and the result is 1.

    Raises
    ------
    EstimateError
        When the two sets share no channel, or a shape has no motion at those they share.
    """
    shared = shared_channels(a.channels, b.channels)
    sign = np.array([pair.sign for pair in shared])
    rows_a, rows_b = ([pair.row_a for pair in shared], [pair.row_b for pair in shared])
    return shape_mac(a.shapes[:, rows_a], sign * b.shapes[:, rows_b])


def shared_channels(a: Sequence[Channel], b: Sequence[Channel]) -> tuple[SharedChannel, ...]:
    """Give the channels that `a` and `b` have in common, in the order of `a`, each at most once.

    Channels are the same when they have the same name, or the same point and direction; a sensor that was turned
    round counts with its sign changed. One that was turned to another axis is another channel, whatever its name.

    Raises
    ------
    EstimateError
        When there is none; the message names what either side has.
    """
    taken: set[int] = set()
    shared = []
    # Names go first: a second sensor at the same place must not take the partner of its namesake.
    matches = {row: _namesake(channel, b) for row, channel in enumerate(a)}
    taken.update(match[0] for match in matches.values() if match is not None)
    for row, channel in enumerate(a):
        match = matches[row] or _neighbour(channel, b, taken)
        if match is not None:
            taken.add(match[0])
            shared.append(SharedChannel(row_a=row, row_b=match[0], sign=match[1]))
    if not shared:
        raise EstimateError(
            f"the two sets share no channel: one has {_listed(a)}, the other {_listed(b)}; channels are shared by "
            "name, or by point and direction, which a setup file gives"
        )
    return tuple(shared)


def parallel_sign(a: Vector | None, b: Vector | None) -> float | None:
    """Give 1 for the same direction, -1 for the opposite one, None for others and where one is unknown."""
    if a is None or b is None:
        return None
    cosine = float(np.dot(a, b))
    if abs(abs(cosine) - 1.0) > _PARALLEL:
        return None
    return 1.0 if cosine > 0 else -1.0


def _namesake(channel: Channel, others: Sequence[Channel]) -> tuple[int, float] | None:
    for row, other in enumerate(others):
        if other.name == channel.name:
            unknown = channel.direction is None or other.direction is None
            sign = 1.0 if unknown else parallel_sign(channel.direction, other.direction)
            return None if sign is None else (row, sign)
    return None


def _neighbour(channel: Channel, others: Sequence[Channel], taken: set[int]) -> tuple[int, float] | None:
    if channel.point is None:
        return None
    for row, other in enumerate(others):
        sign = parallel_sign(channel.direction, other.direction)
        if row not in taken and other.point == channel.point and sign is not None:
            return row, sign
    return None


def _by_mode(a: ModeSet | ArrayLike, b: ModeSet | ArrayLike, rows: Rows | None) -> tuple[Complex, Complex]:
    """Give the shapes of both as ``[mode, channel]``, where only one way of reading the arrays fits."""
    ways: tuple[Rows, ...] = ("modes", "channels") if rows is None else (rows,)
    read = [(_read(a, way), _read(b, way)) for way in ways]
    fitting = [(one, other) for one, other in read if one.shape[-1:] == other.shape[-1:]]
    shapes = " and ".join(str(_read(one, "modes").shape) for one in (a, b))
    if not fitting:
        raise EstimateError(f"shapes {shapes} have no channels in common; give both over the same channels")
    # Two single shapes have nothing to turn.
    if len(fitting) > 1 and any(one.ndim > 1 for one in (*fitting[0], *fitting[1])):
        raise EstimateError(
            f"shapes {shapes} fit as [mode, channel] and as [channel, mode]; say rows='modes' or rows='channels'"
        )
    return fitting[0]


def _read(one: ModeSet | ArrayLike, rows: Rows) -> Complex:
    """Give shapes with their channels along the last axis, where the rows of an array are `rows`."""
    if isinstance(one, ModeSet):
        return np.asarray(one.shapes, dtype=np.complex128)
    array = np.asarray(one, dtype=np.complex128)
    return array.T if rows == "channels" and array.ndim == 2 else array


def _known_hz(one: ModeSet | ArrayLike, shapes: Complex) -> Real:
    return one.frequency_hz if isinstance(one, ModeSet) else np.full(np.atleast_2d(shapes).shape[0], np.nan)


def _unit_length(shapes: ArrayLike, name: str) -> Complex:
    array = np.atleast_2d(np.asarray(shapes, dtype=np.complex128))
    if array.ndim != 2 or array.shape[1] == 0:
        raise EstimateError(f"{name} has shape {array.shape}; shapes are [mode, channel] with at least one channel")
    if not np.all(np.isfinite(array)):
        raise EstimateError(f"{name} holds NaN or infinity; leave such shapes out before they are compared")
    # By the largest component first, so that squares neither overflow nor vanish.
    largest = np.max(np.abs(array), axis=1, keepdims=True)
    if np.any(largest < _LEAST):
        raise EstimateError(f"shape {int(np.argmin(largest))} of {name} is zero at all channels compared")
    array = array / largest
    return np.asarray(array / np.linalg.norm(array, axis=1, keepdims=True), dtype=np.complex128)


def _listed(channels: Sequence[Channel]) -> str:
    return ", ".join(channel.name for channel in channels) or "none"

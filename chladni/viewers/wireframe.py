"""The structure as points and lines, and shapes over channels turned into motion of its points."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Index, Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.geometry import Geometry
from chladni.signals.visible import visible

# The largest motion is drawn as this share of the structure's size.
DRAWN_SHARE = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Wireframe:
    """Points of a geometry, lines between them, and which channels move which point.

    Attributes
    ----------
    names
        Of the points, as they are shown.
    rest
        ``[point, axis]`` where they rest, in metres.
    lines
        Places of the points that each line goes through.
    rows
        Channels that move a point: those of one unit that have a point and a direction.
    measured
        ``[point]`` whether a channel moves it.
    to_motion
        ``[point, axis, row]`` motion of each point per motion of each channel of `rows`.
    """

    names: tuple[str, ...]
    rest: Real
    lines: tuple[tuple[int, ...], ...]
    rows: tuple[int, ...]
    measured: Mask
    to_motion: Real

    @classmethod
    def of(cls, geometry: Geometry, channels: Sequence[Channel]) -> "Wireframe | None":
        """Give the wireframe that `channels` move; None when none of them has a place and a direction in it."""
        rows = _located(geometry, channels)
        if not rows:
            return None
        names = tuple(point.name for point in geometry.points)
        to_motion = np.zeros((len(names), 3, len(rows)))
        measured = np.zeros(len(names), dtype=np.bool_)
        for place, name in enumerate(names):
            here = [column for column, row in enumerate(rows) if channels[row].point == name]
            if here:
                directions = np.array([channels[rows[column]].direction for column in here])
                # Least squares: two sensors along one axis must not move their point twice.
                to_motion[place][:, here] = np.linalg.pinv(directions)
                measured[place] = True
        places = {name: place for place, name in enumerate(names)}
        return cls(
            names=tuple(map(visible, names)),
            rest=np.array([point.position for point in geometry.points], dtype=np.float64),
            lines=tuple(tuple(places[name] for name in line) for line in geometry.lines),
            rows=tuple(rows),
            measured=measured,
            to_motion=to_motion,
        )

    @property
    def size(self) -> float:
        """Diagonal of the box around the points, in metres."""
        # One point, or all in one place: any size does, but zero would draw nothing.
        return float(np.linalg.norm(np.ptp(self.rest, axis=0))) or 1.0

    @property
    def centre(self) -> Real:
        """Middle of the box around the points."""
        return np.asarray((self.rest.min(axis=0) + self.rest.max(axis=0)) / 2)

    @property
    def direction(self) -> Real:
        """From where the structure is looked at: across its thin side, a little from the right and from above."""
        spans = np.ptp(self.rest, axis=0)
        thin_x, thin_z = spans[0] < 0.2 * spans.max(), spans[2] < 0.2 * spans.max()
        if thin_x and spans[1] > 0.2 * spans.max():
            return np.array([1.3, -0.5, 0.45])
        # A floor is looked at from higher than a tower.
        return np.array([0.5, -1.2, 0.9]) if thin_z and not thin_x else np.array([0.5, -1.3, 0.45])

    def motion(self, shapes: NDArray[np.complexfloating]) -> NDArray[np.complexfloating]:
        """Give the motion ``[shape, point, axis]`` of shapes over all channels, ``[shape, channel]``."""
        moved: NDArray[np.complexfloating] = np.einsum("par,sr->spa", self.to_motion, shapes[:, list(self.rows)])
        return moved

    def segments(self, pieces: int) -> tuple[Index, Real]:
        """Cut every line at its points and each part into equal pieces, so that colour can change along it.

        Returns
        -------
        ends : ndarray
            ``[segment, 2]`` places of the points that the segment lies between.
        shares : ndarray
            ``[segment, 2]`` how far from the first to the second point it starts and ends, 0 to 1.
        """
        parts = [pair for line in self.lines for pair in pairwise(line)]
        cuts = np.linspace(0, 1, pieces + 1)
        ends = np.repeat(np.array(parts, dtype=np.intp).reshape(-1, 2), pieces, axis=0)
        return ends, np.tile(np.column_stack([cuts[:-1], cuts[1:]]), (len(parts), 1))


def along(values: NDArray[Any], ends: Index, shares: Real) -> NDArray[Any]:
    """Interpolate what is known at points, ``[..., point, part]``, to both ends of each segment.

    Returns
    -------
    ndarray
        ``[..., segment, end, part]``.
    """
    first, second = values[..., ends[:, 0], :], values[..., ends[:, 1], :]
    return np.asarray(first[..., None, :] + (second - first)[..., None, :] * shares[..., None])


def amplitude(motion: NDArray[np.complexfloating]) -> Real:
    """Give how far each point gets from rest, ``[..., point]``: the long half axis of its ellipse."""
    power = np.sum(np.abs(motion) ** 2, axis=-1)
    # For a motion in one phase both terms are equal, for a circle the second is zero.
    return np.asarray(np.sqrt((power + np.abs(np.sum(motion**2, axis=-1))) / 2))


def furthest(motion: NDArray[np.complexfloating]) -> Real:
    """Give the real shape, largest length 1, at the instant when the point that moves most is furthest from rest."""
    shapes = np.arange(motion.shape[0])
    leader = motion[shapes, amplitude(motion).argmax(axis=1)]
    # Im is turned so that leader . leader is real: then its real part is the long axis of its ellipse.
    turn = np.exp(-0.5j * np.angle(np.sum(leader**2, axis=1)))
    shape = (motion * turn[:, None, None]).real
    largest = np.linalg.norm(shape, axis=2).max(axis=1)
    return np.asarray(shape / np.where(largest > 0, largest, 1.0)[:, None, None])


def _located(geometry: Geometry, channels: Sequence[Channel]) -> list[int]:
    """Channels of one unit that have a point and a direction: motions of different units can't be added."""
    points = {point.name for point in geometry.points}
    units: dict[str, list[int]] = {}
    for row, channel in enumerate(channels):
        if channel.point in points and channel.direction is not None:
            units.setdefault(channel.unit, []).append(row)
    return max(units.values(), key=len, default=[])

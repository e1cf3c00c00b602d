"""Which measured points are neighbours, and along which directions their motions compare."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chladni.modal.shapes.mode_words import joined
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.geometry import Geometry
from chladni.signals.value import Value

# Cosine of a few hundredths of a degree: setup files hold directions with three or four digits.
_PARALLEL = 1e-6
_TRANSLATIONS = ("m", "m/s", "m/s^2")
_FIELD_NAMES = ("x", "y", "z")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Neighbours(Value):
    """Two neighbouring points and what their motions have in common.

    Attributes
    ----------
    between
        The two points, or channels where the channels know no points.
    first, second
        ``[axis, channel]`` real: the motion of either point along orthonormal common directions is this times the
        shape. Without rows when there's no common direction.
    """

    between: tuple[str, str]
    first: Real
    second: Real

    def __post_init__(self) -> None:
        self._freeze()


def neighbours(channels: Sequence[Channel], geometry: Geometry) -> tuple[Neighbours, ...]:
    """Give the pairs of neighbouring points, each pair once.

    Neighbours are the points that a line of the setup file joins; a point of the line without sensor is passed over.
    Without such lines, they follow each other in the order of the channels: points where the channels have points,
    else channels along one direction. `neighbour_note` says so.

    Two points compare along the directions that the sensors of both can measure: translations where both have a
    common one, else rotations. Without a setup file, channels whose names end with the same axis (``.x``) count as
    one direction; those whose names end with none have no direction in common with any.
    """
    at_points = _points(channels)
    named = list(_along_lines(geometry, at_points))
    if named:
        return tuple(_compare(channels, pair, at_points) for pair in named)
    if len(at_points) > 1:
        return tuple(_compare(channels, pair, at_points) for pair in pairwise(at_points))
    # A motion along z relative to one along x says nothing, and the names are all there is to go by.
    groups: dict[tuple[str, str], list[int]] = {}
    for row, channel in enumerate(channels):
        groups.setdefault((_kind(channel), _label(channel)), []).append(row)
    pairs = [pair for rows in groups.values() for pair in pairwise(rows)]
    # Sensors whose direction nothing tells are likely to stand across each other.
    return tuple(
        _alone(channels, pair) if _label(channels[pair[0]]) else _apart(channels, pair) for pair in sorted(pairs)
    )


def neighbour_note(channels: Sequence[Channel], geometry: Geometry) -> str | None:
    """Say what stood in for the lines of a setup file; None when they were there."""
    at_points = _points(channels)
    if next(_along_lines(geometry, at_points), None) is not None:
        return None
    if len(at_points) > 1:
        order = joined([*at_points])
        return f"No line joins the points; they were taken for neighbours in the order of the channels: {order}."
    if any(_label(channel) for channel in channels):
        return (
            "The channels have no points. Relative motion is between channels in the order listed whose names end in "
            "the same letter, and these needn't be neighbours. Give a setup file with points, directions and lines, "
            "and the joint to treat is named."
        )
    return (
        "There is no relative motion, because the channels have no place and no direction. "
        "Give a setup file with points, directions and lines."
    )


def _points(channels: Sequence[Channel]) -> dict[str, list[int]]:
    """Rows of the channels at each point, in the order of the channels."""
    points: dict[str, list[int]] = {}
    for row, channel in enumerate(channels):
        if channel.point is not None:
            points.setdefault(channel.point, []).append(row)
    return points


def _along_lines(geometry: Geometry, at_points: dict[str, list[int]]) -> Iterator[tuple[str, str]]:
    seen = set()
    for line in geometry.lines:
        for pair in pairwise(name for name in line if name in at_points):
            # Lines cross and run both ways: a pair counts once.
            if pair[0] != pair[1] and frozenset(pair) not in seen:
                seen.add(frozenset(pair))
                yield pair


def _alone(channels: Sequence[Channel], rows: tuple[int, int]) -> Neighbours:
    first, second = (np.eye(len(channels))[row : row + 1] for row in rows)
    return Neighbours(between=(channels[rows[0]].name, channels[rows[1]].name), first=first, second=second)


def _apart(channels: Sequence[Channel], rows: tuple[int, int]) -> Neighbours:
    none = np.zeros((0, len(channels)))
    return Neighbours(between=(channels[rows[0]].name, channels[rows[1]].name), first=none, second=none)


def _compare(channels: Sequence[Channel], between: tuple[str, str], at_points: dict[str, list[int]]) -> Neighbours:
    rows = (at_points[between[0]], at_points[between[1]])
    for kind in sorted({_kind(channels[row]) for row in rows[0]}, reverse=True):
        chosen = tuple([row for row in side if _kind(channels[row]) == kind] for side in rows)
        common = _common_axes(channels, chosen[0], chosen[1])
        if common is not None:
            return Neighbours(between=between, first=common[0], second=common[1])
    none = np.zeros((0, len(channels)))
    return Neighbours(between=between, first=none, second=none)


def _common_axes(channels: Sequence[Channel], first: list[int], second: list[int]) -> tuple[Real, Real] | None:
    sides = [[row for row in side if channels[row].direction is not None] for side in (first, second)]
    if all(sides):
        along = [np.array([channels[row].direction for row in side]) for side in sides]
        axes = _intersection(along[0], along[1])
        if axes.shape[1]:
            readings = [_reading(channels, side, one, axes) for side, one in zip(sides, along, strict=True)]
            return readings[0], readings[1]
    # Sensors of unknown direction compare by the axis that their names end with.
    for a in first:
        for b in second:
            unknown = channels[a].direction is None and channels[b].direction is None
            if unknown and _label(channels[a]) == _label(channels[b]) != "":
                pair = _alone(channels, (a, b))
                return pair.first, pair.second
    return None


def _intersection(a: Real, b: Real) -> Real:
    """Orthonormal columns ``[3, axis]`` of the directions that lie in the span of the rows of both.

    They belong to the principal angles of zero between the two spans (Golub & Van Loan 2013, section 6.4.3).
    """
    basis_a, basis_b = _span(a), _span(b)
    # Singular values of the product of two orthonormal bases are the cosines of the principal angles.
    left, cosines, _ = np.linalg.svd(basis_a.T @ basis_b)
    return np.asarray(basis_a @ left[:, : int(np.sum(cosines > 1 - _PARALLEL))], dtype=np.float64)


def _span(directions: Real) -> Real:
    left, sizes, _ = np.linalg.svd(directions.T, full_matrices=False)
    # Two directions less than 0.1 degrees apart measure one axis, whose noise the other would only magnify.
    return np.asarray(left[:, sizes > 1e-3 * sizes[0]], dtype=np.float64)


def _reading(channels: Sequence[Channel], rows: list[int], directions: Real, axes: Real) -> Real:
    """``[axis, channel]`` weights of the channels that give the motion along `axes`, by least squares."""
    weights = np.zeros((axes.shape[1], len(channels)))
    weights[:, rows] = (np.linalg.pinv(directions, rcond=1e-3).T @ axes).T
    return weights


def _kind(channel: Channel) -> str:
    # The names are ordered: translation is compared before rotation, and known motions before what a unit hides.
    if channel.unit in _TRANSLATIONS:
        return "translation"
    return "rotation" if channel.unit.startswith("rad") else f"in {channel.unit}"


def _label(channel: Channel) -> str:
    last = channel.name.rpartition(".")[2]
    return last if last in _FIELD_NAMES else ""

"""Shapes over channels turned into motion of points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.signals.channel import Channel, Vector, unit_direction
from chladni.signals.geometry import Geometry, Point
from chladni.viewers.wireframe import Wireframe, along, amplitude, furthest
from tests.viewers import synthetic_modes as made

GEOMETRY = Geometry(
    points=(
        Point(name="a", position=(0.0, 0.0, 0.0)),
        Point(name="b", position=(2.0, 0.0, 0.0)),
        Point(name="c", position=(2.0, 1.0, 0.0)),
    ),
    lines=(("a", "b", "c"),),
)


def channel(point: str | None, direction: Vector | str | None, unit: str = "m/s^2", name: str = "") -> Channel:
    vector = None if direction is None else unit_direction(direction)
    return Channel(name=name or f"/{point}.{direction}", unit=unit, point=point, direction=vector)


def wireframe(*channels: Channel) -> Wireframe:
    found = Wireframe.of(GEOMETRY, channels)
    assert found is not None
    return found


def test_a_channel_moves_its_point_along_its_own_direction() -> None:
    frame = wireframe(channel("a", "+x"), channel("b", "-z"))
    motion = frame.motion(np.array([[0.5, 1j]]))
    np.testing.assert_array_equal(motion[0], [[0.5, 0, 0], [0, 0, -1j], [0, 0, 0]])
    np.testing.assert_array_equal(frame.measured, [True, True, False])


def test_a_triaxial_sensor_gives_the_vector_and_skew_axes_do_too() -> None:
    moved = np.array([0.3, -0.4, 1.0])
    for axes in (["+x", "+y", "+z"], [(1.0, 1.0, 0.0), (0.0, 1.0, 1.0), (1.0, 0.0, 2.0)]):
        channels = [channel("b", axis) for axis in axes]  # type: ignore[arg-type]
        seen = np.array([[np.dot(moved, one.direction) for one in channels if one.direction]])
        # Rounding of a pseudo-inverse of a small matrix.
        np.testing.assert_allclose(wireframe(*channels).motion(seen + 0j)[0, 1].real, moved, rtol=1e-13)


def test_two_sensors_along_one_axis_move_their_point_once() -> None:
    frame = wireframe(channel("a", "+x", name="/1"), channel("a", "-x", name="/2"))
    np.testing.assert_allclose(frame.motion(np.array([[1.0, -1.0]]))[0, 0], [1.0, 0, 0], rtol=1e-14)


def test_channels_without_a_place_or_of_another_unit_are_left_out() -> None:
    channels = (
        channel("a", "+x"),
        channel("b", "+x"),
        channel("b", "+z", unit="rad/s"),
        channel("elsewhere", "+x"),
        channel("c", None),
        channel(None, "+x"),
    )
    assert wireframe(*channels).rows == (0, 1)
    assert Wireframe.of(GEOMETRY, channels[3:]) is None
    assert Wireframe.of(Geometry(), channels) is None


def test_segments_cover_the_lines_and_interpolate_between_points() -> None:
    frame = wireframe(channel("a", "+x"))
    ends, shares = frame.segments(4)
    drawn = along(frame.rest, ends, shares)
    assert drawn.shape == (8, 2, 3)
    np.testing.assert_array_equal(drawn[0, 0], [0, 0, 0])
    np.testing.assert_allclose(drawn[0, 1], [0.5, 0, 0])
    np.testing.assert_array_equal(drawn[3, 1], [2, 0, 0])
    np.testing.assert_array_equal(drawn[-1, 1], [2, 1, 0])
    # Each piece starts where the one before it ends.
    np.testing.assert_allclose(drawn[1:, 0], drawn[:-1, 1])


def test_a_structure_in_one_place_still_has_a_size() -> None:
    alone = Wireframe.of(Geometry(points=GEOMETRY.points[:1]), [channel("a", "+x")])
    assert alone is not None
    assert alone.size == 1.0
    ends, _ = alone.segments(3)
    assert ends.shape == (0, 2)


@given(angle=st.floats(0, 2 * np.pi), flat=st.floats(0, 1), turn=st.floats(0, 2 * np.pi))
def test_amplitude_is_the_long_half_axis_of_the_ellipse(angle: float, flat: float, turn: float) -> None:
    axes = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0]])
    ellipse = (axes[0] + 1j * flat * axes[1]) * np.exp(1j * turn)
    assert amplitude(ellipse[None])[0] == pytest.approx(1.0, rel=1e-12)


def test_furthest_has_length_one_at_the_point_that_moves_most() -> None:
    motion = np.array([[[0.2j, 0, 0], [-2j, 0, 0]], [[0, 0, 0], [0, 0, 0]]])
    shape = furthest(motion)
    np.testing.assert_allclose(np.abs(shape[0, :, 0]), [0.1, 1.0], rtol=1e-12)
    assert shape[0, 0, 0] * shape[0, 1, 0] < 0
    np.testing.assert_array_equal(shape[1], 0)


@pytest.mark.parametrize("thin", [0, 1, 2])
def test_a_flat_structure_is_not_looked_at_edge_on(thin: int) -> None:
    corners = np.array([[0.0, 0, 0], [1, 1, 1], [1, 0, 0], [0, 1, 1], [1, 1, 0], [0, 0, 1]])
    corners[:, thin] = 0
    points = tuple(Point(name=str(at), position=tuple(corner.tolist())) for at, corner in enumerate(corners))
    frame = Wireframe.of(Geometry(points=points), [channel("0", "+x")])
    assert frame is not None
    direction = frame.direction / np.linalg.norm(frame.direction)
    assert abs(direction[thin]) > 0.5


def test_every_point_of_a_plate_is_moved_by_its_own_channel() -> None:
    study = made.plate_study(4, 3, count=2)
    assert study.modes is not None
    frame = Wireframe.of(study.geometry, study.modes.channels)
    assert frame is not None
    np.testing.assert_array_equal(frame.motion(study.modes.shapes)[:, :, 2], study.modes.shapes)

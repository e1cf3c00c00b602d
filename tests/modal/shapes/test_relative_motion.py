"""Relative motion of neighbours: closed forms by hand, directions, and error bars by Monte Carlo."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.modal.shapes.neighbours import neighbour_note
from chladni.modal.shapes.relative_motion import magnitude_std, relative_motion
from chladni.modal.shapes.shape_transmissibility import shape_transmissibility
from chladni.signals.channel import Channel, Vector, unit_direction
from chladni.signals.geometry import Geometry, Point
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.relative_motion import RelativeMotion
from tests import strategies as ours
from tests.modal.mode_makers import mode_set

NAMES = ("base", "column", "arm", "wrist")
ARM = Geometry(
    points=tuple(Point(name=name, position=(0.0, 0.0, float(height))) for height, name in enumerate(NAMES)),
    lines=(NAMES,),
)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def at(point: str, direction: str | Vector | None = "+x", unit: str = "m/s^2") -> Channel:
    vector = None if direction is None else unit_direction(direction)
    return Channel(name=f"/{point}.{direction}", unit=unit, point=point, direction=vector)


def placed(shapes: object, channels: tuple[Channel, ...]) -> ModeSet:
    return replace(mode_set(shapes), channels=channels)  # type: ignore[arg-type]


def ratios(motions: tuple[RelativeMotion, ...]) -> dict[tuple[str, str], float | None]:
    return {motion.between: motion.ratio for motion in motions}


def test_neighbours_along_a_line_are_ranked_within_each_mode() -> None:
    modes = placed([[0.1, 0.3, 0.9, 1.0], [1.0, -0.5, 0.2, 0.2j]], tuple(at(name) for name in NAMES))
    found = relative_motion(modes, ARM)
    expected = [
        (0, ("column", "arm"), 0.6),
        (0, ("base", "column"), 0.2),
        (0, ("arm", "wrist"), 0.1),
        (1, ("base", "column"), 1.5),
        (1, ("column", "arm"), 0.7),
        (1, ("arm", "wrist"), 0.2 * sqrt(2)),
    ]
    assert [(motion.mode, motion.between) for motion in found] == [(mode, pair) for mode, pair, _ in expected]
    np.testing.assert_allclose([motion.ratio for motion in found], [ratio for _, _, ratio in expected], rtol=1e-12)
    assert all(motion.damping_gain is None and motion.stiffness_gain_hz is None for motion in found)
    assert neighbour_note(modes.channels, ARM) is None


def test_a_sensor_turned_round_changes_nothing() -> None:
    modes = placed([[1.0, 0.4]], (at("base", "+x"), at("column", "+x")))
    turned = placed([[1.0, -0.4]], (at("base", "+x"), at("column", "-x")))
    assert ratios(relative_motion(modes, ARM)) == pytest.approx(ratios(relative_motion(turned, ARM)))


def test_no_common_direction_has_no_ratio_and_stands_last() -> None:
    channels = (at("base", "+x"), at("column", "+y"), at("arm", "+y"))
    found = relative_motion(placed([[1.0, 0.5, 0.4]], channels), ARM)
    assert [(motion.between, motion.ratio) for motion in found[1:]] == [(("base", "column"), None)]
    assert found[1].ratio_std is None
    assert found[0].ratio == pytest.approx(0.1)


def test_a_rotation_isnt_compared_with_a_translation() -> None:
    channels = (at("base", "+x"), at("column", "+x", "rad/s"), at("arm", "+x", "rad/s"))
    found = ratios(relative_motion(placed([[1.0, 0.5, 0.2]], channels), ARM))
    assert found[("base", "column")] is None
    assert found[("column", "arm")] == pytest.approx(0.3)


def test_triaxial_points_compare_where_they_move_most_against_each_other() -> None:
    channels = tuple(at(point, axis) for point in ("base", "arm") for axis in ("+x", "+y", "+z"))
    # Against each other by (0.3, 0.4, 0): along (3, 4, 0)/5 that's 0.5.
    found = relative_motion(placed([[1.0, 0.2, 0.1, 0.7, -0.2, 0.1]], channels), ARM)
    assert found[0].between == ("base", "arm"), "the column, without sensor, is passed over"
    assert found[0].ratio == pytest.approx(0.5)


@given(st.floats(0, 6), st.floats(-1.5, 1.5), st.floats(0, 6))
def test_triaxial_sensors_turned_against_each_other_compare_all_the_same(a: float, b: float, c: float) -> None:
    rotation = (
        np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
        @ np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        @ np.array([[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]])
    )
    base, arm = np.array([1.0, 0.2, 0.1]), np.array([0.7, -0.2, 0.1 + 0.3j])
    straight = tuple(at(point, axis) for point in ("base", "arm") for axis in (X, Y, Z))
    turned = straight[:3] + tuple(at("arm", unit_direction(row)) for row in rotation)
    expected = relative_motion(placed([[*base, *arm]], straight), ARM)[0]
    found = relative_motion(placed([[*base, *(rotation @ arm)]], turned), ARM)[0]
    assert found.ratio == pytest.approx(expected.ratio, rel=1e-9)


def test_oblique_sensors_compare_in_the_plane_that_both_span() -> None:
    oblique = (at("arm", unit_direction([1, 1, 0])), at("arm", unit_direction([1, -1, 0])))
    modes = placed([[1.0, 0.5 / sqrt(2), 0.5 / sqrt(2)]], (at("base", "+x"), *oblique))
    # The arm moves by 0.5 along x and 0 along y; the base is known along x only.
    assert relative_motion(modes, ARM)[0].ratio == pytest.approx(0.5)
    out_of_plane = replace(modes, channels=(at("base", "+z"), *oblique))
    assert relative_motion(out_of_plane, ARM)[0].ratio is None


def test_points_without_lines_follow_each_other() -> None:
    modes = placed([[1.0, 0.4, 0.1]], (at("wrist"), at("base"), at("arm")))
    assert set(ratios(relative_motion(modes, Geometry()))) == {("wrist", "base"), ("base", "arm")}
    assert neighbour_note(modes.channels, Geometry()) == (
        "No line joins the points; they were taken for neighbours in the order of the channels: wrist, base and arm."
    )


def test_without_a_setup_file_channels_of_one_axis_follow_each_other() -> None:
    names = ("/a.linear.x", "/a.linear.z", "/b.linear.x", "/b.linear.z", "/daq.ch1", "/c.linear.z")
    modes = mode_set([[1.0, 0.5, 0.3, 0.1, 0.9, -0.2]], names=names)
    found = ratios(relative_motion(modes, Geometry()))
    assert found == pytest.approx(
        {
            ("/a.linear.x", "/b.linear.x"): 0.7,
            ("/a.linear.z", "/b.linear.z"): 0.4,
            ("/b.linear.z", "/c.linear.z"): 0.3,
        }
    )
    note = neighbour_note(modes.channels, Geometry())
    assert note is not None
    assert "in the order listed" in note


def test_a_point_without_direction_compares_by_the_name_of_its_axis() -> None:
    channels = tuple(
        Channel(name=f"/{point}.accel.{axis}", point=point) for point in ("base", "arm") for axis in "xz"
    )
    found = relative_motion(placed([[1.0, 0.5, 0.7, 0.1]], channels), ARM)
    assert found[0].ratio == pytest.approx(0.3)
    mixed = (at("base", "+x"), at("arm", None))
    assert relative_motion(placed([[1.0, 0.5]], mixed), ARM)[0].ratio is None


def test_error_bars_agree_with_the_scatter_of_many_runs() -> None:
    rng = np.random.default_rng(5)
    runs, true = 4000, np.array([1.0, 0.5 + 0.1j, -0.3 + 0.2j])
    std = np.array([0.0, 0.02 + 0.01j, 0.005 + 0.03j])
    noisy = true + std.real * rng.normal(size=(runs, 3)) + 1j * std.imag * rng.normal(size=(runs, 3))
    channels = tuple(at(name) for name in NAMES[:3])
    modes = replace(placed(noisy, channels), shape_std=np.broadcast_to(std, noisy.shape))
    found = relative_motion(modes, ARM)
    for pair in (("base", "column"), ("column", "arm")):
        ratio = [motion.ratio for motion in found if motion.between == pair]
        predicted = np.mean([motion.ratio_std for motion in found if motion.between == pair])  # type: ignore[arg-type]
        # A standard deviation of 4000 runs is good to 1/sqrt(8000) = 1.1 %; three of those.
        assert np.std(ratio) == pytest.approx(predicted, rel=0.035)  # type: ignore[arg-type]


def test_unknown_error_bars_stay_unknown() -> None:
    modes = replace(placed([[1.0, 0.4]], (at("base"), at("arm"))), shape_std=np.full((1, 2), np.nan * (1 + 1j)))
    assert relative_motion(modes, ARM)[0].ratio_std is None
    assert shape_transmissibility(modes, ARM)[0].ratio_std is None


def test_magnitude_without_direction() -> None:
    assert magnitude_std(0j, 3.0, 4.0) == pytest.approx(5 / sqrt(2))
    assert magnitude_std(2j, 3.0, 4.0) == 4.0


def scaled(unit: str = "N", motion: str = "m/s^2", mass: float = 2.0) -> ModeSet:
    modes = placed([[1.0, 0.4]], (at("base", unit=motion), at("arm", unit=motion)))
    scale = ModalScale(
        response=modes.channels[0].name,
        reference="hammer",
        modal_a=2j * 2 * pi * modes.frequency_hz * np.sqrt(1 - modes.damping_ratio**2) * mass,
        modal_mass=np.array([mass]),
        modal_mass_std=np.array([0.1]),
    )
    hammer = (Channel(name="hammer", unit=unit, role="reference"),)
    return replace(modes, scale=scale, references=hammer, participation=np.ones((1, 1), complex))


def test_gains_of_scaled_shapes() -> None:
    found = relative_motion(scaled(), ARM)[0]
    omega = 2 * pi * 10
    assert found.damping_gain == pytest.approx(0.6**2 / 2.0 / (2 * omega))
    assert found.stiffness_gain_hz == pytest.approx(0.6**2 / 2.0 / (2 * omega) / (2 * pi))


@pytest.mark.parametrize(
    "modes", [scaled(unit="V"), scaled(motion="rad/s^2"), scaled(mass=float("nan")), scaled(mass=-1.0)]
)
def test_gains_need_kilograms(modes: ModeSet) -> None:
    assert relative_motion(modes, ARM)[0].damping_gain is None


def test_transmissibility_along_the_structure() -> None:
    modes = placed([[0.5, 0.25j, 1.0, 0.0]], tuple(at(name) for name in NAMES))
    found = shape_transmissibility(modes, ARM)
    assert [step.between for step in found] == [("base", "column"), ("column", "arm"), ("arm", "wrist")]
    np.testing.assert_allclose([step.ratio for step in found], [0.5, 4.0, 0.0], rtol=1e-12)  # type: ignore[misc]
    assert found[0].phase_deg == pytest.approx(90.0)
    assert found[1].phase_deg == pytest.approx(-90.0)
    assert found[2].phase_deg is None
    still = placed([[0.0, 1.0]], (at("base"), at("column")))
    assert shape_transmissibility(still, ARM)[0].ratio is None


def test_error_bar_of_transmissibility() -> None:
    rng = np.random.default_rng(6)
    runs, std = 4000, 0.01
    noisy = np.array([0.5, 0.8, 1.0]) + std * (rng.normal(size=(runs, 3)) + 1j * rng.normal(size=(runs, 3)))
    modes = placed(noisy, tuple(at(name) for name in NAMES[:3]))
    modes = replace(modes, shape_std=np.full(noisy.shape, std * (1 + 1j)))
    first = [step for step in shape_transmissibility(modes, ARM) if step.between == ("base", "column")]
    predicted = np.mean([step.ratio_std for step in first])  # type: ignore[arg-type]
    assert np.std([step.ratio for step in first]) == pytest.approx(predicted, rel=0.05)  # type: ignore[arg-type]


@given(ours.mode_sets(max_channels=4), ours.geometries())
def test_ratios_stay_within_their_bounds(modes, geometry) -> None:  # type: ignore[no-untyped-def]
    found = relative_motion(modes, geometry)
    for mode in range(modes.frequency_hz.size):
        own = [motion.ratio for motion in found if motion.mode == mode]
        known = [ratio for ratio in own if ratio is not None]
        assert own[: len(known)] == sorted(known, reverse=True)
        # Two vectors of up to four components, none above 1.
        assert all(0 <= ratio <= 2 * sqrt(3) * 1.001 + 2 for ratio in known)


def test_channels_that_nothing_gives_a_direction_have_no_relative_motion() -> None:
    (unknown,) = relative_motion(mode_set([[1.0, 0.5]]), Geometry())
    assert (unknown.between, unknown.ratio) == (("c0", "c1"), None)
    (known,) = relative_motion(mode_set([[1.0, 0.5]], names=("/a.z", "/b.z")), Geometry())
    assert known.ratio == pytest.approx(0.5)
    assert "no relative motion" in (neighbour_note(mode_set([[1.0, 0.5]]).channels, Geometry()) or "")

"""What every value record keeps: read-only arrays, its axis and unit, and clear refusals."""

import copy
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.clock.time_base import TimeBase, fit_time_base
from chladni.signals.channel import AXES, Channel, unit_direction
from chladni.signals.coherence import Coherence
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import ChladniError, EstimateError, LogError, ModelError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry, Point
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.study import Study
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value
from chladni.signals.waterfall import Waterfall
from tests import strategies as ours

values = st.one_of(
    ours.time_series(),
    ours.cross_spectra(),
    ours.power_spectral_densities(),
    ours.frequency_responses(),
    ours.coherences(),
    ours.waterfalls(),
    ours.mode_sets(),
    ours.mode_validations(),
    ours.modal_scales(2),
    ours.order_spreads(2),
    ours.modal_fits(2, 1, modes=2),
    ours.stabilisation_diagrams(2),
    st.just(fit_time_base(np.arange(0, 10**9, 10**7))),
)

AXIS = np.array([0.0, 1.0, 2.0])
TWO = (Channel(name="a", unit="N"), Channel(name="b", unit="m/s^2"))


def arrays_of(value: Value) -> dict[str, np.ndarray[Any, Any]]:
    found = {field.name: getattr(value, field.name) for field in fields(value)}  # type: ignore[arg-type]
    return {name: content for name, content in found.items() if isinstance(content, np.ndarray)}


def by_pickle(value: Value) -> Value:
    restored: Value = pickle.loads(pickle.dumps(value))  # noqa: S301  # our own bytes
    return restored


@given(values)
def test_arrays_cant_be_written_to(value: Value) -> None:
    for array in arrays_of(value).values():
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, by_pickle])
@given(value=values)
def test_a_copy_is_equal_and_read_only_too(copied: Callable[[Value], Value], value: Value) -> None:
    again = copied(value)
    assert_close(again, value, rtol=0.0)
    assert again is not value
    for array in arrays_of(again).values():
        assert not array.flags.writeable


def test_a_deep_copy_shares_no_memory() -> None:
    source = np.zeros((1, 4))
    series = TimeSeries(values=source, sample_rate_hz=1.0, channels=TWO[:1])
    deep = copy.deepcopy(series)
    source[:] = 7.0
    assert series.values.max() == 7.0, "a series is a view: no copy of a gigabyte"
    assert deep.values.max() == 0.0


@given(values)
def test_bare_numpy_is_refused(value: Value) -> None:
    name = type(value).__name__
    with pytest.raises(TypeError, match=f"{name} carries units"):
        np.asarray(value)
    for operation in (lambda: value * 2, lambda: 2 * value, lambda: np.ones(3) * value, lambda: np.abs(value)):  # type: ignore[operator, call-overload]
        with pytest.raises(TypeError):
            operation()


@given(values)
def test_fields_are_frozen_and_closed(value: Value) -> None:
    with pytest.raises(FrozenInstanceError):
        setattr(value, fields(value)[0].name, None)  # type: ignore[arg-type]
    with pytest.raises((AttributeError, TypeError)):
        value.something_else = 1  # type: ignore[attr-defined]
    assert not hasattr(value, "__dict__")


def series(shape: tuple[int, ...] = (2, 4), **other: Any) -> TimeSeries:
    return TimeSeries(**{"values": np.zeros(shape), "sample_rate_hz": 10.0, "channels": TWO} | other)


def cross(**other: Any) -> CrossSpectra:
    base = {"frequency_hz": AXIS, "density": np.zeros((2, 2, 3), complex), "channels": TWO, "bandwidth_hz": 1.0}
    return CrossSpectra(**base | {"provenance": Provenance()} | other)


def density(**other: Any) -> PowerSpectralDensity:
    base = {"frequency_hz": AXIS, "values": np.zeros((2, 3)), "std": np.zeros((2, 3)), "channels": TWO}
    return PowerSpectralDensity(**base | {"bandwidth_hz": 1.0, "provenance": Provenance()} | other)


def response(**other: Any) -> FrequencyResponse:
    base = {"frequency_hz": AXIS, "values": np.zeros((1, 1, 3), complex), "std": np.zeros((1, 1, 3))}
    base |= {"coherence": np.zeros((1, 3)), "excited": np.ones(3, bool)}
    return FrequencyResponse(
        **base | {"references": TWO[:1], "responses": TWO[1:], "provenance": Provenance()} | other
    )


def coherence(**other: Any) -> Coherence:
    base = {"frequency_hz": AXIS, "values": np.zeros((1, 3)), "std": np.zeros((1, 3)), "kind": "ordinary"}
    return Coherence(**base | {"references": TWO[:1], "responses": TWO[1:], "provenance": Provenance()} | other)


def waterfall(**other: Any) -> Waterfall:
    base = {"time_s": np.arange(4.0), "frequency_hz": AXIS, "values": np.zeros((2, 4, 3)), "channels": TWO}
    return Waterfall(**base | {"start_time_ns": 0, "bandwidth_hz": 1.0, "provenance": Provenance()} | other)


@pytest.mark.parametrize(
    ("make", "wrong", "words"),
    [
        (series, {"values": np.zeros(4)}, "floating point [channel, sample]"),
        (series, {"values": np.zeros((2, 4), int)}, "int64"),
        (series, {"values": np.zeros((3, 4))}, "2 channels asks for (2, 4)"),
        (series, {"valid": np.ones((2, 3), bool)}, "valid has shape (2, 3)"),
        (series, {"sample_rate_hz": 0.0}, "sample rate 0.0 Hz must be finite and positive"),
        (series, {"sample_rate_hz": float("nan")}, "finite and positive"),
        (series, {"sample_rate_hz": float("inf")}, "finite and positive"),
        (series, {"sample_rate_hz": 1e-320}, "its period no centuries"),
        (series, {"sample_rate_hz": 2e-10}, "end farther from 1970 than nanoseconds of 64 bits count"),
        (series, {"start_time_ns": 2**63}, "check the rate and the start"),
        (series, {"channels": (TWO[0], TWO[0])}, "names must be unique, got a, a"),
        (cross, {"density": np.zeros((2, 2, 4), complex)}, "density has shape (2, 2, 4)"),
        (cross, {"noise_density": np.zeros((2, 2, 4), complex)}, "noise_density has shape"),
        (cross, {"frequency_hz": np.array([0.0, 2.0, 1.0])}, "strictly rising"),
        (cross, {"frequency_hz": np.array([0.0, 1.0, np.nan])}, "finite"),
        (cross, {"frequency_hz": np.zeros((1, 3))}, "one-dimensional"),
        (density, {"values": np.zeros((1, 3))}, "values has shape (1, 3)"),
        (density, {"std": np.zeros((2, 4))}, "std has shape (2, 4)"),
        (density, {"frequency_hz": np.array([0.0, 0.0, 1.0])}, "strictly rising"),
        (response, {"values": np.zeros((1, 2, 3), complex)}, "responses x references x frequencies"),
        (response, {"std": np.zeros((1, 1, 4))}, "std has shape"),
        (response, {"coherence": np.zeros((2, 3))}, "coherence has shape (2, 3)"),
        (response, {"excited": np.ones(2, bool)}, "excited has shape (2,)"),
        (response, {"frequency_hz": AXIS[::-1]}, "strictly rising"),
        (coherence, {"values": np.zeros((2, 3))}, "responses x frequencies"),
        (coherence, {"std": np.zeros((1, 2))}, "std has shape (1, 2)"),
        (coherence, {"frequency_hz": AXIS * 0}, "strictly rising"),
        (waterfall, {"values": np.zeros((2, 3, 3))}, "channels x times x frequencies asks for (2, 4, 3)"),
        (waterfall, {"time_s": np.zeros(4)}, "time_s must be one-dimensional and strictly rising"),
        (waterfall, {"frequency_hz": -AXIS}, "strictly rising"),
    ],
)
def test_what_doesnt_fit_together_is_refused_with_both_sides(
    make: Callable[..., Value], wrong: dict[str, Any], words: str
) -> None:
    make()
    with pytest.raises(EstimateError) as caught:
        make(**wrong)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_time_base_knots_must_match() -> None:
    base = fit_time_base(np.arange(0, 10**9, 10**7))
    with pytest.raises(EstimateError, match="knots_index has shape"):
        replace(base, knots_index=np.zeros(9))
    with pytest.raises(EstimateError, match="resumed_shift has shape"):
        replace(base, resumed_shift=np.zeros(9, dtype=np.int64))
    assert isinstance(base, TimeBase)


def test_series_times_come_from_the_index() -> None:
    # 0.1 s added up 10^6 times is off by 1e-6 s; the index times the period isn't.
    long = series((1, 10**6), channels=TWO[:1], start_time_ns=1_700_000_000_000_000_007)
    assert long.times_s()[-1] == 99_999.9
    assert long.times_ns()[-1] == 1_700_000_000_000_000_007 + 99_999_900_000_000
    assert long.duration_s == 100_000.0


def test_series_select_and_index() -> None:
    both = series(values=np.arange(8.0).reshape(2, 4), valid=np.arange(8).reshape(2, 4) > 0)
    swapped = both.select(["b", "a"])
    assert [channel.name for channel in swapped.channels] == ["b", "a"]
    np.testing.assert_array_equal(swapped.values, [[4, 5, 6, 7], [0, 1, 2, 3]])
    assert swapped.valid is not None
    assert not swapped.valid[1, 0]
    assert not both.all_valid()
    assert both.select(["b"]).all_valid()
    assert series().all_valid()
    with pytest.raises(EstimateError, match="no channel 'c'; there are: a, b"):
        both.index("c")


@pytest.mark.parametrize(
    ("start_s", "end_s", "first", "last"),
    [(None, None, 0, 10), (0.2, 0.5, 2, 5), (0.25, 0.55, 3, 6), (0.1 + 0.2, None, 3, 10), (-1.0, 99.0, 0, 10)],
)
def test_series_window_is_half_open_and_a_view(
    start_s: float | None, end_s: float | None, first: int, last: int
) -> None:
    whole = series(values=np.arange(20.0).reshape(2, 10), valid=np.ones((2, 10), bool), start_time_ns=5)
    part = whole.window(start_s=start_s, end_s=end_s)
    np.testing.assert_array_equal(part.values[0], np.arange(first, last))
    assert part.start_time_ns == 5 + first * 100_000_000
    assert np.shares_memory(part.values, whole.values)
    assert part.valid is not None
    assert part.valid.shape == part.values.shape


def test_an_empty_window_is_refused() -> None:
    with pytest.raises(EstimateError, match=r"no sample between 3.0 s and 4.0 s; the series is 0.4 s long"):
        series().window(start_s=3.0, end_s=4.0)


def test_series_with_channels() -> None:
    renamed = series().with_channels([TWO[0].with_name("x"), TWO[1]])
    assert renamed.channels[0] == Channel(name="x", unit="N")


@given(ours.time_series(gaps=True))
def test_a_drawn_series_keeps_its_rules(one: TimeSeries) -> None:
    assert one.values.shape == (len(one.channels), one.samples)
    if one.valid is not None:
        assert np.isnan(one.values[~one.valid]).all()


@given(ours.cross_spectra())
def test_drawn_spectra_are_hermitian_and_positive(spectra: CrossSpectra) -> None:
    matrices = np.moveaxis(spectra.density, -1, 0)
    scale = np.abs(matrices).max() + 1.0
    np.testing.assert_allclose(matrices, matrices.conj().swapaxes(1, 2), atol=1e-15 * scale)
    assert np.linalg.eigvalsh(matrices).min() >= -1e-13 * scale
    assert spectra.index(spectra.channels[0].name) == 0
    with pytest.raises(EstimateError, match="no channel"):
        spectra.index("nowhere")


def test_units_follow_from_the_channels() -> None:
    assert density().units == ("N^2/Hz", "(m/s^2)^2/Hz")
    assert response().unit(0, 0) == "(m/s^2)/N"
    assert response().function("b", "a") == (0, 0)
    with pytest.raises(EstimateError, match="no response 'a'; there are: b"):
        response().function("a", "b")
    with pytest.raises(EstimateError, match="no reference 'b'; there are: a"):
        response().function("b", "b")


def test_directions() -> None:
    assert all(np.linalg.norm(vector) == 1 for vector in AXES.values())
    assert unit_direction([0, -2, 0]) == AXES["-y"]
    for wrong in ("z", [0, 0, 0], [1, 2], [np.inf, 0, 0], [np.nan, 0, 0]):
        with pytest.raises(SetupError, match="direction"):
            unit_direction(wrong)


def test_geometry() -> None:
    points = (Point(name="base", position=(0.0, 0.0, 0.0)), Point(name="arm", position=(0.0, 0.0, 1.0)))
    geometry = Geometry(points=points, lines=(("base", "arm"),))
    assert geometry.position("arm") == (0.0, 0.0, 1.0)
    with pytest.raises(SetupError, match="no point 'leg'; points: base, arm"):
        geometry.position("leg")
    with pytest.raises(SetupError, match="points: none"):
        Geometry().position("leg")
    with pytest.raises(SetupError, match="'base' is defined 2 times"):
        Geometry(points=points[:1] * 2)
    with pytest.raises(SetupError, match="goes through 'leg', which is no point; points: base, arm"):
        Geometry(points=points, lines=(("base", "leg"),))


@given(ours.geometries())
def test_a_drawn_geometry_finds_its_points(geometry: Geometry) -> None:
    for point in geometry.points:
        assert geometry.position(point.name) == point.position


def test_provenance() -> None:
    made = Provenance(window="hann", averages=8).with_notes("first", "second", "first").with_notes("second", "third")
    assert made.notes == ("first", "second", "third")
    assert made.with_estimator("H2") == replace(made, estimator="H2")


def test_a_study_starts_empty() -> None:
    study = Study(title="log")
    assert study.peaks == study.findings == ()
    assert study.geometry == Geometry()
    peak = Peak(frequency_hz=1.0, frequency_std_hz=0.1, height=2.0, height_std=0.2, unit="N", channels=("a",))
    assert Study(title="log", peaks=(peak,)).peaks[0].channels == ("a",)


@pytest.mark.parametrize("kind", [LogError, SetupError, ModelError, EstimateError])
def test_one_shallow_tree_of_errors(kind: type[ChladniError]) -> None:
    assert kind.__bases__ == (ChladniError,)


def test_assert_close_sees_every_difference() -> None:
    one = density(values=np.ones((2, 3)))
    assert_close(one, density(values=np.full((2, 3), 1 + 1e-9)), rtol=1e-8)
    assert_close(one, replace(one, provenance=Provenance(estimator="other")), rtol=0.0)
    different = [
        density(values=np.full((2, 3), 1.1)),
        replace(one, bandwidth_hz=2.0),
        replace(one, channels=TWO[::-1]),
    ]
    for other in different:
        with pytest.raises(AssertionError, match=r"PowerSpectralDensity\.|Not equal"):
            assert_close(one, other, rtol=1e-8)
    with pytest.raises(AssertionError, match="is no"):
        assert_close(one, cross(), rtol=1.0)
    masked = [series(valid=np.full((2, 4), flag)) for flag in (True, False)]
    with pytest.raises(AssertionError):
        assert_close(masked[0], masked[1], rtol=1.0)
    with pytest.raises(AssertionError):
        assert_close(masked[0], series(), rtol=1.0)


@pytest.mark.parametrize("scale", [1e308, 1.0, 1e-300, 5e-324])
def test_directions_of_any_length(scale: float) -> None:
    assert unit_direction([scale, 0.0, -scale]) == pytest.approx((0.5**0.5, 0.0, -(0.5**0.5)), rel=1e-15)


@pytest.mark.parametrize("direction", [[1e308, float("inf"), 0.0], [0, 0, 0], [10**400, 0, 0], [1, 2], "x" * 100_000])
def test_what_is_no_direction_is_told_briefly(direction: list[float] | str) -> None:
    with pytest.raises(SetupError, match="direction") as caught:
        unit_direction(direction)
    assert len(str(caught.value)) < 200

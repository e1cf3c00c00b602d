"""Values made of arrays: shapes, names, units, what is unknown, and what is refused."""

import numpy as np
import pytest

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries

G = 9.80665
LINES = np.array([1.0, 2.0, 4.0])


def made(values, **options):
    return TimeSeries.from_arrays(values, sample_rate_hz=10.0, **options)


@pytest.mark.parametrize("values", [np.ones((2, 5)), np.ones((2, 5), dtype=np.int16), [[1] * 5] * 2])
def test_a_series_has_a_row_for_each_channel(values):
    series = made(values)
    assert [channel.name for channel in series.channels] == ["ch1", "ch2"]
    assert series.values.shape == (2, 5)
    assert series.values.dtype == np.float64
    assert series.valid is None


def test_one_channel_needs_no_second_axis():
    assert made([1.0, 2.0, 3.0]).values.tolist() == [[1.0, 2.0, 3.0]]


def test_no_sample_is_copied_where_the_unit_is_si():
    values = np.ones((2, 5))
    assert np.shares_memory(made(values, units="m/s^2").values, values)


@pytest.mark.parametrize("units", ["g", ["g", "N"], {"a": "g"}])
def test_units_are_converted_to_si(units):
    series = made({"a": [1.0, 2.0], "b": [3.0, 4.0]}, units=units)
    assert series.channels[0] == Channel(name="a", unit="m/s^2")
    np.testing.assert_allclose(series.values[0], [G, 2 * G], rtol=1e-15)


def test_nan_is_a_sample_that_is_missing():
    series = made([1.0, np.nan, 3.0])
    assert series.valid is not None
    assert series.valid.tolist() == [[True, False, True]]


def test_references_are_marked():
    assert [channel.role for channel in made(np.ones((2, 5)), references="ch2").channels] == ["response", "reference"]


@pytest.mark.parametrize(
    ("values", "options", "told"),
    [
        (np.ones((5, 2)), {}, "these are 5 channels of 2 samples; give values.T"),
        (np.ones((2, 5)), {"names": "a"}, "1 name for 2 channels"),
        (np.ones((2, 5)), {"units": ["g"]}, "1 unit for 2 channels"),
        (np.ones((2, 5)), {"units": {"a": "g"}}, "unit of a: no such channel; channels: ch1, ch2"),
        (np.ones((2, 5)), {"references": "a"}, "reference a: no such channel"),
        (np.ones((2, 5, 2)), {}, r"shape \(2, 5, 2\)"),
        (np.ones((2, 5)) * 1j, {}, "complex128, but samples are real"),
        ([[1.0, 2.0], [3.0]], {}, "as many samples in each channel"),
        ([], {}, r"shape \(1, 0\)"),
        ({"a": [1.0, 2.0]}, {"names": "b"}, "leave names out"),
        (np.ones((2, 5)), {"names": ["a", "a"]}, "names must be unique"),
    ],
)
def test_a_series_is_refused_by_what_is_wrong(values, options, told):
    with pytest.raises(EstimateError, match=told):
        made(values, **options)


def test_a_table_has_a_channel_in_each_column():
    pandas = pytest.importorskip("pandas")
    table = pandas.DataFrame({"f": [1.0, 2.0, np.nan], "a": [3, 4, 5]})
    found = made(table)
    assert [channel.name for channel in found.channels] == ["f", "a"]
    np.testing.assert_array_equal(found.values, [[1.0, 2.0, np.nan], [3.0, 4.0, 5.0]])
    assert found.valid.tolist() == [[True, True, False], [True] * 3]
    with pytest.raises(EstimateError, match=r"^s: values are of type"):
        made(pandas.DataFrame({"a": [1.0, 2.0], "s": ["x", "y"]}))
    with pytest.raises(EstimateError, match="names must be unique, got a, a"):
        made(pandas.DataFrame(np.ones((3, 2)), columns=["a", "a"]))


@pytest.mark.parametrize("kind", [float, int])
def test_what_is_masked_was_not_measured(kind):
    values = np.ma.masked_equal(np.array([[1, 2, 999], [4, 999, 6]], kind), 999)
    missing = [[True, True, False], [True, False, True]]
    assert made(values).valid.tolist() == missing
    assert made({"a": values[0], "b": values[1]}).valid.tolist() == missing
    assert np.isnan(made(values).values).sum() == 2


def test_an_unknown_unit_is_refused():
    with pytest.raises(SetupError, match="'zork'"):
        made([1.0], units="zork")


def test_more_channels_than_samples_are_taken_when_they_are_named():
    assert made(np.ones((3, 2)), names=["a", "b", "c"]).samples == 2


def test_a_response_knows_neither_error_nor_coherence_unless_told():
    response = FrequencyResponse.from_arrays(LINES, [1.0, 2j, np.nan], response_units="g", reference_units="kN")
    assert response.values.shape == (1, 1, 3)
    np.testing.assert_allclose(response.values[0, 0, :2], [G / 1e3, 2j * G / 1e3], rtol=1e-15)
    assert np.isinf(response.std).all()
    assert np.isnan(response.coherence).all()
    assert response.excited.tolist() == [True, True, False]
    assert response.unit(0, 0) == "(m/s^2)/N"
    assert response.references[0].role == "reference"


def test_a_response_takes_several_references_errors_and_coherence():
    values = np.arange(12.0).reshape(2, 2, 3)
    response = FrequencyResponse.from_arrays(
        LINES, values, responses=["a", "b"], references=["f", "g"], std=0.1 * values, coherence=np.ones((2, 3)),
        response_units="mm/s^2",
    )  # fmt: skip
    assert response.function("b", "g") == (1, 1)
    np.testing.assert_allclose(response.std, 0.1 * np.abs(response.values), rtol=1e-12)
    assert response.coherence.tolist() == np.ones((2, 3)).tolist()


def test_a_density_is_converted_twice_and_its_error_follows_from_the_averages():
    density = PowerSpectralDensity.from_arrays(LINES, [1.0, 2.0, 3.0], units="g", averages=25)
    np.testing.assert_allclose(density.values, [[G**2, 2 * G**2, 3 * G**2]], rtol=1e-15)
    np.testing.assert_allclose(density.std, density.values / 5, rtol=1e-15)
    assert np.isinf(PowerSpectralDensity.from_arrays(LINES, [1.0, 2.0, 3.0]).std).all()
    with pytest.raises(EstimateError, match="at least 0"):
        PowerSpectralDensity.from_arrays(LINES, [1.0, -2.0, 3.0])


SHAPES = [[1.0, 2.0, -4.0], [0.0, 3.0, 1.5]]


@pytest.mark.parametrize(("shapes", "rows"), [(SHAPES, None), (np.transpose(SHAPES), None), (SHAPES, "modes")])
def test_modes_are_sorted_and_scaled_whichever_axis_they_run_along(shapes, rows):
    modes = ModeSet.from_arrays([20.0, 10.0], shapes, names=["a", "b", "c"], rows=rows)
    assert modes.frequency_hz.tolist() == [10.0, 20.0]
    np.testing.assert_allclose(modes.shapes, [[0.0, 1.0, 0.5], [-0.25, -0.5, 1.0]], rtol=1e-15)
    assert np.isnan(modes.damping_ratio).all()
    assert np.isnan(modes.frequency_std_hz).all()


def test_a_square_array_of_shapes_is_refused_until_its_rows_are_told():
    square = [[1.0, 0.5], [-0.25, 1.0]]
    with pytest.raises(EstimateError, match=r"either axis may be the modes\. Say rows="):
        ModeSet.from_arrays([1.0, 2.0], square)
    turned = ModeSet.from_arrays([1.0, 2.0], square, rows="channels", damping_ratio=0.01)
    np.testing.assert_allclose(turned.shapes, [[1.0, -0.25], [0.5, 1.0]], rtol=1e-15)
    assert turned.damping_ratio.tolist() == [0.01, 0.01]


@pytest.mark.parametrize(
    ("shapes", "told"),
    [
        (np.ones((3, 4)), "of 2 modes"),
        ([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], "a shape is zero"),
        ([[np.nan, 0.0, 0.0], [1.0, 2.0, 3.0]], "NaN"),
    ],
)
def test_shapes_that_are_none_are_refused(shapes, told):
    with pytest.raises(EstimateError, match=told):
        ModeSet.from_arrays([1.0, 2.0], shapes)

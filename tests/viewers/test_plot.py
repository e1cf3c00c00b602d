"""A picture of every value: the numbers that it draws, the axes that it takes, and what has none."""

from dataclasses import dataclass
from typing import ClassVar

import matplotlib.pyplot as plt
import numpy as np
import pytest

import chladni
from chladni.signals.value import Value
from chladni.viewers.figures.correlation import delay_figures
from tests.made_diagnosis import diagnosis

RATE_HZ = 200.0


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def series():
    rng = np.random.default_rng(4)
    force = rng.standard_normal(4096)
    return chladni.TimeSeries.from_arrays(
        {"f": force, "a": np.convolve(force, [1.0, -0.5, 0.2])[:4096], "b": force + rng.standard_normal(4096)},
        sample_rate_hz=RATE_HZ,
        units={"f": "N", "a": "m/s^2", "b": "m/s^2"},
        references="f",
    )


def modes():
    return chladni.ModeSet.from_arrays([1.0, 2.0], [[1.0, 0.5, 0.2], [1.0, -0.5, 0.1]], names=["a", "b", "c"])


def acceleration():
    return series().select(["a", "b"])


def shaft():
    t = np.arange(400) / 20.0
    return chladni.Rotation(time_s=t, revolutions=10 * t, start_time_ns=0, source="speed")


# Value, and the axes of its figure: parts, and colour scales beside them.
VALUES = {
    "series": (lambda: series(), 2),
    "densities": (lambda: chladni.psd(series()), 2),
    "cross-spectra": (lambda: chladni.cross_spectra(series()), 2),
    "response": (lambda: chladni.frf(series()), 3),
    "coherence": (lambda: chladni.coherence(series(), references="f"), 1),
    "waterfall": (lambda: chladni.waterfall(series(), channels="a"), 2),
    "modes": (modes, 2),
    "mac": (lambda: chladni.mac(modes()), 2),
    "levels": (lambda: chladni.levels(series(), channels="a"), 2),
    "running levels": (lambda: chladni.levels(series(), channels="a").running, 1),
    "severity": (lambda: chladni.severity(series(), machine="medium-rigid"), 1),
    "octaves": (lambda: chladni.octaves(series(), channels="a"), 1),
    "envelope": (lambda: chladni.envelope(series(), channels="a", band_hz=(20.0, 80.0))[0], 1),
    "kurtogram": (lambda: chladni.kurtogram(series(), channels="a"), 2),
    "cepstrum": (lambda: chladni.cepstrum(series(), channels="a"), 1),
    "filtered": (lambda: chladni.lowpass(series(), high_hz=20.0, channels="a"), 1),
    "shock": (lambda: chladni.srs(series(), channels="a"), 1),
    "order map": (lambda: chladni.order_map(series(), shaft(), channels="a"), 2),
    "order cuts": (lambda: chladni.order_cuts(series(), shaft(), channels="a"), 2),
    "rotation": (lambda: shaft(), 1),
    "correlation": (lambda: chladni.cross_correlation(series(), references="f", responses="a"), 1),
    "delays": (lambda: chladni.time_delay(series(), references="f", responses="a"), 1),
    "deflection": (lambda: chladni.deflection_shapes(acceleration(), references="a", frequencies_hz=[20.0]), 1),
    "zoom": (lambda: chladni.zoom_spectrum(series(), band_hz=(10.0, 20.0), channels="a"), 1),
    "profile": (lambda: chladni.random_profile([(5, 0.1), (50, 0.2)]), 1),
    "profile check": (
        lambda: chladni.check_profile(chladni.psd(acceleration()), chladni.random_profile([(5, 0.1), (50, 0.2)])),
        1,
    ),
    "probability": (lambda: chladni.probability_density(series()), 1),
    "vibration response": (
        lambda: chladni.vibration_response(chladni.psd(acceleration()), frequencies_hz=[10.0, 20.0]),
        1,
    ),
}


@pytest.mark.parametrize(("make", "axes"), VALUES.values(), ids=VALUES)
def test_every_value_has_a_picture(make, axes):
    value = make()
    first = value.plot()
    assert len(first.figure.axes) == axes
    assert first is first.figure.axes[0]
    assert value._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize(("make", "axes"), VALUES.values(), ids=VALUES)
def test_a_picture_goes_into_given_axes_or_is_refused(make, axes):
    _, ax = plt.subplots()
    if axes == 2 and make in (VALUES["series"][0], VALUES["densities"][0], VALUES["cross-spectra"][0]):
        with pytest.raises(chladni.SetupError, match="select channels of one unit"):
            chladni.plot(make(), ax)
    else:
        assert chladni.plot(make(), ax) is ax
        assert ax.lines or ax.images or ax.patches or ax.collections


def test_a_density_is_drawn_as_it_is():
    density = chladni.psd(series(), channels=["a", "b"])
    _, ax = plt.subplots()
    density.plot(ax)
    for line, values in zip(ax.lines, density.values, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), density.frequency_hz)
        np.testing.assert_array_equal(line.get_ydata(), values)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["a", "b"]


def test_an_array_of_responses_without_coherence_has_two_axes():
    response = chladni.frf(series())
    bare = chladni.FrequencyResponse.from_arrays(response.frequency_hz, response.values)
    assert len(bare.plot().figure.axes) == 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cepstrum(Value):
    """A value that no picture was made for."""

    AXES: ClassVar = {"values": ("channels", "quefrency_s")}
    ROWS: ClassVar = "quefrency_s"

    quefrency_s: np.ndarray
    values: np.ndarray
    channels: tuple[chladni.Channel, ...]


def test_a_value_without_a_picture_of_its_own_is_drawn_by_its_axes():
    channels = (chladni.Channel(name="a"), chladni.Channel(name="b"))
    value = Cepstrum(quefrency_s=np.arange(3.0), values=np.arange(6.0).reshape(2, 3), channels=channels)
    ax = value.plot()
    assert [line.get_ydata().tolist() for line in ax.lines] == [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]
    assert ax.get_xlabel() == "quefrency_s"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["a", "b"]


def test_a_diagnosis_has_its_sheet_and_its_places():
    found = diagnosis()
    assert found._repr_png_().startswith(b"\x89PNG")
    _, ax = plt.subplots()
    assert found.plot(ax) is ax
    assert ax.patches


def test_what_has_no_picture_says_so_and_shows_text_in_a_notebook():
    empty = chladni.ModeSet.from_arrays([], np.zeros((0, 3)))
    with pytest.raises(chladni.SetupError, match="nothing to draw"):
        empty.plot()
    assert empty._repr_png_() is None


def test_a_delay_of_a_few_samples_is_drawn_with_every_sample_around_it():
    """In a record of minutes, whose correlation reaches over thousands of lags."""
    noise = np.random.default_rng(0).standard_normal(60_000)
    found = chladni.time_delay({"a": noise[5:], "b": noise[:-5]}, references="a", sample_rate_hz=1000.0)
    (figure,) = delay_figures(found).values()
    lag_s, values = figure.axes[0].lines[1].get_data()
    lowest_s, highest_s = figure.axes[0].get_xlim()
    inside = (found.correlation.lag_s >= lowest_s) & (found.correlation.lag_s <= highest_s)
    np.testing.assert_array_equal(lag_s, found.correlation.lag_s[inside])
    np.testing.assert_array_equal(values, found.correlation.values[0, inside])
    plt.close(figure)

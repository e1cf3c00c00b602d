"""Figures: the numbers in them, the words on them, and nothing over anything else."""

import io
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers.figures import (
    Album,
    density_figures,
    nyquist_figures,
    response_figures,
    save_figures,
    waterfall_figures,
    waveform_figures,
)
from chladni.viewers.figures.log_axis import Scales, logarithmic, power_of_ten
from chladni.viewers.figures.peak_labels import LABELS, label_peaks
from chladni.viewers.figures.rendering import rendered
from chladni.viewers.figures.sheet import plain
from chladni.viewers.figures.waveforms import POINTS
from chladni.viewers.style import Style
from tests.viewers import synthetic

PSD = "psd 1 Acceleration"
RESPONSE = "response 1 Acceleration"


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return Album.of(synthetic.study()).figures


def texts(figure: Figure) -> set[str]:
    return {text.get_text() for text in figure.findobj(Text) if text.get_text()}


def test_density_line_is_the_density_and_its_peak_is_named(figures: dict[str, Figure]) -> None:
    density = synthetic.density()
    (axes,) = figures[PSD].axes
    lines = {line.get_label(): line for line in axes.lines}
    drawn = np.asarray(lines["wrist.x"].get_ydata(), dtype=np.float64)
    np.testing.assert_array_equal(drawn[1:], density.values[3, 1:])
    np.testing.assert_array_equal(lines["wrist.x"].get_xdata(), density.frequency_hz)
    assert {"12.5 Hz", "31 Hz"} <= texts(figures[PSD])


def test_axes_say_quantity_and_unit(figures: dict[str, Figure]) -> None:
    assert {"Power spectral density [(m/s²)²/Hz]", "Frequency [Hz]"} <= texts(figures[PSD])
    shown = texts(figures[RESPONSE])
    assert {"Accelerance |H| [(m/s²)/N]\nH1, to hammer.x", "Coherence [1]", "12.5 Hz"} <= shown
    assert "Phase [deg]\nH = Y/X, exp(+jωt)" in shown
    assert {"Acceleration [m/s²]", "Time [s]"} <= texts(figures["waveforms 1 Acceleration"])
    assert {"PSD [dB re 1 (m/s²)²/Hz]", "Time [s]"} <= texts(figures["waterfall 1 Acceleration"])
    assert {"Re H [(m/s²)/N]", "Im H [(m/s²)/N]"} <= texts(figures["nyquist 1 Acceleration"])


def test_response_shows_excited_lines_only(figures: dict[str, Figure]) -> None:
    response = synthetic.frequency_response()
    magnitude, phase, coherence = figures[RESPONSE].axes
    for axes in (magnitude, phase, coherence):
        for line in axes.lines:
            x = np.asarray(line.get_xdata(), dtype=np.float64)
            assert x.min() >= 2.0
            assert x.max() <= 100.0
    drawn = np.asarray(magnitude.lines[2].get_ydata(), dtype=np.float64)
    np.testing.assert_allclose(drawn, np.abs(response.values[2, 0, response.excited]), rtol=1e-15)
    drawn = np.asarray(coherence.lines[0].get_ydata(), dtype=np.float64)
    np.testing.assert_array_equal(drawn, response.coherence[0, response.excited])


def test_functions_of_a_file_without_coherence_have_no_empty_axes_for_it() -> None:
    response = synthetic.frequency_response()
    unknown = replace(response, coherence=np.full(response.coherence.shape, np.nan))
    drawn = response_figures(Study(title="file", response=unknown))[RESPONSE]
    assert len(drawn.axes) == 2
    assert drawn.axes[-1].get_xlabel() == "Frequency [Hz]"


def test_a_band_that_is_left_out_is_not_bridged() -> None:
    response = synthetic.frequency_response()
    excited = response.excited & ~((response.frequency_hz > 40) & (response.frequency_hz < 50))
    study = replace(synthetic.study(), response=replace(response, excited=excited))
    (figure,) = response_figures(study).values()
    for axes in figure.axes:
        line = axes.lines[0]
        x, y = (np.asarray(values, dtype=np.float64) for values in (line.get_xdata(), line.get_ydata()))
        assert np.isnan(y[(x > 40) & (x < 50)]).all()
        assert ((x > 40) & (x < 50)).any()


def test_a_coherence_that_a_file_does_not_hold_has_no_empty_frame() -> None:
    response = synthetic.frequency_response()
    study = synthetic.study()
    unknown = replace(response, coherence=np.full_like(response.coherence, np.nan))
    without, held = (next(iter(response_figures(one).values())) for one in (replace(study, response=unknown), study))
    assert (len(without.axes), len(held.axes)) == (2, 3)
    assert without.axes[-1].get_xlabel() == "Frequency [Hz]"


def test_a_peak_above_every_line_is_inside_the_frame() -> None:
    (found,) = synthetic.response_peaks()
    high = replace(found, height=100 * found.height)
    (figure,) = response_figures(replace(synthetic.study(), response_peaks=(high,))).values()
    assert figure.axes[0].get_ylim()[1] > high.height


def test_bands_are_one_sigma(figures: dict[str, Figure]) -> None:
    density = synthetic.density()
    (axes,) = figures["psd 1 Force"].axes
    (band,) = axes.collections
    vertices = band.get_paths()[0].vertices
    assert vertices is not None
    np.testing.assert_allclose(np.asarray(vertices)[:, 1].max(), density.values[0, 0] + density.std[0, 0], rtol=1e-12)
    np.testing.assert_allclose(np.asarray(vertices)[:, 1].min(), density.values[0, 0] - density.std[0, 0], rtol=1e-12)


def test_an_estimate_without_bound_has_no_upper_band() -> None:
    density = synthetic.density()
    endless = replace(density, std=np.full_like(density.std, np.inf))
    for figure in density_figures(replace(synthetic.study(), densities=(endless,))).values():
        assert rendered(figure, "png")


def test_nyquist_is_real_and_imaginary_part_on_equal_scales(figures: dict[str, Figure]) -> None:
    response = synthetic.frequency_response()
    (axes,) = figures["nyquist 1 Acceleration"].axes
    assert axes.get_aspect() == 1.0
    drawn = np.asarray(axes.lines[1].get_xydata())
    value = response.values[1, 0, response.excited]
    np.testing.assert_array_equal(drawn, np.column_stack([value.real, value.imag]))


def test_waterfall_image_is_the_density_in_decibels_where_it_belongs(figures: dict[str, Figure]) -> None:
    waterfall = synthetic.waterfall()
    axes = figures["waterfall 1 Acceleration"].axes[2]
    (image,) = axes.images
    level = np.asarray(image.get_array(), dtype=np.float64)
    np.testing.assert_allclose(level.T[:, 1:], 10 * np.log10(waterfall.values[3, :, 1:]), rtol=1e-13)
    # Half a slice and half a line around the first and the last.
    assert image.get_extent() == pytest.approx((0.0, 40.0, -0.125, 128.125))


def test_colours_of_a_waterfall_are_those_of_most_cells_not_of_the_drift_at_0_hz() -> None:
    rng = np.random.default_rng(3)
    # 30 dB of noise, and a trend that leaks 90 dB more into the first three lines.
    values = 10 ** (rng.uniform(-3, 0, (1, 80, 513)))
    values[..., :3] *= 1e9
    channel = Channel(name="/a.x", unit="V")
    fall = replace(
        synthetic.waterfall(),
        values=values,
        time_s=np.arange(80.0),
        frequency_hz=np.arange(513.0),
        channels=(channel,),
    )
    (figure,) = waterfall_figures(Study(title="drift", waterfalls=(fall,))).values()
    (image,) = figure.axes[0].images
    # 5 % of uniform levels lie below -28.5 dB.
    np.testing.assert_allclose(image.get_clim(), (-28.5, 0.0), atol=0.4)


@pytest.mark.parametrize("log_frequency", [False, True])
def test_a_waterfall_shows_the_band_that_is_asked_for(log_frequency: bool) -> None:
    scales = Scales(band_hz=(10.0, 40.0), log_frequency=log_frequency)
    figure = waterfall_figures(synthetic.study(), scales=scales)["waterfall 1 Acceleration"]
    frequency_hz = synthetic.waterfall().frequency_hz
    shown = frequency_hz[(frequency_hz >= 10) & (frequency_hz <= 40)]
    step_hz = shown[1] - shown[0]
    np.testing.assert_allclose(figure.axes[0].get_ylim(), (shown[0], shown[-1]), atol=0.5001 * step_hz)
    assert figure.axes[0].get_yscale() == ("log" if log_frequency else "linear")
    drawn = (figure.axes[0].collections if log_frequency else figure.axes[0].images)[0].get_array()
    assert np.asarray(drawn).shape[0] == shown.size


def test_a_waterfall_of_missing_samples_is_grey_not_an_error() -> None:
    waterfall = synthetic.waterfall()
    empty = replace(waterfall, values=np.full_like(waterfall.values, np.nan))
    for figure in waterfall_figures(Study(title="gap", waterfalls=(empty,))).values():
        picture = imread(io.BytesIO(rendered(figure, "png")), format="png")
        assert np.isclose(picture[:, :, :3], 0xD0 / 255, atol=0.01).all(axis=2).mean() > 0.1


def test_waveform_keeps_the_extremes_and_the_gaps() -> None:
    values = np.zeros((1, 100_000))
    values[0, 31_415], values[0, 27_182] = 5.0, -4.0
    valid = np.ones(values.shape, dtype=np.bool_)
    valid[0, 60_000:60_010] = False
    channel = Channel(name="/a.x", unit="V")
    series = TimeSeries(values=values, sample_rate_hz=1000.0, channels=(channel,), valid=valid)
    (figure,) = waveform_figures(Study(title="long", series=(series,))).values()
    line = figure.axes[0].lines[0]
    x, y = (np.asarray(points, dtype=np.float64) for points in (line.get_xdata(), line.get_ydata()))
    assert y.size <= POINTS
    assert x[np.nanargmax(y)] == 31.415
    assert x[np.nanargmin(y)] == 27.182
    assert np.isnan(y[(x >= 60.0) & (x < 60.01)]).all()


def test_a_channel_has_one_colour_in_every_figure(figures: dict[str, Figure]) -> None:
    wanted = np.array(Style.of(synthetic.study()).on_light(synthetic.RESPONSES[2])) / 255
    for name in (PSD, RESPONSE, "nyquist 1 Acceleration"):
        line = next(line for line in figures[name].axes[0].lines if line.get_label() == "wrist.x")
        np.testing.assert_allclose(line.get_color(), wanted)
    np.testing.assert_allclose(figures["waveforms 1 Acceleration"].axes[2].lines[0].get_color(), wanted)


def test_no_text_is_cut_off_and_no_peak_label_touches_the_legend(figures: dict[str, Figure]) -> None:
    for name, figure in figures.items():
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        width, height = figure.get_size_inches()
        drawn = figure.get_tightbbox(renderer)
        # A hundredth of an inch is three dots.
        assert drawn.x0 >= -0.01, name
        assert drawn.y0 >= -0.01, name
        assert drawn.x1 <= width + 0.01, name
        assert drawn.y1 <= height + 0.01, name
        for axes in figure.axes:
            shown = axes.get_legend()
            labels = [text for text in axes.texts if text.get_text().endswith("Hz")]
            for label in labels if shown else []:
                assert not label.get_window_extent(renderer).overlaps(shown.get_window_extent(renderer)), name


def test_names_stand_above_the_frame_and_leave_the_frame_to_the_data(figures: dict[str, Figure]) -> None:
    for name in (PSD, RESPONSE):
        axes = figures[name].axes[0]
        renderer = FigureCanvasAgg(figures[name]).get_renderer()
        figures[name].draw(renderer)
        frame = axes.get_window_extent(renderer)
        labels = [text for text in axes.texts if text.get_text().endswith("Hz")]
        assert labels
        assert all(label.get_window_extent(renderer).y0 >= frame.y1 for label in labels)
        # A twentieth of the span above the highest line, as below the lowest.
        highest = max(float(np.nanmax(np.asarray(line.get_ydata(), dtype=np.float64))) for line in axes.lines)
        low, high = np.log10(axes.get_ylim())
        assert (high - np.log10(highest)) / (high - low) < 0.06


@pytest.mark.parametrize(
    ("frequency_hz", "text"), [(0.12345, "0.1235 Hz"), (24.672, "24.67 Hz"), (12345.6, "12346 Hz")]
)
def test_frequencies_are_printed_without_powers_of_ten(frequency_hz: float, text: str) -> None:
    (peak, *_) = synthetic.peaks()
    axes = Figure().subplots()
    axes.set_xlim(0, 2 * frequency_hz)
    label_peaks(axes, [replace(peak, frequency_hz=frequency_hz)])
    assert [label.get_text() for label in axes.texts] == [text]


def test_names_of_crowded_peaks_do_not_overlap() -> None:
    (first, *_) = synthetic.peaks()
    crowd = tuple(replace(first, frequency_hz=10 + 0.5 * step, height=1000.0 - step) for step in range(60))
    figure = density_figures(replace(synthetic.study(), peaks=crowd))[PSD]
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    # Of the words alone, without the lines that lead to them.
    boxes = [Text.get_window_extent(text, renderer) for text in figure.axes[0].texts]
    assert 1 < len(boxes) <= LABELS
    assert not any(one.overlaps(other) for place, one in enumerate(boxes) for other in boxes[:place])
    # Every peak keeps its mark.
    assert len(np.asarray(figure.axes[0].lines[-1].get_xdata())) == 60


def test_log_frequency_leaves_out_zero() -> None:
    figure = density_figures(synthetic.study(), scales=Scales(log_frequency=True))[PSD]
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    assert np.asarray(axes.lines[0].get_xdata(), dtype=np.float64).min() > 0


def test_decibels_number_the_same_curves() -> None:
    for draw, name, decade_db in ((density_figures, PSD, 10), (response_figures, RESPONSE, 20)):
        usual, told = (draw(synthetic.study(), scales=one)[name].axes[0] for one in (Scales(), Scales(decibels=True)))
        np.testing.assert_array_equal(told.lines[0].get_ydata(), usual.lines[0].get_ydata())
        assert told.get_ylim() == usual.get_ylim()
        assert told.get_ylabel().split("[")[1].startswith("dB over 1 ")
        low, high = told.get_ylim()
        places = [place for place in told.get_yticks() if low <= place <= high]
        numbers = [float(told.yaxis.get_major_formatter()(place)) for place in places]
        assert len(numbers) > 2
        assert all(number % 5 == 0 for number in numbers)
        np.testing.assert_allclose(numbers, decade_db * np.log10(places), atol=1e-9)


def test_a_response_over_log_frequency_begins_above_zero() -> None:
    axes = response_figures(synthetic.study(), scales=Scales(log_frequency=True))[RESPONSE].axes
    for one in axes:
        assert one.get_xscale() == "log"
        assert one.get_xlim()[0] > 0


def test_several_references_make_a_figure_each_and_name_only_the_peaks_that_say_which() -> None:
    response = synthetic.frequency_response()
    second = Channel(name="/shaker.force.z", unit="N", role="reference")
    double = replace(
        response,
        values=np.concatenate([response.values, response.values], axis=1),
        std=np.concatenate([response.std, response.std], axis=1),
        references=(*response.references, second),
    )
    (found,) = synthetic.response_peaks()
    peak = replace(found, channels=found.channels[:1])
    named = replace(peak, frequency_hz=31.0, channels=(peak.channels[0], second.name))
    figures = response_figures(replace(synthetic.study(), response=double, response_peaks=(peak, named)))
    assert list(figures) == ["response 1 Acceleration", "response 2 Acceleration"]
    first, other = (texts(figure) for figure in figures.values())
    assert "Multiple\ncoherence [1]" in first & other
    assert "12.5 Hz" not in first | other
    assert "31 Hz" in other - first


def test_names_that_try_to_be_mathematics_are_printed_as_they_are() -> None:
    figures = density_figures(synthetic.hostile_study()) | response_figures(synthetic.hostile_study())
    shown = set().union(*(texts(figure) for figure in figures.values()))
    assert r"\$cost_{x}\$.%s\n" in shown
    rendered(figures["psd 1 Acceleration 2/2"], "svg")
    assert " _hidden.y" in {text.get_text() for text in figures["psd 1 Acceleration 2/2"].axes[0].get_legend().texts}


@pytest.mark.parametrize("name", ["W" * 300, "\x1b[2J" * 60, "$x$" * 100, "of words " * 30, "\u202e" * 90])
def test_long_names_leave_room_for_the_axes_and_their_ends_are_seen(name: str) -> None:
    channels = tuple(Channel(name=f"/{name}{end}", unit="m/s^2") for end in ("left", "right"))
    found = synthetic.density()
    density = replace(found, values=found.values[1:3], std=found.std[1:3], channels=channels)
    (figure,) = density_figures(Study(title=name, densities=(density,))).values()
    # A layout that finds no room warns, and warnings are errors here.
    rendered(figure, "svg")
    (axes,) = figure.axes
    assert axes.get_position().width > 0.5
    words = [text.get_text() for text in axes.get_legend().texts]
    assert [word[-4:] for word in words] == ["left", "ight"]


def test_a_character_without_a_glyph_is_marked_not_warned_about() -> None:
    assert plain("\U0001f916 robot") == "\ufffd robot"


@pytest.mark.parametrize(
    ("value", "text"), [(1e-7, "10⁻⁷"), (0.1, "0.1"), (1.0, "1"), (1e3, "1000"), (1e4, "10⁴"), (1e12, "10¹²")]
)
def test_powers_of_ten_are_printed(value: float, text: str) -> None:
    assert power_of_ten(value) == text


@pytest.mark.parametrize(
    ("low", "high", "told"), [(2e-3, 2.0, ["0.01", "0.1", "1"]), (2e-4, 2.0, ["10⁻³", "10⁻²", "0.1", "1"])]
)
def test_an_axis_that_needs_no_powers_of_ten_has_none(low: float, high: float, told: list[str]) -> None:
    axes = Figure().add_subplot()
    logarithmic(axes, low, high)
    inside = [one for one in axes.yaxis.get_majorticklocs() if low <= one <= high]
    assert [axes.yaxis.get_major_formatter()(one) for one in inside] == told


@pytest.mark.slow
def test_saving_writes_every_figure_in_every_format(tmp_path: Path) -> None:
    study = Study(title="psd", densities=(synthetic.density(),))
    written = save_figures(study, tmp_path / "new", formats=("png", "svg", "pdf"))
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(path.name for path in written)
    assert {path.stem for path in written} == {"psd-1-force", "psd-1-acceleration"}
    starts = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
    assert all(path.read_bytes().startswith(starts[path.suffix[1:]]) for path in written)


def test_the_same_study_gives_the_same_bytes() -> None:
    study = Study(title="psd", densities=(synthetic.density(),))
    first, second = density_figures(study), density_figures(study)
    for kind in ("svg", "pdf"):
        assert rendered(first[PSD], kind) == rendered(second[PSD], kind)


def test_an_unknown_format_is_told_before_anything_is_drawn(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"'gif'.*png, svg, pdf"):
        save_figures(synthetic.study(), tmp_path / "x", formats=("gif",))
    assert not (tmp_path / "x").exists()


def test_a_folder_that_can_not_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(LogError, match="file"):
        save_figures(synthetic.study(), tmp_path / "file")


def test_a_study_without_response_has_no_response_figures() -> None:
    assert response_figures(Study(title="none")) == {}
    assert nyquist_figures(Study(title="none")) == {}


def test_the_users_settings_neither_matter_nor_change() -> None:
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0}):
        figure = density_figures(synthetic.study())[PSD]
        assert mpl.rcParams["lines.linewidth"] == 9.0
    assert figure.axes[0].lines[0].get_linewidth() < 2


def test_no_window_system_is_touched() -> None:
    program = (
        "import sys\n"
        "from tests.viewers import synthetic\n"
        "from chladni.viewers.figures import Album\n"
        "Album.of(synthetic.study()).figures\n"
        "print('matplotlib.pyplot' in sys.modules)\n"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", program], check=True, cwd=root, capture_output=True, text=True)
    assert done.stdout == "False\n"


def test_a_cepstrum_names_its_peaks_in_words():
    import chladni

    x = np.random.default_rng(1).standard_normal(40_080)
    axes = chladni.cepstrum(x[80:] + 0.6 * x[:-80], sample_rate_hz=8000.0).plot()
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert any(word.startswith("peaks: 10") and word.endswith(" ms") for word in words)

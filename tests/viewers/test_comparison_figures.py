"""Figures of before and after: the change, its band, and the lines that scatter doesn't explain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

from chladni.signals.comparison import DensityComparison, ResponseComparison
from chladni.viewers.figures import Album, comparison_figures, save_album
from chladni.viewers.style import Style
from tests.viewers import synthetic

LINES = 200


def density_comparison() -> DensityComparison:
    """Force unchanged; of the accelerations the last is 6 dB up above 30 Hz, known to half a decibel."""
    frequency_hz = np.arange(LINES) * 0.5
    change_db = np.zeros((4, LINES))
    change_db[3, frequency_hz > 30] = 6.0
    std_db = np.full((4, LINES), 0.5)
    std_db[1, 10] = np.inf
    return DensityComparison(
        frequency_hz=frequency_hz,
        change_db=change_db,
        change_std_db=std_db,
        significant=change_db > 3,
        channels=(synthetic.FORCE, *synthetic.RESPONSES),
        overall=(),
        bands=(),
        peaks=(),
    )


def response_comparison() -> ResponseComparison:
    """Excited from 10 to 50 Hz; all of the last response's lines have changed in phase alone."""
    frequency_hz = np.arange(LINES) * 0.5
    excited = (frequency_hz >= 10) & (frequency_hz <= 50)
    shape = (3, 1, LINES)
    significant = np.zeros(shape, dtype=np.bool_)
    significant[2, 0] = excited
    return ResponseComparison(
        frequency_hz=frequency_hz,
        change_db=np.where(excited, np.zeros(shape), np.nan),
        change_std_db=np.where(excited, np.full(shape, 0.3), np.nan),
        phase_change_deg=np.where(excited, np.full(shape, 20.0), np.nan),
        significant=significant,
        responses=synthetic.RESPONSES,
        references=(synthetic.FORCE,),
        peaks=(),
    )


def marked_hz(axes: Axes) -> list[float]:
    (line,) = [line for line in axes.lines if line.get_label() == "in colour: more than scatter explains"]
    x, y = (np.asarray(points, dtype=np.float64) for points in (line.get_xdata(), line.get_ydata()))
    return x[np.isfinite(y)].tolist()


def test_each_channel_has_its_change_its_band_and_its_significant_lines() -> None:
    comparison = density_comparison()
    figures = comparison_figures([comparison])
    assert list(figures) == ["change of psd 1 Force", "change of psd 1 Acceleration"]
    column, _, wrist = figures["change of psd 1 Acceleration"].axes
    assert marked_hz(column) == []
    assert marked_hz(wrist) == comparison.frequency_hz[comparison.frequency_hz > 30].tolist()
    change = next(line for line in wrist.lines if line.get_label() == "after over before, ± 1 sigma")
    np.testing.assert_array_equal(change.get_ydata(), comparison.change_db[3])
    (band,) = wrist.collections
    heights = np.asarray(band.get_paths()[0].vertices)[:, 1]
    assert heights.min() == -0.5
    assert heights.max() == 6.5


def test_a_significant_line_alone_is_a_dot_and_neighbours_are_a_curve() -> None:
    comparison = density_comparison()
    significant = comparison.significant.copy()
    significant[3, 20] = True
    axes = comparison_figures([replace(comparison, significant=significant)])["change of psd 1 Acceleration"].axes[2]
    (dots,) = [line for line in axes.lines if line.get_marker() == "."]
    assert np.asarray(dots.get_xdata()).tolist() == [comparison.frequency_hz[20]]


def test_colours_are_those_of_all_figures() -> None:
    comparison = density_comparison()
    style = Style.of_channels(comparison.channels)
    axes = comparison_figures([comparison])["change of psd 1 Acceleration"].axes[2]
    wanted = np.array(style.on_light(synthetic.RESPONSES[2])) / 255
    np.testing.assert_allclose(axes.lines[-1].get_color(), wanted)


def test_the_frame_holds_every_change_and_zero_and_is_never_tiny() -> None:
    _, arm, wrist = comparison_figures([density_comparison()])["change of psd 1 Acceleration"].axes
    assert arm.get_ylim()[1] - arm.get_ylim()[0] >= 1.0
    assert wrist.get_ylim()[0] < 0
    assert wrist.get_ylim()[1] >= 6.5


def test_responses_show_the_lines_excited_in_both() -> None:
    (figure,) = comparison_figures([], response_comparison()).values()
    for axes in figure.axes:
        assert axes.get_xlim() == (10.0, 50.0)
    # A phase that changed alone is marked at 0 dB.
    assert marked_hz(figure.axes[2]) == (np.arange(20, 101) * 0.5).tolist()
    (label,) = [text.get_text() for text in figure.texts]
    assert label == "Change of |H| [dB]\nto hammer.x"


def test_responses_without_a_common_excited_line_have_no_figure() -> None:
    nothing = response_comparison()
    unknown = np.full_like(nothing.change_db, np.nan)
    blind = replace(nothing, change_db=unknown, significant=np.zeros_like(nothing.significant))
    assert comparison_figures([], blind) == {}


def test_a_spectrum_of_nothing_but_gaps_is_drawn() -> None:
    comparison = density_comparison()
    unknown = np.full_like(comparison.change_db, np.nan)
    empty = replace(comparison, change_db=unknown, change_std_db=unknown, significant=np.isfinite(unknown))
    drawn = comparison_figures([empty])
    assert drawn.keys() == comparison_figures([comparison]).keys()
    for figure in drawn.values():
        figure.draw(FigureCanvasAgg(figure).get_renderer())
        for axes in figure.axes:
            # The frame still holds 0 dB and a width to see it by.
            assert axes.get_ylim()[0] < 0 < axes.get_ylim()[1]


@pytest.mark.parametrize("name", ["change of psd 1 Force", "change of response 1 Acceleration"])
def test_no_text_is_cut_off(name: str) -> None:
    figure = comparison_figures([density_comparison()], response_comparison())[name]
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    width, height = figure.get_size_inches()
    drawn = figure.get_tightbbox(renderer)
    # A hundredth of an inch is three dots.
    assert drawn.x0 >= -0.01
    assert drawn.y0 >= -0.01
    assert drawn.x1 <= width + 0.01
    assert drawn.y1 <= height + 0.01


def test_an_album_renders_a_figure_once_for_all_who_ask(tmp_path: Path) -> None:
    album = Album({"comparison": comparison_figures([density_comparison()])})
    first = album.rendered("change of psd 1 Force", "svg")
    written = save_album(album, tmp_path, formats=("svg",))
    assert [path.name for path in written] == ["change-of-psd-1-force.svg", "change-of-psd-1-acceleration.svg"]
    assert written[0].read_bytes() == first
    assert album.rendered("change of psd 1 Force", "svg") is first

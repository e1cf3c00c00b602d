"""Figures of modes: the numbers in them, the words on them, and nothing cut off or over anything else."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text

from chladni.signals.errors import EstimateError
from chladni.signals.relative_motion import RelativeMotion
from chladni.signals.study import Study
from chladni.viewers.figures import (
    Album,
    complexity_figures,
    cross_mac_figure,
    mac_figures,
    mode_shape_figures,
    relative_motion_figures,
    save_figures,
    stabilisation_figures,
    synthesis_figures,
)
from chladni.viewers.figures.log_axis import Scales
from chladni.viewers.style import AMPLITUDES
from tests.viewers import synthetic_modes as made

ARM = made.arm_study()
MODES = made.modes_of(ARM)
# Without transfer functions, whose figures have tests of their own.
ALONE = replace(ARM, response=None)


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return {**Album.of(ALONE).figures, **synthesis_figures(ARM)}


def texts(figure: Figure) -> set[str]:
    return {text.get_text() for text in figure.findobj(Text) if text.get_text()}


def titled(figure: Figure, title: str) -> Axes:
    return next(
        axes for axes in figure.axes if title in (axes.get_title(loc="left"), axes.get_title().split("\n")[0])
    )


def test_every_kind_of_figure_is_in_the_album(figures: dict[str, Figure]) -> None:
    assert set(figures) == {
        "mode shapes",
        "relative motion",
        "stabilisation",
        "synthesis 1 Acceleration 1/2",
        "synthesis 1 Acceleration 2/2",
        "mac",
        "complexity",
    }


def drawn(figure: Figure) -> RendererAgg:
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw(renderer)
    return renderer


def various() -> dict[str, Figure]:
    """Every kind of figure, with few modes and with many."""
    plate = made.plate_study(5, 4, 20)
    few = made.plate_study(8, 6, 7)
    crowded = {f"plate {name}": figure for name, figure in (mac_figures(plate) | complexity_figures(few)).items()}
    large = {
        f"large {name}": figure for name, figure in (mode_shape_figures(few) | relative_motion_figures(few)).items()
    }
    bars = {f"bars {name}": figure for name, figure in mode_shape_figures(made.without_geometry()).items()}
    alone = {f"alone {name}": figure for name, figure in Album.of(made.one_mode()).figures.items()}
    odd = {f"odd {name}": figure for name, figure in awkward().items()}
    return Album.of(ALONE).figures | synthesis_figures(ARM) | crowded | large | bars | alone | odd


def awkward() -> dict[str, Figure]:
    """Long names of neighbours, and one function of one channel alone on its page."""
    names = ("payload_rail_of_the_right_wing", "wing_rail")
    motions = tuple(RelativeMotion(mode=mode, between=names, ratio=0.5, ratio_std=0.1) for mode in range(3))
    return relative_motion_figures(replace(ALONE, relative_motion=motions)) | synthesis_figures(single_channel())


def single_channel() -> Study:
    fit = MODES.fit
    assert fit is not None
    return replace(
        ARM,
        modes=replace(
            MODES,
            shapes=np.ones((5, 1), dtype=complex),
            shape_std=np.zeros((5, 1), dtype=complex),
            channels=MODES.channels[4:],
            fit=replace(
                fit,
                synthesised=fit.synthesised[4:],
                lower_residual=fit.lower_residual[4:],
                upper_residual=fit.upper_residual[4:],
                function_error=fit.function_error[4:],
            ),
        ),
    )


@pytest.mark.nightly
@pytest.mark.slow
def test_no_picture_is_blank_or_cut_off_and_no_text_lies_on_another() -> None:
    for name, figure in various().items():
        check_picture(name, figure)


def check_picture(name: str, figure: Figure) -> None:
    renderer = drawn(figure)
    width, height = figure.get_size_inches()
    box = figure.get_tightbbox(renderer)
    # A hundredth of an inch is one dot.
    assert box.x0 >= -0.01, name
    assert box.y0 >= -0.01, name
    assert box.x1 <= width + 0.01, name
    assert box.y1 <= height + 0.01, name
    picture = np.asarray(renderer.buffer_rgba())[:, :, :3]
    assert (picture < 200).any(axis=2).mean() > 0.003, name
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in shown_texts(figure)]
    for place, (text, one) in enumerate(boxes):
        for other, another in boxes[:place]:
            # A dot of overlap is the anti-aliasing of their edges.
            assert not one.padded(-1).overlaps(another), (name, text, other)


def shown_texts(figure: Figure) -> list[Text]:
    """Everything written, except the grey names of points, which stand where the points do."""
    found = list(figure.texts)
    for legend in (*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())):
        found += legend.get_texts()
    for axes in figure.axes:
        # Titles are children that no list names.
        titles = [child for child in axes.get_children() if isinstance(child, Text)]
        found += [text for text in titles if text.get_color() != "#777777"]
        for axis in (axes.xaxis, axes.yaxis) if axes.axison else ():
            low, high = sorted(axis.get_view_interval())
            ticks = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
            found += [axis.label, *(label for tick in ticks for label in (tick.label1, tick.label2))]
    return [text for text in found if text.get_text().strip() and text.get_visible()]


def test_a_shape_is_drawn_at_its_furthest_over_the_structure_at_rest(figures: dict[str, Figure]) -> None:
    axes = titled(figures["mode shapes"], "1: 24.67 Hz, 1.08 %")
    moved, rest = (np.asarray(dots.get_offsets()) for dots in axes.collections if isinstance(dots, PathCollection))
    across = moved[:, 0] - rest[:, 0]
    # All motion is along x, of which the projection keeps the same share for every point.
    np.testing.assert_allclose(across / across[4], MODES.shapes[0].real, atol=2e-3)
    (wires,) = (lines for lines in axes.collections if isinstance(lines, LineCollection))
    segments = np.array(wires.get_segments())
    np.testing.assert_allclose(segments[0, 0], moved[0], atol=1e-12)
    np.testing.assert_allclose(segments[-1, 1], moved[-1], atol=1e-12)


def test_colour_tells_amplitude(figures: dict[str, Figure]) -> None:
    axes = titled(figures["mode shapes"], "1: 24.67 Hz, 1.08 %")
    colours = np.asarray(next(dots for dots in axes.collections if isinstance(dots, PathCollection)).get_facecolors())
    np.testing.assert_allclose(colours[4, :3], AMPLITUDES[-1] / 255, atol=0.01)
    assert colours[0, 2] > colours[0, 0]


def test_directions_and_names_of_points_are_told(figures: dict[str, Figure]) -> None:
    assert {"x", "z", "base", "tool", "5: 169.3 Hz, 1.19 %"} <= texts(figures["mode shapes"])


def test_without_places_a_bar_a_channel_with_its_sigma() -> None:
    (figure,) = mode_shape_figures(made.without_geometry()).values()
    axes = titled(figure, "2: 47.97 Hz, 1.90 %")
    bars = [patch.get_width() for patch in axes.patches]  # type: ignore[attr-defined]
    np.testing.assert_allclose(bars[:5], 2 * np.abs(MODES.shapes[1]))
    np.testing.assert_allclose(bars[5:], MODES.shapes[1].real)
    (errors,) = (lines for lines in axes.collections if isinstance(lines, LineCollection))
    lengths = [np.ptp(np.asarray(segment)[:, 0]) for segment in errors.get_segments()]
    np.testing.assert_allclose(lengths, 2 * MODES.shape_std[1].real, atol=1e-12)
    assert {"base.x", "tool.x"} <= texts(figure)
    # The first channel on top.
    low, high = axes.get_ylim()
    assert low > high


def test_three_hundred_channels_without_places_are_named_here_and_there() -> None:
    study = made.plate_study(count=1)
    (figure,) = mode_shape_figures(replace(study, geometry=replace(study.geometry, points=(), lines=()))).values()
    names = [text for text in texts(figure) if text.endswith(".z")]
    assert 10 < len(names) <= 24
    drawn(figure)


@pytest.mark.nightly
def test_many_modes_are_divided_evenly() -> None:
    study = made.plate_study(3, 2, 20)
    found = mode_shape_figures(study)
    assert list(found) == [
        "mode shapes 1–5",
        "mode shapes 6–10",
        "mode shapes 11–15",
        "mode shapes 16–20",
    ]
    assert len(found["mode shapes 1–5"].axes) == 6  # with the scale of colours
    assert list(complexity_figures(study)) == ["complexity 1–10", "complexity 11–20"]


def test_many_poles_of_modes_are_joined_by_mode_not_ringed() -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    rows = np.repeat(np.arange(diagram.order.size), 4)
    many = replace(
        diagram,
        **{
            name: getattr(diagram, name)[rows]
            for name in ("order", "frequency_hz", "damping_ratio", "status", "mode")
        },
    )
    figure = stabilisation_figures(replace(ALONE, modes=replace(MODES, stabilisation=many)))["stabilisation"]
    lines = [line for line in figure.axes[0].lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2]
    for mode, line in enumerate(lines):
        assert set(line.get_xdata()) == set(diagram.frequency_hz[diagram.mode == mode])
    assert len(lines) == diagram.mode.max() + 1
    assert [str(line.get_label()) for line in figure.axes[0].lines].count("taken for a mode") == 1


def test_stabilisation_shows_poles_by_status_over_the_indicator(figures: dict[str, Figure]) -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    poles, behind = figures["stabilisation"].axes
    lines = {str(line.get_label()): line for line in poles.lines}
    for status, name in enumerate(("new", "frequency stable", "and damping", "and vector")):
        chosen = diagram.status == status
        np.testing.assert_array_equal(lines[name].get_xdata(), diagram.frequency_hz[chosen])
        np.testing.assert_array_equal(lines[name].get_ydata(), diagram.order[chosen])
    np.testing.assert_array_equal(lines["taken for a mode"].get_xdata(), diagram.frequency_hz[diagram.mode >= 0])
    np.testing.assert_array_equal(behind.lines[0].get_ydata(), diagram.indicator[0])
    assert {"Model order", "CMIF [(m/s²)/N]", "Frequency [Hz]", "24.67 Hz", "120.0 Hz"} <= texts(
        figures["stabilisation"]
    )


def test_stabilisation_of_nothing_is_drawn_all_the_same() -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    none = {name: getattr(diagram, name)[:0] for name in ("order", "frequency_hz", "damping_ratio", "status", "mode")}
    silent = replace(diagram, **none, indicator=np.zeros_like(diagram.indicator))
    nothing = replace(made.modes_of(made.without_modes()), stabilisation=silent)
    (figure,) = stabilisation_figures(Study(title="x", modes=nothing)).values()
    drawn(figure)


def test_a_single_channel_has_no_shape_to_draw() -> None:
    study = single_channel()
    assert mode_shape_figures(study) | complexity_figures(study) | mac_figures(study) == {}


def test_stabilisation_is_zoomed_to_the_poles_where_they_fill_little_of_the_indicator() -> None:
    diagram = MODES.stabilisation
    assert diagram is not None
    wide = replace(diagram, indicator_hz=np.linspace(0, 2000, diagram.indicator_hz.size))
    (figure,) = stabilisation_figures(replace(ALONE, modes=replace(MODES, stabilisation=wide))).values()
    low, high = figure.axes[0].get_xlim()
    assert 0 <= low < diagram.frequency_hz.min()
    assert diagram.frequency_hz.max() < high < 300
    drawn(figure)


def test_mac_has_a_number_in_every_cell(figures: dict[str, Figure]) -> None:
    assert ARM.validation is not None
    axes = figures["mac"].axes[0]
    (image,) = axes.images
    np.testing.assert_array_equal(np.asarray(image.get_array()), ARM.validation.auto_mac)
    assert [text.get_text() for text in axes.texts] == [f"{value:.2f}" for value in ARM.validation.auto_mac.ravel()]
    assert {"1: 24.67", "MAC [1]"} <= texts(figures["mac"])


def test_cross_mac_of_two_sets_has_both_their_names() -> None:
    mac = np.array([[0.99, 0.02, 0.5], [0.01, 0.97, 0.1]])
    figure = cross_mac_figure(
        mac,
        rows=("1: 10.1", "2: 20.2"),
        columns=("1: 10.0", "2: 20.0", "3: $30$"),
        row_name="test",
        column_name="model",
    )
    assert {"1: 10.1", "2: 20.0", "test", "model", "0.97", r"3: \$30\$"} <= texts(figure)
    drawn(figure)


@pytest.mark.parametrize(("rows", "columns"), [(0, 3), (2, 2)])
def test_cross_mac_of_nothing_or_with_missing_names_is_refused(rows: int, columns: int) -> None:
    with pytest.raises(EstimateError, match="can't be drawn"):
        cross_mac_figure(np.zeros((rows, 3)), rows=["r"] * rows, columns=["c"] * columns)


def test_large_macs_are_numbered_where_it_matters() -> None:
    for count, expected in ((20, 20), (30, 0)):
        names = [str(row) for row in range(count)]
        figure = cross_mac_figure(np.eye(count), rows=names, columns=names)
        assert len(figure.axes[0].texts) == expected


def test_synthesis_lies_over_the_measured_function_with_its_error(figures: dict[str, Figure]) -> None:
    assert MODES.fit is not None
    assert ARM.response is not None
    error = MODES.fit.function_error[4, 0]
    axes = titled(figures["synthesis 1 Acceleration 2/2"], f"tool.x · error {error:.1%}")
    lines = {line.get_label(): line for line in axes.lines}
    np.testing.assert_array_equal(lines["synthesised"].get_ydata(), np.abs(MODES.fit.synthesised[4, 0]))
    np.testing.assert_array_equal(lines["measured"].get_ydata(), np.abs(ARM.response.values[4, 0]))
    assert "Accelerance |H| [(m/s²)/N]\nto shaker.x" in texts(figures["synthesis 1 Acceleration 2/2"])


def test_poles_and_synthesis_are_divided_as_asked_for(figures: dict[str, Figure]) -> None:
    scales, usual = Scales(decibels=True, log_frequency=True), figures
    asked = {**stabilisation_figures(ARM, scales=scales), **synthesis_figures(ARM, scales=scales)}
    synthesis, *_ = (name for name in asked if name.startswith("synthesis"))
    for name in ("stabilisation", synthesis):
        axes, plain = asked[name].axes[0], usual[name].axes[0]
        assert (axes.get_xscale(), plain.get_xscale()) == ("log", "linear")
        assert axes.get_xlim()[0] > 0
    assert "[dB over 1 " in str(asked[synthesis].get_supylabel())
    # A name stands over its line, whichever way frequency is divided.
    poles = asked["stabilisation"].axes[0]
    ends = np.log(poles.get_xlim())
    for text in poles.texts:
        hertz = float(text.get_text().split()[0])
        place = (np.log(hertz) - ends[0]) / (ends[1] - ends[0])
        assert abs(text.xy[0] - place) < 0.03


def test_complexity_is_the_components_in_the_plane(figures: dict[str, Figure]) -> None:
    axes = titled(figures["complexity"], "3: 66.32 Hz, 2.58 %")
    dots = next(found for found in axes.collections if isinstance(found, PathCollection))
    np.testing.assert_allclose(
        np.asarray(dots.get_offsets()), np.column_stack([MODES.shapes[2].real, MODES.shapes[2].imag])
    )
    assert axes.get_aspect() == 1.0
    assert {"3: 66.32 Hz, 2.58 %\nMPC 0.984, MPD 2.2°", "Re", "Im", "tool.x"} <= texts(figures["complexity"])


def test_complexity_without_validation_has_no_phase_line() -> None:
    (figure,) = complexity_figures(replace(ALONE, validation=None)).values()
    (full,) = complexity_figures(ALONE).values()
    assert len(figure.axes[0].lines) == len(full.axes[0].lines) - 1


def test_relative_motion_has_the_greatest_on_top_with_its_sigma(figures: dict[str, Figure]) -> None:
    axes = titled(figures["relative motion"], "1: 24.67 Hz, 1.08 %")
    widths = [patch.get_width() for patch in axes.patches]  # type: ignore[attr-defined]
    assert widths == sorted(widths, reverse=True)
    assert widths[0] == pytest.approx(0.544, abs=5e-4)
    assert axes.get_yticklabels()[0].get_text() == "arm – wrist"
    # One scale for all modes.
    assert len({plot.get_xlim() for plot in figures["relative motion"].axes}) == 1
    assert max(max(widths), 1.854) <= axes.get_xlim()[1]


def test_relative_motion_leaves_out_what_has_no_ratio_and_tells_what_is_cut() -> None:
    unknown = RelativeMotion(mode=0, between=("a", "b"), ratio=None, ratio_std=None)
    assert relative_motion_figures(replace(ALONE, relative_motion=(unknown,))) == {}
    many = tuple(RelativeMotion(mode=1, between=(str(at), "x"), ratio=0.1 * at, ratio_std=None) for at in range(9))
    (figure,) = relative_motion_figures(replace(ALONE, relative_motion=(unknown, *many))).values()
    assert len(figure.axes) == 1
    assert any("the 6 greatest of each mode" in text for text in texts(figure))


@pytest.mark.parametrize("study", [Study(title="none"), made.without_modes()])
def test_without_modes_there_are_no_figures_of_them(study: Study) -> None:
    for figures_of in (
        mode_shape_figures,
        stabilisation_figures,
        mac_figures,
        synthesis_figures,
        complexity_figures,
        relative_motion_figures,
    ):
        assert figures_of(study) == {}


def test_modes_from_responses_alone_have_no_synthesis() -> None:
    assert set(Album.of(made.ring_study()).figures) == {"mode shapes", "mac", "complexity"}


def test_figures_are_saved_under_plain_names(tmp_path: Path) -> None:
    written = save_figures(made.ring_study(), tmp_path, formats=("png",))
    assert {path.name for path in written} == {"mode-shapes.png", "mac.png", "complexity.png"}
    picture = imread(io.BytesIO(written[0].read_bytes()), format="png")
    assert np.ptp(picture) > 0.5


def test_names_that_try_to_be_mathematics_are_printed_as_they_are() -> None:
    channels = tuple(replace(channel, name=f"/$x_{at}$.y") for at, channel in enumerate(MODES.channels))
    study = Study(title="x", modes=replace(MODES, channels=channels, scale=None), relative_motion=made.motions(MODES))
    (figure,) = mode_shape_figures(study).values()
    for one in (figure, *complexity_figures(study).values(), *synthesis_figures(study).values()):
        drawn(one)
    assert r"\$x_0\$.y" in texts(figure)

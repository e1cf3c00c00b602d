"""What matplotlib has drawn stands in plots that zoom at the same place, with the same words."""

import pytest

pytest.importorskip("bokeh", reason="needs the extra [bench]")

from bokeh.models import ColumnDataSource, FixedTicker, GlyphRenderer, Label, LegendItem
from matplotlib.figure import Figure

from chladni.viewers.figures.upright import name_above
from chladni.viewers.interactive.plots import LEGEND_LINE, SQUARE, translated


def test_upright_names_stand_at_their_frequencies() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([10.0, 110.0], [0.0, 1.0])
    axes.set_xlim(10.0, 110.0)
    name_above(axes, [(20.0, "black"), (60.0, "black"), (100.0, "black")])
    labels = {one.text: one.x for one in translated(figure, cells=1).grid.select({"type": Label})}
    assert labels == {
        "20.00 Hz": pytest.approx(20.0),
        "60.00 Hz": pytest.approx(60.0),
        "100.0 Hz": pytest.approx(100.0),
    }


def test_places_that_have_names_are_numbered_by_them() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.barh([0, 1], [1.0, 2.0])
    axes.set_yticks([0, 1], ["base", "tool"])
    (plot, *_), *_ = translated(figure, cells=1).grid.children
    assert isinstance(plot.yaxis[0].ticker, FixedTicker)
    assert plot.yaxis[0].major_label_overrides == {0.0: "base", 1.0: "tool"}


def test_a_word_in_the_legend_without_a_curve_shows_its_look() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [1.0, 2.0], label="RMS")
    axes.plot([], [], color="#555555", label="peak")
    axes.plot([], [], linestyle="none", marker="s", label="stable")
    axes.legend()
    grid = translated(figure, cells=1).grid
    items = {one.label.value: one.renderers[0] for one in grid.select({"type": LegendItem})}
    assert items.keys() == {"RMS", "peak", "stable"}
    for renderer in items.values():
        assert isinstance(renderer, GlyphRenderer)
        # Bokeh draws a legend's glyph as that of a first point.
        source = renderer.data_source
        assert isinstance(source, ColumnDataSource)
        assert len(source.data["x"])


@pytest.mark.parametrize(("name", "columns"), [("/imu/payload_rail.accel.linear.z", 1), ("tip", 3)])
def test_a_square_plot_has_as_many_lines_for_its_legend_as_the_names_need(name: str, columns: int) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.set_aspect("equal")
    for row in range(3):
        axes.plot([0.0, 1.0], [0.0, row], label=f"{name}{row}")
    axes.legend()
    (plot, *_), *_ = translated(figure, cells=1).grid.children
    [legend] = plot.above
    assert legend.ncols == columns
    # The frame below stays a square of the same size.
    assert plot.height - SQUARE == LEGEND_LINE * (3 // columns - 1)

"""Charts as figures: every curve drawn, axes labelled, scales and markers as the chart says."""

import numpy as np
import pytest

from chladni.models.core.reading import Chart, Curve
from chladni.viewers.figures.chart import chart_figure, chart_figures, charts_figure
from chladni.viewers.figures.rendering import rendered


def curve(label: str, *, points: bool = False) -> Curve:
    return Curve(label=label, x=np.array([1.0, 10.0, 100.0]), y=np.array([1.0, 3.0, 2.0]), points=points)


def chart(name: str = "step.velocity", **changes: object) -> Chart:
    fields = {
        "title": "Velocity after a step",
        "x_label": "time [s]",
        "y_label": "velocity [m/s^2]",
        "curves": (curve("now"), curve("A = 60 cm^2")),
    }
    return Chart(name=name, **{**fields, **changes})  # type: ignore[arg-type]


def test_every_curve_is_drawn_with_its_label_and_units() -> None:
    figure = chart_figure(chart())
    (axes,) = figure.axes
    now, other = axes.lines
    np.testing.assert_array_equal(now.get_xydata(), [[1, 1], [10, 3], [100, 2]])
    assert [line.get_label() for line in (now, other)] == ["now", "A = 60 cm^2"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "velocity [m/s²]")
    assert axes.get_title(loc="left") == "Velocity after a step"
    # What it is compared with stands back.
    assert now.get_linewidth() > other.get_linewidth()
    assert axes.get_legend() is not None
    assert chart_figure(chart(curves=(curve("now"),))).axes[0].get_legend() is None


def test_poles_are_crosses_and_zeros_circles_of_one_colour() -> None:
    figure = chart_figure(chart("poles", curves=(curve("poles now", points=True), curve("zeros now", points=True))))
    poles, zeros = figure.axes[0].lines[:2]
    assert (poles.get_marker(), zeros.get_marker()) == ("x", "o")
    assert poles.get_color() == zeros.get_color()


def test_scales_are_those_of_the_chart() -> None:
    axes = chart_figure(chart(x_scale="log", y_scale="log")).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert axes.get_ylim()[0] < 1 < 3 < axes.get_ylim()[1]
    nothing = Curve(label="none", x=np.array([1.0]), y=np.array([np.nan]))
    assert chart_figure(chart(y_scale="log", curves=(nothing,))).axes[0].get_yscale() == "linear"


def test_equal_axes_have_one_scale() -> None:
    assert chart_figure(chart("nyquist", equal=True)).axes[0].get_aspect() == 1


def test_several_charts_share_a_sheet_by_kind() -> None:
    charts = [chart(f"step.{letter}") for letter in "abcd"] + [chart("poles")]
    figures = dict(chart_figures(charts, name="motor"))
    assert list(figures) == ["motor step 1–2", "motor step 3–4", "motor poles"]
    assert [len(figure.axes) for figure in figures.values()] == [2, 2, 1]
    assert len(charts_figure(charts[:3]).axes) == 3


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_figures_render(kind: str) -> None:
    assert len(rendered(chart_figure(chart(title="x$_y")), kind)) > 1000

"""Plots over dates: all that stands at one time on paper stands at it on the page."""

import numpy as np
import pytest

pytest.importorskip("bokeh", reason="needs the extra [bench]")

from bokeh.models import BoxAnnotation, ColumnDataSource, DatetimeAxis, HoverTool, Span
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure

from chladni.viewers.interactive.plots import translated

MS = np.datetime64("2026-05-01T06:00", "ms").astype(np.int64) + 86_400_000 * np.arange(5.0)


def test_lines_errors_shades_and_changes_of_a_day_stand_together() -> None:
    figure = Figure()
    axes = figure.subplots()
    x = MS.astype("datetime64[ms]")
    axes.plot(x, np.arange(5.0))
    axes.errorbar(x, np.arange(5.0), yerr=0.1, fmt=".")
    axes.axvspan(x[1], x[3])
    axes.axvline(x[2])
    axes.xaxis.set_major_locator(locator := AutoDateLocator())
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    grid = translated(figure, cells=1).grid
    assert list(grid.select({"type": DatetimeAxis}))
    columns = [one.data for one in grid.select({"type": ColumnDataSource}) if "x" in one.data]
    assert len(columns) >= 2
    for one in columns:
        np.testing.assert_allclose(one["x"], MS, atol=1.0)
    [errors] = [one.data["xs"] for one in grid.select({"type": ColumnDataSource}) if "xs" in one.data]
    np.testing.assert_allclose([ends[0] for ends in errors], MS, atol=1.0)
    [shade] = [one for one in grid.select({"type": BoxAnnotation}) if one.line_color is None]
    np.testing.assert_allclose([shade.left, shade.right], [MS[1], MS[3]], atol=1.0)
    [change] = [one for one in grid.select({"type": Span}) if isinstance(one.location, float)]
    assert change.location == pytest.approx(MS[2], abs=1.0)
    told = [one for tool in grid.select({"type": HoverTool}) for one in tool.tooltips]
    assert any("%F" in text for _, text in told)

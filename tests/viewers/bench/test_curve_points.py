"""Curves keep their peaks and ends when they are thinned, and arrive as they were sent."""

from itertools import pairwise

import numpy as np
import pytest
from bokeh.core.serialization import Deserializer, Serializer

from chladni.models.core.reading import Scale
from chladni.viewers.bench.curve_points import ROUNDS, STRAIGHT, STRETCHES, inline, straightened, thinned


def test_an_array_travels_inside_its_message() -> None:
    values = np.array([1.0, -2.5e-300, np.nan, np.inf])
    sent = Serializer().serialize({"xs": [inline(values)]})
    assert sent.buffers == []
    (back,) = Deserializer().deserialize(sent)["xs"]
    np.testing.assert_array_equal(back, values)
    # Without it each array is a frame of its own, which is what takes long.
    assert len(Serializer().serialize({"xs": [values]}).buffers) == 1


def test_a_part_of_an_array_is_sent_as_that_part() -> None:
    every_other = np.arange(10.0)[::2]
    sent = Serializer().serialize(inline(every_other))
    np.testing.assert_array_equal(Deserializer().deserialize(sent), every_other)


def test_peaks_and_ends_stay() -> None:
    x = np.linspace(0.0, 1.0, 50_003)
    y = np.sin(300 * x)
    y[[12_345, 33_333]] = 7.0, -9.0
    thin_x, thin_y = thinned(x, y)
    assert thin_x.size <= 2 * STRETCHES + 60
    assert (thin_x[0], thin_x[-1], thin_y[0], thin_y[-1]) == (x[0], x[-1], y[0], y[-1])
    assert {7.0, -9.0} <= set(thin_y)
    assert np.isin(thin_y, y).all()
    # In each thousandth of the width the band that is drawn is that of all points, but for the points at its edge.
    edges = np.linspace(0.0, 1.0, 501)
    for low, high in pairwise(edges[1:-1]):
        all_of, thin_of = ((b[(a >= low) & (a < high)]) for a, b in ((x, y), (thin_x, thin_y)))
        assert abs(all_of.max() - thin_of.max()) < 300 * 3e-3
        assert abs(all_of.min() - thin_of.min()) < 300 * 3e-3


def test_short_curves_loops_and_gaps_stay_as_they_are() -> None:
    angle = np.linspace(0.0, 6.0, 9000)
    gap = np.sin(angle)
    gap[100] = np.nan
    for x, y in ((angle[:3999], np.sin(angle[:3999])), (np.cos(angle), np.sin(angle)), (angle, gap)):
        assert thinned(x, y)[0] is x


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_what_is_left_is_the_curve_that_was(scale: Scale) -> None:
    x = np.geomspace(1e-3, 1e3, 601)
    y = 1 / np.hypot(1 - x**2, 0.1 * x)
    left_x, left_y = straightened(x, y, scale, scale)
    assert left_x.size < 0.6 * x.size
    assert (left_x[0], left_x[-1], left_y.max()) == (x[0], x[-1], y.max())
    # As drawn: straight between the points that stay, on the chart's own axes, of height and width one.
    x, y, left_x, left_y = (np.log10(one) if scale == "log" else one for one in (x, y, left_x, left_y))
    heights = np.abs(np.interp(x, left_x, left_y) - y) / np.ptp(y)
    slopes = np.abs(np.gradient(y, x)) * np.ptp(x) / np.ptp(y)
    # A distance from a line is that along the ordinate but for its slope; each round adds one.
    assert np.all(heights <= ROUNDS * STRAIGHT * np.hypot(1, 2 * slopes) + 1e-12)


def test_a_line_keeps_its_ends_and_a_point_beside_it() -> None:
    x = np.linspace(0.0, 1.0, 500)
    y = 2 * x
    assert straightened(x, y)[0].size <= 2 * 32
    y[251] += 1e-3
    assert y[251] in straightened(x, y)[1]


def test_gaps_turns_and_empty_curves_stay() -> None:
    x = np.linspace(0.0, 1.0, 201)
    gap = 2 * x
    gap[101] = np.nan
    left_x, left_y = straightened(x, gap)
    assert np.isnan(left_y).sum() == 1
    # Both of its neighbours, or the gap would be wider.
    assert {x[100], x[101], x[102]} <= set(left_x)
    there_and_back = np.concatenate([x, x[::-1]])
    assert straightened(there_and_back, np.zeros(402))[0].max() == 1.0
    assert straightened(np.empty(0), np.empty(0))[0].size == 0
    unknown = np.full(100, np.nan)
    assert straightened(np.arange(100.0), unknown)[0].size == 100

"""Curves keep their peaks and ends when they are thinned, and arrive as they were sent."""

from itertools import pairwise

import numpy as np
from bokeh.core.serialization import Deserializer, Serializer

from chladni.viewers.bench.curve_points import STRETCHES, inline, thinned


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

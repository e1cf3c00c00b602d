"""Trends of one log or of many at one moment have an axis that can be read."""

import matplotlib.dates
import numpy as np
import pytest

from chladni.signals.trend import Trend
from chladni.viewers.figures.trends import dates_around, trend_figures

NOON_NS = 1_767_268_800 * 10**9
DAY_NS = 24 * 3600 * 10**9


def trend_at(*times_ns: int) -> Trend:
    flat = np.ones(len(times_ns))
    return Trend(
        kind="mode",
        name="mode 1",
        unit="Hz",
        logs=tuple(f"{place}.mcap" for place in range(len(times_ns))),
        times_ns=np.array(times_ns),
        values=flat,
        std=0.1 * flat,
        expected=flat,
        explained=0.0 * flat,
        scatter=0.1,
    )


@pytest.mark.parametrize("times_ns", [(NOON_NS,), (NOON_NS, NOON_NS)])
def test_a_single_date_has_the_axis_of_a_day(times_ns: tuple[int, ...]) -> None:
    [figure] = trend_figures([trend_at(*times_ns)])["Natural frequencies"].values()
    low, high = matplotlib.dates.num2date(figure.axes[-1].get_xlim())
    assert (high - low).total_seconds() == pytest.approx(24 * 3600)
    assert low.timestamp() < NOON_NS / 1e9 < high.timestamp()


def test_months_fill_their_axis() -> None:
    first, last = dates_around(np.array([NOON_NS, NOON_NS + 100 * DAY_NS]))
    assert (NOON_NS - first, last - NOON_NS) == (2 * DAY_NS, 102 * DAY_NS)

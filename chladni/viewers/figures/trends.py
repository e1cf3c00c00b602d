"""Trends: values of many logs over months, what is expected of them, and where they changed."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from chladni.signals.arrays import Whole
from chladni.signals.trend import Trend, TrendKind
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.style import ON_LIGHT

#: More panes above one another are too flat for a page.
PANES: Final = 5
PANE_IN: Final = 1.15
SECTIONS: Final[Mapping[TrendKind, str]] = {
    "mode": "Natural frequencies", "damping": "Damping ratios", "level": "Levels", "line": "Lines", "cause": "Causes"
}  # fmt: skip
HALF_DAY_NS: Final = 12 * 3600 * 10**9
VALUES, EXPECTED, CHANGED = paint(ON_LIGHT[0]), paint(ON_LIGHT[7]), paint(ON_LIGHT[1])


def trend_figures(trends: Sequence[Trend]) -> dict[str, dict[str, Figure]]:
    """Draw trends: figures by name, by the heading of their section; a section that has none is left out.

    Each pane shows values with one sigma, what covariates explain taken off, and the level that is expected; pale,
    values as they were measured; each change as a line, with the logs between which it lies shaded (95 %).
    """
    drawn: dict[str, dict[str, Figure]] = {}
    for kind, heading in SECTIONS.items():
        mine = [one for one in trends if one.kind == kind]
        for place, some in enumerate(_batches(mine), 1):
            drawn.setdefault(heading, {})[f"{heading.lower()} {place}"] = _figure(some)
    return drawn


def dates_around(times_ns: Whole) -> tuple[int, int]:
    """Ends of an axis that shows all these times; of a single one the day about it."""
    first, last = int(times_ns.min()), int(times_ns.max())
    beside = (last - first) // 50 or HALF_DAY_NS
    return first - beside, last + beside


def _batches(trends: Sequence[Trend]) -> list[Sequence[Trend]]:
    return [trends[first : first + PANES] for first in range(0, len(trends), PANES)]


def _figure(trends: Sequence[Trend]) -> Figure:
    with look():
        figure, panes = sheet([PANE_IN] * len(trends), sharex=True)
        for axes, trend in zip(panes, trends, strict=True):
            _draw(axes, trend)
        if _dated(trends):
            # matplotlib's dates are untyped.
            dates: Any = import_module("matplotlib.dates")
            locator = dates.AutoDateLocator(minticks=3, maxticks=7)
            panes[-1].xaxis.set_major_locator(locator)
            panes[-1].xaxis.set_major_formatter(dates.ConciseDateFormatter(locator))
            ends_ns = dates_around(np.concatenate([one.times_ns for one in trends]))
            panes[-1].set_xlim(*dates.date2num(np.array(ends_ns, "datetime64[ns]")))
        else:
            panes[-1].set_xlabel("log")
            panes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
        return figure


def _dated(trends: Sequence[Trend]) -> bool:
    return all(bool(one.times_ns.all()) for one in trends)


def _draw(axes: Axes, trend: Trend) -> None:
    x = trend.times_ns.astype("datetime64[ns]") if trend.times_ns.all() else np.arange(len(trend.logs))
    error = np.where(np.isfinite(trend.std), trend.std, 0.0)
    if trend.covariates:
        axes.plot(x, trend.values, ".", markersize=2.5, color=(*EXPECTED, 0.45), markeredgewidth=0)
    axes.errorbar(
        x,
        trend.values - trend.explained,
        yerr=error,
        fmt=".",
        markersize=3,
        elinewidth=0.5,
        color=VALUES,
        ecolor=(*VALUES, 0.35),
    )
    axes.plot(x, trend.expected - trend.explained, color="black", linewidth=0.9, drawstyle="steps-mid")
    for change in trend.changes:
        axes.axvspan(x[max(change.first - 1, 0)], x[change.last], color=CHANGED, alpha=0.25, linewidth=0)
        axes.axvline(x[change.place], color=CHANGED, linewidth=0.8)
    unit = "" if trend.unit == "1" else f" [{printed_unit(trend.unit)}]"
    axes.set_title(plain(f"{trend.name}{unit}"), loc="left")
    axes.margins(x=0.02, y=0.12)
    if _plain_size(trend):
        axes.ticklabel_format(axis="y", useOffset=False, style="plain")
    axes.locator_params(axis="y", nbins=4)


def _plain_size(trend: Trend) -> bool:
    largest = float(np.abs(trend.values).max(initial=0.0))
    return 1e-3 <= largest < 1e5

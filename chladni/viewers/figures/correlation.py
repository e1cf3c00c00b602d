"""Correlation over lag, with the delay that was found."""

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.channel import labels_of
from chladni.signals.cross_correlation import CrossCorrelation, TimeDelays
from chladni.viewers.drawing import thin
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.style import ON_LIGHT

HEIGHT_IN = 1.3
# A delay in the middle of its half, and no fewer samples than show the shape of the peak.
AROUND_A_DELAY = 4.0
FEWEST_STEPS = 60
A_SHEET = 6
POINTS = 4000


def correlation_figures(found: CrossCorrelation) -> dict[str, Figure]:
    """Draw the coefficients over lag, a pane for each response; several sheets where there are many, by name."""
    return _figures(found, np.full(len(found.responses), np.nan))


def delay_figures(found: TimeDelays) -> dict[str, Figure]:
    """Draw the correlation in which delays were found, each with its delay."""
    return _figures(found.correlation, found.delay_s)


def _figures(found: CrossCorrelation, delay_s: np.ndarray) -> dict[str, Figure]:
    labels = labels_of((found.reference, *found.responses))
    figures = {}
    with look():
        for page, rows in pages(len(found.responses), A_SHEET):
            lowest_s, highest_s = _shown_lags(found, delay_s[list(rows)])
            # Thinned over seconds, a peak of milliseconds would be a corner or two.
            shown = _between(found, lowest_s, highest_s)
            figure, stack = sheet([HEIGHT_IN] * len(rows), sharex=True, sharey=True)
            for axes, row in zip(stack, rows, strict=True):
                draw_correlation(axes, shown, row, float(delay_s[row]))
                axes.set_title(plain(labels[found.responses[row].name]), loc="left", pad=2)
            stack[-1].set_xlabel(plain(f"Lag after {labels[found.reference.name]} [s]"))
            stack[-1].set_xlim(lowest_s, highest_s)
            figure.supylabel("Correlation coefficient", fontsize=8.5)
            figures[f"correlation{page}"] = figure
    return figures


def _shown_lags(found: CrossCorrelation, delay_s: np.ndarray) -> tuple[float, float]:
    """Give the lags around 0 and the delays, so that a delay of milliseconds is seen in a correlation of seconds."""
    known = np.abs(delay_s[np.isfinite(delay_s)])
    step_s = float(found.lag_s[1] - found.lag_s[0])
    reach_s = max(AROUND_A_DELAY * float(known.max()), FEWEST_STEPS * step_s) if known.size else np.inf
    return max(float(found.lag_s[0]), -reach_s), min(float(found.lag_s[-1]), reach_s)


def _between(found: CrossCorrelation, lowest_s: float, highest_s: float) -> CrossCorrelation:
    inside = (found.lag_s >= lowest_s) & (found.lag_s <= highest_s)
    return replace(found, lag_s=found.lag_s[inside], values=found.values[:, inside])


def draw_correlation(axes: Axes, found: CrossCorrelation, row: int, delay_s: float) -> None:
    """Draw the coefficients of one response into given axes, with its delay where that is finite."""
    values = np.asarray(found.values[row], dtype=np.float64)
    shown, _ = thin(values, limit=POINTS)
    axes.axhline(0, color="#888888", linewidth=0.6, zorder=0)
    axes.plot(found.lag_s[shown], values[shown], color=paint(ON_LIGHT[0]), linewidth=0.7)
    if np.isfinite(delay_s):
        axes.axvline(delay_s, color=paint(ON_LIGHT[1]), linewidth=0.8, linestyle="--")
        axes.annotate(
            f"{delay_s * 1e3:.4g} ms",
            (delay_s, 1),
            xycoords=("data", "axes fraction"),
            xytext=(3, -9),
            textcoords="offset points",
            color=paint(ON_LIGHT[1]),
            fontsize=7.5,
        )

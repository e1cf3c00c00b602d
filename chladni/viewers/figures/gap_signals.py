"""Measured against simulated, before and after: where the model errs most, and the errors of the whole log."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import Diagnosis, GapSignals
from chladni.signals.engineering import axis_scale, engineering
from chladni.viewers.drawing import thin, with_breaks
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.gap_evidence import AFTER_ON_LIGHT, BEFORE_ON_LIGHT, MEASURED_ON_LIGHT, Evidence, GapEvidence

# Several a pixel at 300 dots an inch: what is left out can't be seen, and a report's plot can be zoomed.
POINTS = 8000
OUTPUTS_A_FIGURE = 4
# Of each output, with its name; of a few of them together at least as much as shows a curve. Above them the legend.
HEIGHT_IN, LEAST_IN, LEGEND_POINTS = 1.15, 2.2, 16.0
LEGEND: dict[str, Any] = {"ncols": 4, "frameon": False, "handlelength": 1.4, "columnspacing": 1.2}
MEASURED, BEFORE, AFTER = paint(MEASURED_ON_LIGHT), paint(BEFORE_ON_LIGHT), paint(AFTER_ON_LIGHT)


def signal_figures(evidence: Evidence) -> dict[str, Figure]:
    """Draw signals in the stretch where the model errs most, by name; none without signals."""
    signals, telling_s = evidence.signals, evidence.telling_s
    if signals is None or telling_s is None:
        return {}
    with look():
        return {
            f"signals{part}": stacked(
                evidence,
                signals,
                rows,
                lambda axes, row: draw_zoom(axes, signals, row, telling_s, after=evidence.after),
                x_label="Time [s]",
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def error_figures(evidence: Evidence) -> dict[str, Figure]:
    """Draw the errors of the whole log, by name; none without signals."""
    signals = evidence.signals
    if signals is None:
        return {}
    with look():
        return {
            f"errors{part}": stacked(
                evidence,
                signals,
                rows,
                lambda axes, row: draw_errors(axes, signals, row, after=evidence.after),
                x_label="Time [s]",
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def stacked(
    evidence: Evidence,
    signals: GapSignals,
    rows: Sequence[int],
    draw: Callable[[Axes, int], None],
    *,
    x_label: str,
) -> Figure:
    """Draw one axes an output, under each other, the output's name above each and one legend above all."""
    height = max(HEIGHT_IN, LEAST_IN / len(rows))
    figure, stack = sheet([height] * len(rows), above_points=LEGEND_POINTS, sharex=True)
    for axes, row in zip(stack, rows, strict=True):
        draw(axes, row)
        axes.set_title(plain(signals.output_names[row]), loc="left", pad=4)
    if isinstance(evidence, GapEvidence):
        stack[0].set_title(windows_told(evidence.found), loc="right", pad=4)
    # Above all of them, where it covers neither data nor names.
    figure.legend(*stack[0].get_legend_handles_labels(), loc="outside upper left", **LEGEND)
    stack[-1].set_xlabel(x_label)
    return figure


def windows_told(found: Diagnosis) -> str:
    """Say over what windows simulations run, in a few words for a title; nothing where they run free."""
    gap = found.gap
    # Of a robot the signals are torques; windows are those of its positions.
    if found.motion is not None or gap.by != "windows" or gap.horizon_s is None:
        return ""
    return f"windows of {engineering(gap.horizon_s, None, 's')}"


def draw_zoom(axes: Axes, signals: GapSignals, row: int, span_s: tuple[float, float], *, after: str | None) -> None:
    """Draw one output as measured and as simulated, before and after (alone if None), between two times."""
    # Half a sample early: a span begins and ends at samples, as far as numbers can be exact.
    half_s = 0.5 / signals.sample_rate_hz
    first, last = (int(np.searchsorted(signals.seconds, end - half_s)) for end in span_s)
    time_s = signals.seconds[first:last]
    starts = np.array([start - first for start in signals.window_starts if first < start < last], dtype=np.intp)
    scale, unit = axis_scale(signals.measured[row], signals.output_units[row])
    axes.plot(time_s, signals.measured[row, first:last] / scale, color=MEASURED, linewidth=2.6, label="measured")
    # Each wider than what is drawn over it, so that none is hidden by one that follows it.
    lines = [(signals.before, BEFORE, 1.4, "simulated" if after is None else "simulated before")]
    if after is not None:
        lines.append((signals.after, AFTER, 0.8, after))
    for values, colour, width, label in lines:
        # A window begins at a state of its own: no line joins it to the one before.
        x, y = with_breaks(time_s, values[row, first:last] / scale, starts)
        axes.plot(x, y, color=colour, linewidth=width, label=label)
    axes.set_xlim(time_s[0], time_s[-1])
    axes.set_ylabel(f"[{plain(unit)}]")


def draw_errors(
    axes: Axes,
    signals: GapSignals,
    row: int,
    *,
    after: str | None,
    span_s: tuple[float, float] | None = None,
) -> None:
    """Draw the errors of one output, of the whole log or between two times; the noise as a band."""
    # Half a sample early: a span begins and ends at samples, as far as numbers can be exact.
    half_s = 0.5 / signals.sample_rate_hz
    first, last = (int(np.searchsorted(signals.seconds, end - half_s)) for end in span_s or (-np.inf, np.inf))
    starts = np.array([start - first for start in signals.window_starts if first < start < last], dtype=np.intp)
    time_s, measured = signals.seconds[first:last], signals.measured[row, first:last]
    lines = [(signals.before, BEFORE, 0.9, "error" if after is None else "error before")]
    if after is not None:
        lines.append((signals.after, AFTER, 0.5, f"error {after}"))
    scale, unit = axis_scale(measured - signals.before[row, first:last], signals.output_units[row])
    for simulated, colour, width, label in lines:
        x, y = with_breaks(time_s, (measured - simulated[row, first:last]) / scale, starts)
        chosen, _ = thin(y, limit=POINTS)
        axes.plot(x[chosen], y[chosen], color=colour, linewidth=width, label=label)
    noise = float(signals.noise_rms[row]) / scale
    axes.axhspan(-noise, noise, color="black", alpha=0.25, linewidth=0, zorder=4, label="noise")
    axes.set_xlim(*(span_s or signals.span_s))
    axes.set_ylabel(f"[{plain(unit)}]")

"""Measured against simulated, before and after: where the model errs most, and the errors of the whole log."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import GapSignals
from chladni.viewers.drawing import Floats, thin
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.gap_evidence import AFTER_ON_LIGHT, BEFORE_ON_LIGHT, MEASURED_ON_LIGHT, GapEvidence
from chladni.viewers.labels import printed_unit

# Two a pixel at 300 dots an inch: what is left out can't be seen.
POINTS = 3000
OUTPUTS_A_FIGURE = 4
HEIGHT_IN = 1.15
LEGEND: dict[str, Any] = {"ncols": 4, "frameon": False, "handlelength": 1.4, "columnspacing": 1.2}
MEASURED, BEFORE, AFTER = paint(MEASURED_ON_LIGHT), paint(BEFORE_ON_LIGHT), paint(AFTER_ON_LIGHT)


def signal_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw signals in the stretch where the model errs most, by name; none without signals."""
    signals, telling_s = evidence.found.signals, evidence.telling_s
    if signals is None or telling_s is None:
        return {}
    with look():
        return {
            f"signals{part}": stacked(
                signals, rows, lambda axes, row: draw_zoom(axes, signals, row, telling_s), x_label="Time [s]"
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def error_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw the errors of the whole log, by name; none without signals."""
    signals = evidence.found.signals
    if signals is None:
        return {}
    with look():
        return {
            f"errors{part}": stacked(
                signals, rows, lambda axes, row: _draw_errors(axes, signals, row), x_label="Time [s]"
            )
            for part, rows in pages(len(signals.output_names), OUTPUTS_A_FIGURE)
        }


def stacked(signals: GapSignals, rows: Sequence[int], draw: Callable[[Axes, int], None], *, x_label: str) -> Figure:
    """Draw one axes an output, under each other, the output's name above each and one legend above all."""
    figure, stack = sheet([HEIGHT_IN] * len(rows), sharex=True)
    for axes, row in zip(stack, rows, strict=True):
        draw(axes, row)
        axes.set_title(plain(signals.output_names[row]), loc="left", pad=2)
    # Above all of them, where it covers neither data nor names.
    figure.legend(*stack[0].get_legend_handles_labels(), loc="outside upper left", **LEGEND)
    stack[-1].set_xlabel(x_label)
    return figure


def draw_zoom(axes: Axes, signals: GapSignals, row: int, span_s: tuple[float, float]) -> None:
    """Draw one output as measured and as simulated, before and after, between two times."""
    first, last = (round(end * signals.sample_rate_hz) for end in span_s)
    time_s = np.arange(first, last) / signals.sample_rate_hz
    for values, colour, width, label in (
        # Wide and behind, so that a simulation that follows it doesn't hide it.
        (signals.measured, MEASURED, 2.4, "measured"),
        (signals.before, BEFORE, 0.9, "simulated before"),
        (signals.after, AFTER, 0.9, "after"),
    ):
        axes.plot(time_s, values[row, first:last], color=colour, linewidth=width, label=label)
    axes.set_xlim(time_s[0], time_s[-1])
    axes.set_ylabel(f"[{plain(printed_unit(signals.output_units[row]))}]")


def _draw_errors(axes: Axes, signals: GapSignals, row: int) -> None:
    """Errors of the whole log; the noise as a band."""
    for simulated, colour, label in (
        (signals.before, BEFORE, "error before"),
        (signals.after, AFTER, "error after"),
    ):
        _draw_thinned(axes, signals.measured[row] - simulated[row], signals.sample_rate_hz, colour, label)
    noise = float(signals.noise_rms[row])
    axes.axhspan(-noise, noise, color="black", alpha=0.25, linewidth=0, zorder=4, label="noise")
    axes.set_xlim(0, signals.measured.shape[1] / signals.sample_rate_hz)
    axes.set_ylabel(f"[{plain(printed_unit(signals.output_units[row]))}]")


def _draw_thinned(axes: Axes, values: Floats, rate_hz: float, colour: tuple[float, float, float], label: str) -> None:
    chosen, _ = thin(values, limit=POINTS)
    axes.plot(chosen / rate_hz, values[chosen], color=colour, linewidth=0.5, label=label)

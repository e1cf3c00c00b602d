"""Nyquist plots: frequency responses as curves in the complex plane."""

import numpy as np
from matplotlib.figure import Figure

from chladni.signals.study import Study
from chladni.viewers.drawing import line_breaks, with_breaks
from chladni.viewers.figures.sheet import SQUARE_IN, legend, look, paint, plain, sheet
from chladni.viewers.panels import Panel, panels
from chladni.viewers.style import Style

# Share of the diagonal, about two points on paper.
DOT_SPACING = 0.004


def nyquist_figures(study: Study) -> dict[str, Figure]:
    """Draw the excited lines of the frequency responses in the complex plane, by name."""
    if study.response is None:
        return {}
    style = Style.of(study)
    with look():
        return {
            f"nyquist {panel.reference + 1} {panel.group.name}": _figure(panel, style)
            for panel in panels(study.response)
        }


def _figure(panel: Panel, style: Style) -> Figure:
    figure, (axes,) = sheet([4.2], width_in=SQUARE_IN)
    breaks = line_breaks(panel.frequency_hz())
    for row in panel.group.rows:
        channel, value = panel.response.responses[row], panel.function(row)
        _, points = with_breaks(panel.frequency_hz(), np.column_stack([value.real, value.imag]), breaks)
        axes.plot(
            points[:, 0],
            points[:, 1],
            color=paint(style.on_light(channel)),
            marker=".",
            markersize=2.5,
            # A dot where a dot of its own can be seen: thousands in one place make a file of megabytes.
            markevery=DOT_SPACING,
            linewidth=0.8,
            label=plain(style.labels[channel.name]),
        )
    axes.axhline(0, color="#888888", linewidth=0.6, zorder=0)
    axes.axvline(0, color="#888888", linewidth=0.6, zorder=0)
    # Equal, or the circle of a resonance would be an ellipse.
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"Re H [{panel.unit}]")
    axes.set_ylabel(f"Im H [{panel.unit}]")
    legend(axes)
    return figure

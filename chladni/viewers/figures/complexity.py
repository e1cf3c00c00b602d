"""Complexity plots: the components of each mode as arrows in the complex plane; a mode in one phase is a line."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.study import Study
from chladni.viewers.figures.panes import pages, panes
from chladni.viewers.figures.sheet import look, paint, plain
from chladni.viewers.mode_tables import mode_title
from chladni.viewers.style import Style

PLOTS_IN_A_FIGURE = 12
PANE_HEIGHT_IN = 1.72
GREY = "#cccccc"
# With more channels than colours the legend would tell nothing.
CHANNELS_NAMED = 8


def complexity_figures(study: Study) -> dict[str, Figure]:
    """Draw every mode in a circle of its own, several to a figure, by name; none without modes.

    A single channel has nothing to draw: its only component is 1.
    """
    modes = study.modes
    if modes is None or not modes.frequency_hz.size or len(modes.channels) == 1:
        return {}
    style = Style.of(study)
    with look():
        return {
            f"complexity{part}": _figure(modes, study.validation, rows, style)
            for part, rows in pages(modes.frequency_hz.size, PLOTS_IN_A_FIGURE)
        }


def _figure(modes: ModeSet, validation: ModeValidation | None, rows: range, style: Style) -> Figure:
    figure, stack = panes(len(rows), columns=4, height_in=PANE_HEIGHT_IN)
    for axes, row in zip(stack, rows, strict=True):
        _draw(axes, modes, row, style)
        title = mode_title(modes, row)
        if validation is not None:
            _draw_mean_phase(axes, float(validation.mean_phase_deg[row]))
            title += f"\nMPC {validation.mpc[row]:.3f}, MPD {validation.mpd_deg[row]:.1f}°"
        axes.set_title(title, loc="center", pad=2, fontsize=7)
    if len(modes.channels) <= CHANNELS_NAMED:
        handles = [
            Line2D([], [], color=paint(style.on_light(channel)), label=plain(style.labels[channel.name]))
            for channel in modes.channels
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, handlelength=1.2)
    return figure


def _draw(axes: Axes, modes: ModeSet, row: int, style: Style) -> None:
    angle = np.linspace(0, 2 * np.pi, 181)
    for radius in (0.5, 1.0):
        axes.plot(radius * np.cos(angle), radius * np.sin(angle), color=GREY, linewidth=0.5, zorder=1)
    axes.plot([-1.1, 1.1], [0, 0], color=GREY, linewidth=0.5, zorder=1)
    axes.plot([0, 0], [-1.1, 1.1], color=GREY, linewidth=0.5, zorder=1)
    tips = np.column_stack([modes.shapes[row].real, modes.shapes[row].imag])
    colours = [paint(style.on_light(channel)) for channel in modes.channels]
    arrows = LineCollection(
        list(np.stack([np.zeros_like(tips), tips], axis=1)),
        colors=colours,
        linewidths=1.1 if len(tips) <= 30 else 0.4,
    )
    axes.add_collection(arrows)
    axes.scatter(tips[:, 0], tips[:, 1], s=7 if len(tips) <= 30 else 2, color=colours, linewidths=0, zorder=3)
    axes.text(1.13, 0, "Re", fontsize=5.5, color="#888888", va="center")
    axes.text(0, 1.13, "Im", fontsize=5.5, color="#888888", ha="center")
    axes.set_xlim(-1.3, 1.3)
    axes.set_ylim(-1.15, 1.25)
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_mean_phase(axes: Axes, angle_deg: float) -> None:
    angle = np.deg2rad(angle_deg)
    x, y = 1.1 * np.cos(angle), 1.1 * np.sin(angle)
    axes.plot([-x, x], [-y, y], color="#555555", linewidth=0.6, linestyle=(0, (3, 2)), zorder=2)

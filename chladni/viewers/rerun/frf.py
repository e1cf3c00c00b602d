"""Frequency response functions: magnitude, phase and coherence over frequency."""

from collections.abc import Callable

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.viewers.drawing import decibels_of_amplitude, level_limits, line_breaks, phase_wraps, with_breaks
from chladni.viewers.labels import decibel_unit
from chladni.viewers.panels import Panel
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.lines import draw_band, draw_line
from chladni.viewers.rerun.timelines import frequency_axis
from chladni.viewers.style import Style


def draw_magnitude(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the magnitudes in decibels, with one sigma."""

    def draw(row: int, path: str) -> None:
        channel, value = panel.response.responses[row], np.abs(panel.function(row))
        std = panel.deviation(row)
        upper = np.where(np.isfinite(std), value + std, np.nan)
        x, curves = _broken(panel, np.column_stack([value, value - std, upper]))
        level, low, high = decibels_of_amplitude(curves).T
        colour = style.on_dark(channel)
        draw_line(recording, path, x, level, name=style.labels[channel.name], colour=colour)
        draw_band(recording, path, x, [low, high], colour=colour, lines_in_view=len(panel.group.rows))

    # From the lines that are drawn: noise on the others must not set the scale.
    levels = [decibels_of_amplitude(np.abs(panel.function(row))) for row in panel.group.rows]
    reference = style.labels[panel.response.references[panel.reference].name]
    estimator = panel.response.provenance.estimator
    return _view(
        panel,
        "magnitude",
        f"{panel.quantity} |H| to {reference} [{decibel_unit(panel.unit)}] · {estimator} · 1 ms = 1 Hz",
        draw,
        limits=level_limits(np.concatenate(levels)),
        legend=True,
    )


def draw_phase(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the phases in degrees, from -180 to 180."""

    def draw(row: int, path: str) -> None:
        channel, phase = panel.response.responses[row], np.angle(panel.function(row), deg=True)
        # Broken also where it jumps from -180 to 180: that is one angle, not a fall.
        breaks = np.union1d(line_breaks(panel.frequency_hz()), phase_wraps(phase))
        x, y = with_breaks(panel.frequency_hz(), phase, breaks)
        draw_line(recording, path, x, y, name=style.labels[channel.name], colour=style.on_dark(channel))

    return _view(panel, "phase", "Phase [deg] · H = Y/X, exp(+jωt)", draw, limits=(-190.0, 190.0))


def draw_coherence(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the coherence, 0 to 1."""

    def draw(row: int, path: str) -> None:
        channel = panel.response.responses[row]
        x, y = _broken(panel, panel.coherence(row))
        draw_line(recording, path, x, y, name=style.labels[channel.name], colour=style.on_dark(channel))

    kind = "Coherence γ²" if len(panel.response.references) == 1 else "Multiple coherence γ²"
    # A little above one, or a perfect coherence would hide under the frame.
    return _view(panel, "coherence", f"{kind} [1]", draw, limits=(0.0, 1.05))


def panel_folder(panel: Panel, kind: str) -> str:
    """Give the folder of a panel's entities for one kind of plot."""
    return folder(kind, f"reference {panel.reference + 1}", panel.group.name)


def _broken(panel: Panel, values: Real) -> tuple[Real, Real]:
    frequency_hz = panel.frequency_hz()
    return with_breaks(frequency_hz, values, line_breaks(frequency_hz))


def _view(
    panel: Panel,
    kind: str,
    name: str,
    draw: Callable[[int, str], None],
    *,
    limits: tuple[float, float],
    legend: bool = False,
) -> rrb.View:
    parent = panel_folder(panel, kind)
    for row in panel.group.rows:
        draw(row, channel_entity(parent, panel.response.responses[row]))
    frequency_hz = panel.frequency_hz()
    return rrb.TimeSeriesView(
        origin=parent,
        name=name,
        axis_x=frequency_axis(float(frequency_hz[0]), float(frequency_hz[-1])),
        axis_y=rrb.ScalarAxis(range=limits),
        plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.RightTop),
    )

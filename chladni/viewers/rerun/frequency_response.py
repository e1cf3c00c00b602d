"""Frequency response functions: magnitude, phase and coherence over frequency."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.frequency_response import FrequencyResponse
from chladni.viewers.drawing import Floats, decibels_of_amplitude, level_limits, line_breaks, phase_wraps, with_breaks
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import printed_unit, response_quantity
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.lines import draw_band, draw_line
from chladni.viewers.rerun.timelines import frequency_axis
from chladni.viewers.style import Style


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """The functions of one group of responses to one reference, which share their plots.

    Attributes
    ----------
    response
        All functions.
    group
        The responses drawn here.
    reference
        Column of the reference.
    """

    response: FrequencyResponse
    group: Group
    reference: int

    @property
    def unit(self) -> str:
        """Unit as printed."""
        return printed_unit(self.response.unit(self.group.rows[0], self.reference))

    @property
    def quantity(self) -> str:
        """The field's word for this kind of function."""
        return response_quantity(self.group.unit, self.response.references[self.reference].unit)

    def folder(self, kind: str) -> str:
        """Give the entities' folder for one kind of plot."""
        return folder(kind, f"reference {self.reference + 1}", self.group.name)

    def frequency_hz(self) -> Floats:
        """Give the excited frequencies; the others hold only noise and are left out."""
        return self.response.frequency_hz[self.response.excited]

    def function(self, row: int) -> NDArray[np.complexfloating[Any, Any]]:
        """Give one function on the excited frequencies."""
        return np.asarray(self.response.values[row, self.reference, self.response.excited])


def panels(response: FrequencyResponse) -> list[Panel]:
    """Divide the functions into groups that are drawn together: one reference, one unit, a few responses."""
    return [
        Panel(response=response, group=group, reference=reference)
        for reference in range(len(response.references))
        for group in groups(response.responses)
    ]


def draw_magnitude(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the magnitudes in decibels, with one sigma."""

    def draw(row: int, path: str) -> None:
        channel, value = panel.response.responses[row], np.abs(panel.function(row))
        std = panel.response.std[row, panel.reference, panel.response.excited]
        upper = np.where(np.isfinite(std), value + std, np.nan)
        x, curves = _broken(panel, np.column_stack([value, value - std, upper]))
        level, low, high = decibels_of_amplitude(curves).T
        colour = style.on_dark(channel)
        draw_line(recording, path, x, level, name=style.labels[channel.name], colour=colour)
        draw_band(recording, path, x, [low, high], colour=colour, lines_in_view=len(panel.group.rows))

    levels = [decibels_of_amplitude(np.abs(panel.function(row))) for row in panel.group.rows]
    reference = style.labels[panel.response.references[panel.reference].name]
    estimator = panel.response.provenance.estimator
    return _view(
        panel,
        "magnitude",
        f"{panel.quantity} |H| to {reference} [dB re 1 {panel.unit}] · {estimator} · 1 ms = 1 Hz",
        draw,
        limits=level_limits(np.concatenate(levels)),
        legend=True,
    )


def draw_phase(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the phases in degrees, from -180 to 180."""

    def draw(row: int, path: str) -> None:
        channel, phase = panel.response.responses[row], np.angle(panel.function(row), deg=True)
        breaks = np.union1d(line_breaks(panel.frequency_hz()), phase_wraps(phase))
        x, y = with_breaks(panel.frequency_hz(), phase, breaks)
        draw_line(recording, path, x, y, name=style.labels[channel.name], colour=style.on_dark(channel))

    return _view(panel, "phase", "Phase [deg] · H = Y/X, e^{+jωt}", draw, limits=(-190.0, 190.0))


def draw_coherence(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the coherence, 0 to 1."""

    def draw(row: int, path: str) -> None:
        channel = panel.response.responses[row]
        x, y = _broken(panel, panel.response.coherence[row, panel.response.excited])
        draw_line(recording, path, x, y, name=style.labels[channel.name], colour=style.on_dark(channel))

    kind = "Coherence γ²" if len(panel.response.references) == 1 else "Multiple coherence γ²"
    return _view(panel, "coherence", f"{kind} [1]", draw, limits=(0.0, 1.05))


def _broken(panel: Panel, values: Floats) -> tuple[Floats, Floats]:
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
    parent = panel.folder(kind)
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

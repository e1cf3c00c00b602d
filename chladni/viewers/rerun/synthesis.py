"""Frequency responses synthesised from the modes over the measured ones."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import decibels_of_amplitude, level_limits, line_breaks, with_breaks
from chladni.viewers.labels import decibel_unit
from chladni.viewers.overlays import Overlay, OverlayPage, left_out, overlay_pages
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.lines import draw_line
from chladni.viewers.rerun.timelines import frequency_axis, frequency_index, send_scalars
from chladni.viewers.style import Colour, Style


def draw_synthesis(recording: rr.RecordingStream, study: Study, modes: ModeSet, style: Style) -> list[rrb.View]:
    """Write magnitudes in decibels, measured as wide lines and synthesised as bright ones, and give a view a page."""
    return [_draw(recording, modes, page, style) for page in overlay_pages(modes, study.response)]


def _draw(recording: rr.RecordingStream, modes: ModeSet, page: OverlayPage, style: Style) -> rrb.View:
    parent = folder("synthesis", page.name)
    for overlay in page.overlays:
        _draw_overlay(recording, overlay, channel_entity(parent, overlay.response), style)
    both = [decibels_of_amplitude(np.abs(overlay.synthesised)) for overlay in page.overlays]
    both += [decibels_of_amplitude(np.abs(overlay.measured)) for overlay in page.overlays]
    first = page.overlays[0]
    rest = left_out(modes.fit) if modes.fit is not None else ""
    reference = style.labels[first.reference.name]
    return rrb.TimeSeriesView(
        origin=parent,
        name=f"{page.quantity}{page.part} to {reference} [{decibel_unit(printed_unit(page.unit))}]"
        f" · wide measured, bright synthesised · 1 ms = 1 Hz{rest}",
        axis_x=frequency_axis(float(first.frequency_hz[0]), float(first.frequency_hz[-1])),
        axis_y=rrb.ScalarAxis(range=level_limits(np.concatenate(both))),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightBottom),
    )


def _draw_overlay(recording: rr.RecordingStream, overlay: Overlay, path: str, style: Style) -> None:
    colour, label = style.on_dark(overlay.response), style.labels[overlay.response.name]
    if overlay.measured_hz.size:
        # Not dots: the viewer draws those over all lines.
        wide = rr.SeriesLines(names=f"{label} measured", colors=[_dim(colour)], widths=4.0, aggregation_policy="Max")
        recording.log(f"{path}/measured", wide, static=True)
        x, y = _broken(overlay.measured_hz, decibels_of_amplitude(np.abs(overlay.measured)))
        send_scalars(recording, f"{path}/measured", frequency_index(x), y)
    name = f"{label}, error {overlay.error:.1%}"
    x, y = _broken(overlay.frequency_hz, decibels_of_amplitude(np.abs(overlay.synthesised)))
    draw_line(recording, f"{path}/synthesised", x, y, name=name, colour=_bright(colour))


def _dim(colour: Colour) -> Colour:
    """Darken a line; an opacity would show its joints as dots."""
    red, green, blue = (part // 2 for part in colour)
    return red, green, blue


def _bright(colour: Colour) -> Colour:
    """Lighten a line until it stands out from the one it runs over."""
    red, green, blue = ((255 + part) // 2 for part in colour)
    return red, green, blue


def _broken(frequency_hz: Real, level: Real) -> tuple[Real, Real]:
    return with_breaks(frequency_hz, level, line_breaks(frequency_hz))

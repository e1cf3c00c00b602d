"""Spectra over time: the waterfall as an image on axes of seconds and hertz, with the time cursor in it.

An image and not a tensor: rerun's view of tensors has no numbers on its axes. Its values are read in the spectrum of
the moment beside it.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S
from chladni.signals.units import power_density_unit
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, colour_range, decibels_of_power
from chladni.viewers.labels import decibel_unit, reduction
from chladni.viewers.rerun.canvas import Canvas
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.spectrum import slice_starts_ns
from chladni.viewers.rerun.timelines import send_columns, time_index
from chladni.viewers.style import Style, level_colours

# Of the image, which is about as large on the screen; three bytes each.
WIDTH, HEIGHT = 640, 400
DYNAMIC_RANGE_DB = 80.0
CURSOR_COLOUR = (255, 255, 255)


def draw_waterfalls(recording: rr.RecordingStream, study: Study, style: Style) -> list[rrb.View]:
    """Write the waterfall of each channel as an image of its decibels and give a view of each."""
    return [
        _draw_channel(recording, waterfall, row, style, place)
        for place, waterfall in enumerate(study.waterfalls, start=1)
        for row in range(len(waterfall.channels))
    ]


def _draw_channel(
    recording: rr.RecordingStream, waterfall: Waterfall, row: int, style: Style, place: int
) -> rrb.View:
    channel = waterfall.channels[row]
    path = channel_entity(folder("waterfall", str(place)), channel)
    shown, times = block_maximum(waterfall.values[row], axis=0, limit=WIDTH)
    shown, lines = block_maximum(shown, axis=1, limit=HEIGHT)
    # After shortening: fewer logarithms, and the greatest power is the greatest level.
    level = decibels_of_power(shown)
    low, high = colour_range([level], most_db=DYNAMIC_RANGE_DB)
    share = (level - low) / max(high - low, 1.0)
    # Low frequencies at the bottom; images start at the top.
    across, up = _nearest(share.shape[0], WIDTH), _nearest(share.shape[1], HEIGHT)[::-1]
    recording.log(path, rr.Image(level_colours(share[across][:, up].T), draw_order=-20.0), static=True)
    canvas = _canvas(waterfall, style)
    canvas.draw_axes(recording, f"{path}/axes", x_name="s", y_name="Hz")
    _draw_cursor(recording, f"{path}/cursor", canvas, waterfall, style)
    unit = decibel_unit(power_density_unit(channel.unit))
    name = f"{style.labels[channel.name]} PSD over time [{unit}], {low:.0f} to {high:.0f}" + reduction(times, lines)
    # Room for the name of the upright axis.
    return canvas.view(path, name, above=95.0)


def _canvas(waterfall: Waterfall, style: Style) -> Canvas:
    start_s = (waterfall.start_time_ns - style.origin_ns) / NS_PER_S
    return Canvas(
        width=WIDTH,
        height=HEIGHT,
        x_range=_reach(waterfall.time_s + start_s),
        y_range=_reach(waterfall.frequency_hz),
    )


def _reach(axis: Real) -> tuple[float, float]:
    """From half a step before the first value of an axis to half a step behind the last."""
    half = float(axis[1] - axis[0]) / 2 if axis.size > 1 else 0.5
    return float(axis[0]) - half, float(axis[-1]) + half


def _nearest(cells: int, pixels: int) -> np.ndarray:
    return np.arange(pixels) * cells // pixels


def _draw_cursor(
    recording: rr.RecordingStream, path: str, canvas: Canvas, waterfall: Waterfall, style: Style
) -> None:
    """Write a line through the slice whose spectrum is drawn, which moves with the time cursor."""
    start_s = (waterfall.start_time_ns - style.origin_ns) / NS_PER_S
    ends = np.broadcast_to(np.array(canvas.y_range), (waterfall.time_s.size, 2))
    strips = canvas.places((waterfall.time_s + start_s)[:, None], ends)
    look = rr.LineStrips2D.from_fields(colors=[CURSOR_COLOUR], radii=rr.Radius.ui_points(0.5))
    recording.log(path, look, static=True)
    index = time_index(slice_starts_ns(waterfall, style))
    send_columns(recording, path, index, rr.LineStrips2D.columns(strips=list(strips)))

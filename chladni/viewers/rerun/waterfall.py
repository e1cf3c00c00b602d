"""Spectra over time: the waterfall as an image, and the spectrum of the moment under the time cursor."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.units import power_density_unit
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, decibels_of_power
from chladni.viewers.labels import decibel_unit, reduction
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.style import Style

# Graphics cards take images of 8192 pixels a side, screens show half of that.
PIXELS = 4096
DYNAMIC_RANGE_DB = 80.0


def draw_waterfalls(recording: rr.RecordingStream, study: Study, style: Style) -> list[rrb.View]:
    """Write the waterfall of each channel as a tensor in decibels and give a view of each."""
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
    image, times = block_maximum(waterfall.values[row], axis=0, limit=PIXELS)
    image, lines = block_maximum(image, axis=1, limit=PIXELS)
    # After shortening: fewer logarithms, and the greatest power is the greatest level.
    level = decibels_of_power(image).astype(np.float32)
    low, high = _colour_limits(level)
    # A slice with missing samples has no level; the lowest colour marks it, and the findings name the gap.
    picture = np.where(np.isnan(level), low, level)
    names = (f"time {_span(waterfall.time_s)} s", f"frequency {_span(waterfall.frequency_hz)} Hz")
    recording.log(path, rr.Tensor(picture, dim_names=names, value_range=(low, high)), static=True)
    unit = decibel_unit(power_density_unit(channel.unit))
    return rrb.TensorView(
        origin=path,
        name=f"{style.labels[channel.name]} PSD over time [{unit}], {low:.0f} to {high:.0f}"
        + reduction(times, lines),
        slice_selection=rrb.TensorSliceSelection(
            width=rr.TensorDimensionSelection(dimension=0),
            # Low frequencies at the bottom, as everywhere else; images start at the top.
            height=rr.TensorDimensionSelection(dimension=1, invert=True),
        ),
        # Nearest, because a colour between two lines would be a value that nobody estimated.
        scalar_mapping=rrb.TensorScalarMapping(colormap="viridis", mag_filter="Nearest"),
        view_fit="fill",
    )


def _span(axis: Real) -> str:
    return f"{axis[0]:g}–{axis[-1]:g}" if axis.size else "none"


def _colour_limits(level: NDArray[np.float32]) -> tuple[float, float]:
    known = level[np.isfinite(level)]
    if known.size == 0:
        return -DYNAMIC_RANGE_DB, 0.0
    high = float(np.ceil(known.max()))
    return max(float(np.floor(known.min())), high - DYNAMIC_RANGE_DB), high

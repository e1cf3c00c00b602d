"""The gap over band and time, before and after on one scale of colours."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.viewers.drawing import block_maximum, decibels_of_power
from chladni.viewers.gap_band import band_told, shown_hz
from chladni.viewers.rerun.entities import folder

# Graphics cards take images of 8192 pixels a side.
PIXELS = 4096
DYNAMIC_RANGE_DB = 50.0


def draw_gap_maps(recording: rr.RecordingStream, signals: GapSignals | None) -> list[rrb.View]:
    """Write both maps as tensors in decibels and give a view of each; none without a map."""
    if signals is None or signals.gap_map.size == 0:
        return []
    # A tensor's view can't be told to begin with a part of it.
    shown = signals.map_frequency_hz <= shown_hz(signals)
    levels = {
        "before": _level(signals.gap_map[:, shown]),
        "after": _level(signals.gap_map_after[:, shown]),
    }
    known = np.concatenate([level[np.isfinite(level)] for level in levels.values()])
    # Plus nothing, since a zero with a minus would be written as one.
    high = float(np.ceil(known.max())) + 0.0 if known.size else 0.0
    names = (f"time {_span(signals.map_time_s)} s", f"frequency {_span(signals.map_frequency_hz[shown])} Hz")
    told = f" · {band}" if (band := band_told(signals)) else ""
    return [_draw(recording, what, level, high, names, told) for what, level in levels.items()]


def _level(density: Real) -> Real:
    for axis in (0, 1):
        density, _ = block_maximum(density, axis=axis, limit=PIXELS)
    return decibels_of_power(density)


def _draw(
    recording: rr.RecordingStream, what: str, level: Real, high: float, names: tuple[str, str], told: str
) -> rrb.View:
    path, low = folder("gap map", what), high - DYNAMIC_RANGE_DB
    # Tensors have no colour for what isn't known; the lowest marks it.
    picture = np.where(np.isnan(level), low, level).astype(np.float32)
    recording.log(path, rr.Tensor(picture, dim_names=names, value_range=(low, high)), static=True)
    return rrb.TensorView(
        origin=path,
        name=f"Gap {what} [dB re 1/Hz], {low:.0f} to {high:.0f}, outputs over their RMS{told}",
        slice_selection=rrb.TensorSliceSelection(
            width=rr.TensorDimensionSelection(dimension=0),
            # Low frequencies at the bottom, as everywhere else; images start at the top.
            height=rr.TensorDimensionSelection(dimension=1, invert=True),
        ),
        scalar_mapping=rrb.TensorScalarMapping(colormap="magma", mag_filter="Nearest"),
        view_fit="fill",
    )


def _span(axis: Real) -> str:
    return f"{axis[0]:.4g}–{axis[-1]:.4g}" if axis.size else "none"

"""The spectrum of the moment under the time cursor, on a real frequency axis."""

from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.arrays import Real, Whole
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum
from chladni.viewers.labels import amplitude_density_unit, reduction
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.tensors import TensorColumn
from chladni.viewers.rerun.timelines import send_columns, time_index
from chladni.viewers.style import Colour, Style

# A bar narrower than a pixel can't be seen, and charts are rarely wider; more than the 1025 lines of a usual slice.
BARS = 1280
SLICES = 1024


def draw_spectra(recording: rr.RecordingStream, study: Study, style: Style) -> list[rrb.View]:
    """Write each slice of each waterfall as a bar chart at its time and give a view for each channel.

    The bars are the square root of the density, a linear scale that starts at zero as bars must.
    """
    return [
        _draw_channel(recording, waterfall, row, style, place)
        for place, waterfall in enumerate(study.waterfalls, start=1)
        for row in range(len(waterfall.channels))
    ]


def _draw_channel(
    recording: rr.RecordingStream, waterfall: Waterfall, row: int, style: Style, place: int
) -> rrb.View:
    channel = waterfall.channels[row]
    path = channel_entity(folder("spectrum", str(place)), channel)
    slices, times = block_maximum(waterfall.values[row], axis=0, limit=SLICES)
    slices, lines = block_maximum(slices, axis=1, limit=BARS)
    # A run of lines is drawn as one bar in the middle of the run.
    abscissa = waterfall.frequency_hz[::lines] + (lines - 1) / 2 * _step(waterfall.frequency_hz)
    widths = np.full(abscissa.size, lines * _step(waterfall.frequency_hz), dtype=np.float32)
    _log_look(recording, path, abscissa, widths, style.on_dark(channel))
    bars = np.sqrt(slices)
    fits = _held_by_bars(bars)
    _log_bars(
        recording, path, slice_starts_ns(waterfall, style)[::times], bars if fits else np.full(bars.shape, np.nan)
    )
    return rrb.BarChartView(
        origin=path,
        name=f"{style.labels[channel.name]} at the time cursor [{amplitude_density_unit(channel.unit)}] over Hz"
        + reduction(times, lines)
        + ("" if fits else ", not drawn: rerun's bars hold numbers of single precision only"),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _log_look(
    recording: rr.RecordingStream, path: str, abscissa: Real, widths: NDArray[np.float32], colour: Colour
) -> None:
    """Write what all slices share, once."""
    # By components: the archetype insists on values, which differ from slice to slice.
    places = rr.components.TensorDataBatch(rr.encodings.TensorData(array=abscissa))
    look = [
        places.described(rr.BarChart.descriptor_abscissa()),
        rr.components.LengthBatch(widths).described(rr.BarChart.descriptor_widths()),
        rr.components.ColorBatch([colour]).described(rr.BarChart.descriptor_color()),
    ]
    recording.log(path, look, static=True)


def _log_bars(recording: rr.RecordingStream, path: str, starts_ns: Whole, bars: NDArray[Any]) -> None:
    """Write the bars of each slice; a slice with missing samples is an empty list, and the chart is empty then."""
    # Zeros instead would say that nothing vibrated.
    known = ~np.isnan(bars).any(axis=1)
    tensors = TensorColumn(bars[known].astype(np.float32))
    column = rr.ComponentColumn(rr.BarChart.descriptor_values(), tensors, lengths=known.astype(np.int32))
    send_columns(recording, path, time_index(starts_ns), rr.ComponentColumnList([column]))


def _held_by_bars(bars: NDArray[np.floating]) -> bool:
    single = np.finfo(np.float32)
    largest = np.fmax.reduce(bars, axis=None, initial=0.0)
    return bool(largest == 0 or single.tiny <= largest <= single.max)


def slice_starts_ns(waterfall: Waterfall, style: Style) -> Whole:
    """Times from which each slice is the nearest to the cursor; the viewer shows the latest before it."""
    hop_s = _step(waterfall.time_s)
    since_origin_ns = waterfall.start_time_ns - style.origin_ns
    starts_s = np.maximum(waterfall.time_s - hop_s / 2, 0.0)
    # The first slice is there from its first sample on, where the cursor is when a file opens.
    starts_s[:1] = 0.0
    return np.asarray(np.rint(starts_s * NS_PER_S).astype(np.int64) + since_origin_ns)


def _step(axis: Real) -> float:
    return float(axis[1] - axis[0]) if axis.size > 1 else 1.0

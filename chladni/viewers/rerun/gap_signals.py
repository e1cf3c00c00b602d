"""Measured against simulated over the log's time, before and after, and what is left."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.signals.time_series import NS_PER_S
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible
from chladni.viewers.drawing import thin
from chladni.viewers.gap_evidence import AFTER_ON_DARK, BEFORE_ON_DARK, MEASURED_ON_DARK
from chladni.viewers.labels import thinned
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.timelines import send_scalars, time_axis, time_index
from chladni.viewers.style import Colour

# The viewer holds every row in memory; above this only the extremes of stretches are written.
ROWS_OF_A_LINE, ROWS_OF_A_FILE = 1_000_000, 12_000_000
LINES_OF_AN_OUTPUT = 5


def draw_signals(
    recording: rr.RecordingStream, signals: GapSignals, telling_s: tuple[float, float] | None, *, after: str
) -> list[rrb.View]:
    """Write every output as measured, before and after; each view opens where the model errs most."""
    start_s, end_s = telling_s or signals.span_s
    lines = (
        ("measured", signals.measured, MEASURED_ON_DARK, 3.0),
        ("simulated before", signals.before, BEFORE_ON_DARK, 1.2),
        (f"simulated {after}", signals.after, AFTER_ON_DARK, 1.2),
    )
    views = []
    for row, name in enumerate(signals.output_names):
        parent, stretch = _parent("signals", row), 1
        # Numbered: the viewer draws lines in the order of their paths, and the wide one belongs behind.
        for place, (what, values, colour, width) in enumerate(lines):
            stretch = _line(recording, signals, f"{parent}/{place}", values[row], what, colour, width)
        title = f"{name} [{printed_unit(signals.output_units[row])}]{thinned(stretch)}"
        views.append(_view(parent, title, round(start_s * NS_PER_S), round(end_s * NS_PER_S)))
    return views


def draw_errors(
    recording: rr.RecordingStream, signals: GapSignals, *, after: str, what: str = "Error of"
) -> list[rrb.View]:
    """Write what is left of every output, before and after; each view, named by `what`, opens on the whole log."""
    start_ns, end_ns = (round(end * NS_PER_S) for end in signals.span_s)
    lines = (("error before", signals.before, BEFORE_ON_DARK), (f"error {after}", signals.after, AFTER_ON_DARK))
    views = []
    for row, name in enumerate(signals.output_names):
        parent, stretch = _parent("errors", row), 1
        for place, (label, simulated, colour) in enumerate(lines):
            error = signals.measured[row] - simulated[row]
            stretch = _line(recording, signals, f"{parent}/{place}", error, label, colour, 1.0)
        unit, noise = printed_unit(signals.output_units[row]), float(signals.noise_rms[row])
        views.append(_view(parent, f"{what} {name} [{unit}], noise {noise:.3g}{thinned(stretch)}", start_ns, end_ns))
    return views


def _parent(what: str, row: int) -> str:
    # By number: names come from a file, and may hold anything.
    return folder(what, str(row + 1))


def _line(
    recording: rr.RecordingStream,
    signals: GapSignals,
    path: str,
    values: Real,
    name: str,
    colour: Colour,
    width: float,
) -> int:
    """Write one line and tell how many samples each pair of its points stands for."""
    # The default averages neighbours when zoomed out, which makes a vibration look like silence.
    look = rr.SeriesLines(names=name, colors=[colour], widths=width, aggregation_policy="MinMax")
    recording.log(path, look, static=True)
    limit = min(ROWS_OF_A_LINE, ROWS_OF_A_FILE // (LINES_OF_AN_OUTPUT * len(signals.output_names)))
    chosen, stretch = thin(values, limit=limit)
    offsets_ns = np.rint(signals.seconds[chosen] * NS_PER_S).astype(np.int64)
    send_scalars(recording, path, time_index(offsets_ns), values[chosen])
    return stretch


def _view(origin: str, name: str, start_ns: int, end_ns: int) -> rrb.View:
    return rrb.TimeSeriesView(
        origin=origin,
        name=visible(name),
        axis_x=time_axis(end_ns, start_ns=start_ns),
        plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.LeftTop),
    )

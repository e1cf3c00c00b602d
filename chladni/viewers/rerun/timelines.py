"""The timelines: seconds of the log, frequency written as a duration (1 Hz as 1 ms), and the phase of a mode.

Frequency plots are written on both. A view shows only what the active timeline holds, so with the second timeline
alone they would stay empty until the reader switches to it; ``docs/decisions/0002-frequency-in-rerun.md`` tells more.
"""

import numpy as np
import rerun as rr

from chladni.signals.arrays import Real, Whole

TIME = "time"
FREQUENCY = "frequency"
# Of a motion, in degrees, a step of the timeline each: it holds one period and nothing else, so that it can loop.
PHASE = "phase"
PHASE_STEPS_PER_S = 180.0
PERIOD_S = 360 / PHASE_STEPS_PER_S
NS_PER_HZ = 1_000_000
# Measured: twice as fast as 4096 rows, no slower than more rows at once, and a thousand times faster than row by row.
ROWS_IN_A_BATCH = 16384


def time_index(offsets_ns: Whole) -> dict[str, Whole]:
    """Give the index of rows at `offsets_ns` after second 0 of the study."""
    return {TIME: offsets_ns}


def frequency_index(frequency_hz: Real) -> dict[str, Whole]:
    """Give the index of rows at frequencies: 1 Hz is 1 ms on both timelines."""
    # Whole nanoseconds: a millionth of a hertz, finer than any line spacing.
    ticks = np.rint(frequency_hz * NS_PER_HZ).astype(np.int64)
    return {FREQUENCY: ticks, TIME: ticks}


def phase_index(phase_deg: Whole) -> dict[str, Whole]:
    """Give the index of rows at phases of a motion, 0 to 360 degrees."""
    return {PHASE: phase_deg}


def motion_index(period: Whole, phase_deg: Whole) -> dict[str, Whole]:
    """Give the index of rows of a motion that is repeated from second 0 on, in the period and at the phase given."""
    ns_per_degree = PERIOD_S * 1e9 / 360
    return {TIME: np.rint((360 * period + phase_deg) * ns_per_degree).astype(np.int64)}


def log_at(recording: rr.RecordingStream, path: str, time_s: float, entity: rr.AsComponents) -> None:
    """Write an archetype at so many seconds of the study."""
    recording.set_time(TIME, duration=time_s)
    recording.log(path, entity)


def send_columns(
    recording: rr.RecordingStream,
    path: str,
    index: dict[str, Whole],
    columns: rr.ComponentColumnList,
) -> None:
    """Write rows of any archetype at once."""
    recording.send_columns(path, _time_columns(index, slice(None)), columns)


def send_scalars(recording: rr.RecordingStream, path: str, index: dict[str, Whole], values: Real) -> None:
    """Write rows of scalars, ``[row]`` or ``[row, line]``, in batches."""
    for start in range(0, values.shape[0], ROWS_IN_A_BATCH):
        rows = slice(start, start + ROWS_IN_A_BATCH)
        recording.send_columns(path, _time_columns(index, rows), rr.Scalars.columns(scalars=values[rows]))


def time_axis(end_ns: int, *, start_ns: int = 0) -> rr.blueprint.TimeAxis:
    """Give an axis that shows a stretch of the active timeline at first."""
    boundary = rr.TimeRangeBoundary.absolute
    return rr.blueprint.TimeAxis(
        view_range=rr.TimeRange(
            # A range without width would leave the viewer to guess one.
            start=boundary(seconds=start_ns / 1e9),
            end=boundary(seconds=max(end_ns, start_ns + 1) / 1e9),
        )
    )


def frequency_axis(low_hz: float, high_hz: float) -> rr.blueprint.TimeAxis:
    """Give an axis that shows a band at first."""
    return time_axis(round(high_hz * NS_PER_HZ), start_ns=round(low_hz * NS_PER_HZ))


def _time_columns(index: dict[str, Whole], rows: slice) -> list[rr.TimeColumn]:
    return [_time_column(name, places[rows]) for name, places in index.items()]


def _time_column(name: str, places: Whole) -> rr.TimeColumn:
    if name == PHASE:
        return rr.TimeColumn(name, sequence=places)
    # As timedelta64, which is taken as it is; numbers would go through floating point seconds.
    return rr.TimeColumn(name, duration=places.astype("timedelta64[ns]"))

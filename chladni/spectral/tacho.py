"""Pulses of a tacho: how far a shaft has turned at each rising edge, missing pulses counted."""

import numpy as np

from chladni.signals.arrays import Index, Real
from chladni.signals.errors import EstimateError
from chladni.signals.rotation import Rotation
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted
from chladni.spectral.filters import measured_samples

# A pulse counts when it passes the middle of its swing by a quarter of it, so that noise on an edge isn't two pulses.
HYSTERESIS = 0.25


def rotation_of_pulses(series: TimeSeries, pulses_a_revolution: float, threshold: float | None) -> Rotation:
    """Give the rotation at each pulse of the only channel; see `chladni.spectral.rotation.rotation`."""
    if not 0 < pulses_a_revolution < np.inf:
        raise EstimateError(f"{pulses_a_revolution:g} pulses a revolution; give a number above 0")
    name = series.channels[0].name
    values = np.where(measured_samples(series)[0], series.values[0].astype(np.float64), np.nan)
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    if not low < high:
        raise EstimateError(f"{name} never changes, so it tells no rotation; name the channel of the pulses")
    level = (low + high) / 2 if threshold is None else threshold
    edges = _rising_edges(values, level, HYSTERESIS * min(high - level, level - low))
    if edges.size < 4:
        raise EstimateError(
            f"{name}: {counted(edges.size, 'pulse')} through {level:g}; four are needed: give the threshold that "
            f"they pass, between {low:.4g} and {high:.4g}, or read more"
        )
    before, after = values[edges - 1], values[edges]
    when_s = (edges - 1 + (level - before) / (after - before)) / series.sample_rate_hz
    counts, lost = _counted(np.diff(when_s))
    notes = []
    if counts.sum() - counts.size > counts.size:
        raise EstimateError(
            f"{name}: more pulses seem to be missing than the {edges.size} that are there; name a channel of pulses, "
            "or give the threshold that they pass"
        )
    if lost.size:
        first_s = float(when_s[lost[0]])
        notes.append(
            f"{name}: missing {counted(lost.size, 'pulse')}, first at {first_s:.3f} s; counted by the interval beside"
        )
    return Rotation(
        time_s=when_s,
        revolutions=np.concatenate([[0.0], np.cumsum(counts)]) / pulses_a_revolution,
        start_time_ns=series.start_time_ns,
        source="tacho",
        notes=tuple(notes),
    )


def _rising_edges(values: Real, level: float, margin: float) -> Index:
    """Samples right after each rise through `level`, each with a fall well below it before and a rise well above."""
    # 1 well above, -1 well below; between them what was last holds on.
    state = np.where(values > level + margin, 1, np.where(values < level - margin, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(state.size), 0))
    held = state[last]
    rises = np.flatnonzero((held[1:] == 1) & (held[:-1] == -1)) + 1
    # The level itself was passed between the last sample at or below it and the next.
    below = np.maximum.accumulate(np.where(values <= level, np.arange(values.size), 0))
    edges = below[rises] + 1
    known: Index = edges[np.isfinite(values[edges]) & np.isfinite(values[edges - 1])]
    return known


def _counted(intervals_s: Real) -> tuple[Real, Index]:
    """Pulses that intervals stand for, as many as the lesser interval beside fits in, and where that isn't one."""
    beside = np.minimum(np.append(intervals_s[1:], np.inf), np.append(np.inf, intervals_s[:-1]))
    counts = np.maximum(np.rint(intervals_s / beside), 1.0)
    return counts, np.flatnonzero(counts > 1)

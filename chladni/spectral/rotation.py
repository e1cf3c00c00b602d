"""The angle of a shaft, from pulses, an angle, a speed, or the ridge of an order in a spectrum over time."""

from dataclasses import replace

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Index, Real
from chladni.signals.errors import EstimateError
from chladni.signals.rotation import Rotation, RotationSource
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted
from chladni.spectral.filters import measured_samples
from chladni.spectral.waterfall import waterfall

RAD_PER_REVOLUTION = 2 * np.pi
# A pulse counts when it passes the middle of its swing by a quarter of it, so that noise on an edge isn't two pulses.
HYSTERESIS = 0.25


def rotation(
    source: SeriesLike,
    *,
    tacho: str | None = None,
    phase: str | None = None,
    speed: str | None = None,
    ridge: str | None = None,
    pulses_a_revolution: float = 1.0,
    threshold: float | None = None,
    ridge_order: float = 1.0,
    ridge_hz: tuple[float, float] | None = None,
    resolution_hz: float | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Rotation:
    """Tell how far a shaft has turned, from exactly one of four channels.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        holds the channel.
    tacho
        A channel of pulses; each rising edge is ``1 / pulses_a_revolution`` of a turn.
    phase
        A channel of the shaft's angle, in rad, wrapped or not.
    speed
        A channel of its angular velocity, in rad/s, or of its frequency of rotation, in Hz.
    ridge
        A vibration in which an order stands out; `ridge_order` says which, `ridge_hz` between which frequencies it
        runs.
    pulses_a_revolution
        Above 0.
    threshold
        Level that a pulse passes; by default midway between the least and the greatest sample.
    resolution_hz
        Lines of the spectrum over time in which the ridge is followed, see `waterfall`.
    sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    Rotation
        At each pulse, or at each sample.

    Raises
    ------
    EstimateError
        When not exactly one channel is named, its unit is no such thing, or there are fewer than four pulses.

    Notes
    -----
    A ridge is the path of most power, as the sum of its logarithms, that moves one line a slice at most (dynamic
    programming); a segment that shows a line at all sees it sweep no faster. The phase of the order, demodulated
    along that path, then gives the angle (Randall 2011, Vibration-based Condition Monitoring, section 3.6).

    Examples
    --------
    >>> t = np.arange(2000) / 1000
    >>> pulses = {"tacho": (np.mod(10 * t, 1) > 0.5) * 5.0}  # ten revolutions a second
    >>> turned = rotation(pulses, tacho="tacho", sample_rate_hz=1000.0)
    >>> float(turned.revolutions[-1]), float(turned.time_s[-1].round(2))
    (19.0, 1.95)
    """
    named: dict[RotationSource, str | None] = {"tacho": tacho, "phase": phase, "speed": speed, "ridge": ridge}
    given = [(telling, name) for telling, name in named.items() if name is not None]
    if len(given) != 1:
        raise EstimateError("name exactly one channel that tells the rotation: tacho, phase, speed or ridge")
    telling, name = given[0]
    alone = series_of(source, channels=name, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    if telling == "tacho":
        return _from_pulses(alone, pulses_a_revolution, threshold)
    if telling == "ridge":
        return _from_ridge(alone, ridge_order, ridge_hz, resolution_hz)
    return _growing(alone, _from_phase(alone) if telling == "phase" else _from_speed(alone), telling)


def _from_pulses(series: TimeSeries, pulses_a_revolution: float, threshold: float | None) -> Rotation:
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


def _from_phase(series: TimeSeries) -> Real:
    channel = series.channels[0]
    if channel.unit != "rad":
        raise EstimateError(
            f"{channel.name} is in {channel.unit}; an angle must be in rad: give its unit, such as deg or rev"
        )
    known = measured_samples(series)[0]
    turned = np.full(series.samples, np.nan)
    turned[known] = np.unwrap(series.values[0, known].astype(np.float64)) / RAD_PER_REVOLUTION
    return turned


def _from_speed(series: TimeSeries) -> Real:
    channel = series.channels[0]
    factor = {"rad/s": 1 / RAD_PER_REVOLUTION, "Hz": 1.0}.get(channel.unit)
    if factor is None:
        raise EstimateError(
            f"{channel.name} is in {channel.unit}; a speed must be in rad/s or Hz: give its unit, such as rpm"
        )
    known = measured_samples(series)[0]
    speed_hz = np.where(known, series.values[0].astype(np.float64) * factor, 0.0)
    # Trapezoids: a speed is smooth between its samples.
    steps = (speed_hz[1:] + speed_hz[:-1]) / 2 / series.sample_rate_hz
    return np.where(known, np.concatenate([[0.0], np.cumsum(steps)]), np.nan)


def _growing(series: TimeSeries, turned: Real, source: RotationSource) -> Rotation:
    known = turned[np.isfinite(turned)]
    if known.size < 2:
        raise EstimateError(f"{series.channels[0].name}: nothing was measured that tells the rotation")
    # Which way a shaft turns is no matter of its orders.
    return Rotation(
        time_s=series.times_s(),
        revolutions=turned if known[-1] >= known[0] else -turned,
        start_time_ns=series.start_time_ns,
        source=source,
    )


def _from_ridge(
    series: TimeSeries, order: float, band_hz: tuple[float, float] | None, resolution_hz: float | None
) -> Rotation:
    from scipy.signal import butter, sosfiltfilt

    if not 0 < order < np.inf:
        raise EstimateError(f"the ridge is of order {order:g}; give one above 0")
    if not series.all_valid() or not np.isfinite(series.values).all():
        raise EstimateError(f"{series.channels[0].name}: a ridge can't be followed over gaps; choose a part without")
    spectra = waterfall(series, resolution_hz=resolution_hz, overlap=0.75, max_slices=1 << 20)
    nyquist_hz = series.sample_rate_hz / 2
    low_hz, high_hz = (0.0, nyquist_hz) if band_hz is None else band_hz
    lines = np.flatnonzero((spectra.frequency_hz >= low_hz) & (spectra.frequency_hz <= high_hz))
    # The line at 0 Hz holds no order.
    lines = lines[lines > 0]
    if lines.size < 2:
        raise EstimateError(f"no line lies between {low_hz:g} and {high_hz:g} Hz; give LOW < HIGH of the ridge")
    if not spectra.values[0][:, lines].any():
        raise EstimateError(f"{series.channels[0].name} doesn't move between {low_hz:g} and {high_hz:g} Hz")
    path = lines[_strongest_path(np.log(np.maximum(spectra.values[0][:, lines], np.finfo(np.float32).tiny)))]
    times_s = series.times_s()
    ridge_hz = np.interp(times_s, spectra.time_s, spectra.frequency_hz[path])
    turned = np.concatenate([[0.0], np.cumsum((ridge_hz[1:] + ridge_hz[:-1]) / 2)]) / series.sample_rate_hz
    # Demodulated along the ridge, what is left of the phase is slow.
    line_hz = float(spectra.frequency_hz[1])
    rotating = series.values[0] * np.exp(-2j * np.pi * turned)
    sections = butter(2, min(2 * line_hz, 0.9 * nyquist_hz), output="sos", fs=series.sample_rate_hz)
    slow = sosfiltfilt(sections, rotating.real) + 1j * sosfiltfilt(sections, rotating.imag)
    turned += np.unwrap(np.angle(slow)) / RAD_PER_REVOLUTION
    found = _growing(series, turned / order, "ridge")
    note = "the angle is that of an order's own phase: where that order passes a resonance, phases turn with it"
    return replace(found, notes=(note,))


def _strongest_path(score: Real) -> Index:
    """Line of each slice on the path of the greatest sum that moves one line a slice at most (Bellman 1957)."""
    slices, lines = score.shape
    best, came = score[0], np.empty((slices, lines), dtype=np.intp)
    for number in range(1, slices):
        padded = np.pad(best, 1, constant_values=-np.inf)
        options = np.stack([padded[:-2], padded[1:-1], padded[2:]])
        step = options.argmax(axis=0)
        came[number] = np.arange(lines) + step - 1
        best = score[number] + options.max(axis=0)
    path = np.empty(slices, dtype=np.intp)
    path[-1] = int(best.argmax())
    for number in range(slices - 1, 0, -1):
        path[number - 1] = came[number, path[number]]
    return path

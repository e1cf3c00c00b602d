"""The angle of a shaft, from pulses, an angle, a speed, or the ridge of an order in a spectrum over time."""

from dataclasses import replace

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Index, Real
from chladni.signals.errors import EstimateError
from chladni.signals.rotation import Rotation, RotationSource
from chladni.signals.time_series import TimeSeries
from chladni.spectral.filters import measured_samples
from chladni.spectral.tacho import rotation_of_pulses
from chladni.spectral.waterfall import waterfall

RAD_PER_REVOLUTION = 2 * np.pi


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
        return rotation_of_pulses(alone, pulses_a_revolution, threshold)
    if telling == "ridge":
        return _from_ridge(alone, ridge_order, ridge_hz, resolution_hz)
    return _growing(alone, _from_phase(alone) if telling == "phase" else _from_speed(alone), telling)


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

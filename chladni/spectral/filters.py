"""Butterworth and Bessel filters, causal or without phase shift, with their transients told."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import ceil, log
from typing import Literal

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError
from chladni.signals.filtered_series import FilteredSeries
from chladni.signals.number_range import require_in_range
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted

Design = Literal["butterworth", "bessel"]
Kind = Literal["lowpass", "highpass", "bandpass", "bandstop"]

# A transient is over when all that was before may change a sample by no more than this share of its own size.
SETTLED = 0.01


def lowpass(
    source: SeriesLike,
    *,
    high_hz: float,
    order: int = 4,
    design: Design = "butterworth",
    causal: bool = False,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Let frequencies up to `high_hz` pass; see `bandpass`.

    Examples
    --------
    >>> t = np.arange(4000) / 1000
    >>> y = lowpass(np.sin(2 * np.pi * 5 * t) + np.sin(2 * np.pi * 200 * t), high_hz=30.0, sample_rate_hz=1000.0)
    >>> bool(np.allclose(y.series.values[0, 500:-500], np.sin(2 * np.pi * 5 * t)[500:-500], atol=1e-3))
    True
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    return _filtered(series, "lowpass", (high_hz,), order=order, design=design, causal=causal)


def highpass(
    source: SeriesLike,
    *,
    low_hz: float,
    order: int = 4,
    design: Design = "butterworth",
    causal: bool = False,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Let frequencies from `low_hz` upwards pass, without the mean; see `bandpass`."""
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    return _filtered(series, "highpass", (low_hz,), order=order, design=design, causal=causal)


def bandpass(
    source: SeriesLike,
    *,
    band_hz: tuple[float, float],
    order: int = 4,
    design: Design = "butterworth",
    causal: bool = False,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Let a band pass.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        samples, of any unit.
    band_hz
        Corners, between 0 and half the sample rate.
    order
        Poles at each corner, 1 to 20: 20 dB a decade each.
    design
        ``butterworth``, flat in the band; ``bessel``, whose delay is the same for all frequencies, so that a pulse
        keeps its shape. Both lie 3 dB down at the corners.
    causal
        False filters forwards and backwards: no phase shift, but 6 dB down at the corners, twice the slope, and
        what comes announces itself. True filters forwards, as an analogue filter would, with its delay.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    FilteredSeries
        Each unbroken run is filtered by itself; nothing is carried over invalid samples. A causal filter begins as if
        the run's first value had stood for ever; without phase shift a run is mirrored oddly at its ends. How long
        what isn't known there matters, is in ``edges_s``.

    Raises
    ------
    EstimateError
        When a corner isn't between 0 and half the sample rate, or no run is longer than the transients.

    Notes
    -----
    Designs, sections of second order and filtering are those of `scipy.signal`: ``butter`` and ``bessel`` (bilinear
    transform; ``norm="mag"``), ``sosfilt`` and ``sosfiltfilt`` (Oppenheim & Schafer, Discrete-Time Signal
    Processing, 3rd ed., sections 7.2 and 5.9). With the impulse response h a transient lasts until the sum of abs(h)
    over what is left is 1 % of the whole: the most that samples before the run, no larger than those in it, can
    matter.
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    return _filtered(series, "bandpass", band_hz, order=order, design=design, causal=causal)


def bandstop(
    source: SeriesLike,
    *,
    band_hz: tuple[float, float],
    order: int = 4,
    design: Design = "butterworth",
    causal: bool = False,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Stop a band, such as 49 to 51 Hz, and let the rest pass; see `bandpass`."""
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    return _filtered(series, "bandstop", band_hz, order=order, design=design, causal=causal)


def channel_runs(valid: Mask) -> Iterator[tuple[int, int]]:
    """Give first and last + 1 of each unbroken run of one channel's valid samples."""
    edges = np.flatnonzero(np.diff(valid, prepend=False, append=False))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)


def measured_samples(series: TimeSeries) -> Mask:
    """``[channel, sample]``: what was measured, valid and finite."""
    finite: Mask = np.isfinite(series.values)
    return finite if series.valid is None else finite & series.valid


def require_measured(series: TimeSeries) -> Mask:
    """Give what was measured, see `measured_samples`, of channels that estimators can work with.

    Raises
    ------
    EstimateError
        When nothing was measured of a channel, or its values are too large or too small to be squared.
    """
    measured = measured_samples(series)
    if empty := [channel.name for channel, row in zip(series.channels, measured, strict=True) if not row.any()]:
        raise EstimateError(f"{', '.join(empty)}: nothing was measured; leave it out")
    largest = np.max(np.abs(series.values), axis=1, initial=0.0, where=measured)
    require_in_range(series.channels, np.asarray(largest, dtype=np.float64))
    return measured


def filter_runs(
    series: TimeSeries,
    run: Callable[[Real], Real],
    *,
    edges_s: tuple[float, float],
    band_hz: tuple[float, float],
    channels: tuple[Channel, ...],
    notes: tuple[str, ...],
) -> FilteredSeries:
    """Apply `run` to every unbroken run of measured samples that is longer than its two edges; NaN elsewhere.

    Raises
    ------
    EstimateError
        When no run is that long.
    """
    needed_s = sum(edges_s)
    shortest = ceil(needed_s * series.sample_rate_hz)
    values = np.full(series.values.shape, np.nan)
    measured = measured_samples(series)
    for row in range(len(series.channels)):
        # Each channel by itself: a gap in one sensor is no reason to cut another one's record.
        for first, last in channel_runs(measured[row]):
            if last - first >= shortest:
                values[row, first:last] = run(series.values[row, first:last].astype(np.float64))
    valid = np.isfinite(values)
    if not valid.any():
        raise EstimateError(
            f"no unbroken run lasts {needed_s:.3g} s, which this band needs; widen the band or take a longer log"
        )
    lost = int(measured.sum()) - int(valid.sum())
    if lost:
        notes += (
            f"{counted(lost, 'sample')} in runs shorter than {needed_s:.3g} s left out: too short for the band",
        )
    # A limit of the sensor is none of what was computed.
    channels = tuple(replace(channel, overload=None) for channel in channels)
    result = replace(series, values=values, channels=channels, valid=None if valid.all() else valid)
    return FilteredSeries(series=result, band_hz=band_hz, edges_s=edges_s, notes=notes)


def _filtered(
    series: TimeSeries, kind: Kind, corners_hz: tuple[float, ...], *, order: int, design: Design, causal: bool
) -> FilteredSeries:
    from scipy.signal import sosfilt, sosfilt_zi, sosfiltfilt

    sections, slowest = _designed(kind, corners_hz, order=order, design=design, rate_hz=series.sample_rate_hz)
    settling = _settling_samples(sections, slowest, causal=causal, at_most=series.samples)
    state = sosfilt_zi(sections)

    def forwards(x: Real) -> Real:
        return np.asarray(sosfilt(sections, x, zi=state * x[0])[0], dtype=np.float64)

    def both_ways(x: Real) -> Real:
        return np.asarray(sosfiltfilt(sections, x, padlen=min(settling, x.size - 1)), dtype=np.float64)

    settling_s = settling / series.sample_rate_hz
    corners = " to ".join(f"{corner:g}" for corner in corners_hz)
    how = "causal, 3 dB down at its corners" if causal else "without phase shift, 6 dB down at its corners"
    where = "first" if causal else "first and last"
    note = (
        f"{kind} {corners} Hz, {design} of order {order}, {how}; the {where} {settling_s:.3g} s of each run "
        "depend on what is outside it"
    )
    return filter_runs(
        series,
        forwards if causal else both_ways,
        edges_s=(settling_s, 0.0 if causal else settling_s),
        band_hz=_band(kind, corners_hz, series.sample_rate_hz / 2),
        channels=series.channels,
        notes=(note,),
    )


def _band(kind: Kind, corners_hz: tuple[float, ...], nyquist_hz: float) -> tuple[float, float]:
    low_hz = corners_hz[0] if kind in ("highpass", "bandpass") else 0.0
    return low_hz, corners_hz[-1] if kind in ("lowpass", "bandpass") else nyquist_hz


def _designed(
    kind: Kind, corners_hz: tuple[float, ...], *, order: int, design: Design, rate_hz: float
) -> tuple[Real, float]:
    """Sections of second order, and the magnitude of the pole that decays slowest."""
    from scipy.signal import bessel, butter

    edges = np.array([0.0, *corners_hz, rate_hz / 2])
    if not np.all(np.diff(edges) > 0):
        named = " and ".join(f"{corner:g}" for corner in corners_hz)
        raise EstimateError(
            f"corners of {named} Hz: they must rise and lie between 0 and half the sample rate, {rate_hz / 2:g} Hz"
        )
    if not 1 <= order <= 20:
        raise EstimateError(f"order is {order}; it must lie between 1 and 20")
    corner = corners_hz[0] if len(corners_hz) == 1 else list(corners_hz)
    if design == "butterworth":
        sections = butter(order, corner, btype=kind, output="sos", fs=rate_hz)
    elif design == "bessel":
        sections = bessel(order, corner, btype=kind, output="sos", norm="mag", fs=rate_hz)
    else:
        raise EstimateError(f"design {design!r} is none of butterworth, bessel")
    slowest = max(float(np.abs(np.roots(section[3:])).max()) for section in sections)
    return np.asarray(sections, dtype=np.float64), slowest


def _settling_samples(sections: Real, slowest: float, *, causal: bool, at_most: int) -> int:
    """How many samples from an end of a run on the transient matters; more than `at_most` where it's that long."""
    from scipy.signal import sosfilt

    # By then even poles of a high order have decayed; what isn't over in twice the record is too long for it.
    samples = min(max(2 * at_most, 1), 64 + ceil(3 * log(SETTLED**2) / log(min(slowest, 1 - 1e-12))))
    impulse = np.zeros(samples)
    impulse[0] = 1.0
    response = np.asarray(sosfilt(sections, impulse))
    if not causal:
        response = np.asarray(sosfilt(sections, response[::-1]))[::-1]
    left = np.cumsum(np.abs(response)[::-1])[::-1]
    return int(np.count_nonzero(left > SETTLED * left[0]))

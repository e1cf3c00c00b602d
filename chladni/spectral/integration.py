"""Acceleration to velocity to displacement, and back, in time and in frequency."""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.filtered_series import FilteredSeries
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import differentiated, integrated
from chladni.spectral.filters import filter_runs

# How long the band limit rings: that many periods of low_hz (or of the room up to Nyquist) from an end of a run, its
# influence has fallen under 1.5 %; the tests confirm it.
EDGE_PERIODS = 3.0

Gain = Callable[[Real], NDArray[np.complexfloating]]


def integrate(
    source: SeriesLike,
    *,
    low_hz: float,
    times: int = 1,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Integrate motions over time: acceleration to velocity, twice to displacement.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        motions, such as m/s^2.
    low_hz
        Lowest frequency that passes unchanged, above 0: the slow drift of a sensor would otherwise outgrow the motion
        as 1/omega. Between ``low_hz / 2`` and `low_hz` the gain falls to zero along a raised cosine.
    times
        How often to integrate, at least 1.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    FilteredSeries
        Without phase shift. Each unbroken run is freed of its straight-line trend and integrated by itself; nothing
        is carried over invalid samples.

    Raises
    ------
    EstimateError
        When `low_hz` isn't between 0 and half the sample rate, or no run lasts ``6 / low_hz``.
    SetupError
        When a unit has no integral, such as N.

    Notes
    -----
    Division of the run's spectrum by (j omega)^times, exact below the Nyquist frequency, where a running sum is wrong
    by (omega dt)^2 / 12. What lies beyond the ends is unknown: of a tone of frequency f, integrated n times, the ends
    leave a drift near `low_hz`, at ``edges_s`` up to 1.5 % of the tone's result times (f / low_hz)^(n - 1).
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    _require_times(times)
    nyquist_hz = series.sample_rate_hz / 2
    if not 0 < low_hz < nyquist_hz:
        raise EstimateError(
            f"low_hz is {low_hz} Hz; it must lie between 0 and half the sample rate, {nyquist_hz:g} Hz"
        )
    edge_s = EDGE_PERIODS / low_hz

    def gain(frequency_hz: Real) -> NDArray[np.complexfloating]:
        passed = _raised_cosine((frequency_hz - low_hz / 2) / (low_hz / 2))
        return passed / (2j * np.pi * np.where(frequency_hz == 0, 1.0, frequency_hz)) ** times

    # Mirrored evenly: an odd mirror image would shift the mean by twice the end's value, which integration turns
    # into a drift.
    def run(x: Real) -> Real:
        return _filtered(_detrended(x), series, edge_s, gain, "even")

    note = (
        f"integrated {times}x above {low_hz:g} Hz (nothing passes below {low_hz / 2:g} Hz); the first and last "
        f"{edge_s:g} s of each run depend on what is outside it"
    )
    return _converted(series, run, times=-times, band_hz=(low_hz, nyquist_hz), edge_s=edge_s, notes=(note,))


def differentiate(
    source: SeriesLike,
    *,
    high_hz: float | None = None,
    times: int = 1,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> FilteredSeries:
    """Differentiate motions over time: displacement to velocity, twice to acceleration.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        motions, such as m.
    high_hz
        Highest frequency that passes unchanged, default 80 % of half the sample rate: noise grows as omega. Above it
        the gain falls to zero at half the sample rate along a raised cosine.
    times
        How often to differentiate, at least 1.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    FilteredSeries
        Without phase shift; nothing is carried over invalid samples.

    Raises
    ------
    EstimateError
        When `high_hz` isn't between 0 and half the sample rate, or every run is too short.
    SetupError
        When a unit has no derivative, such as N.
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    _require_times(times)
    nyquist_hz = series.sample_rate_hz / 2
    high_hz = 0.8 * nyquist_hz if high_hz is None else high_hz
    if not 0 < high_hz < nyquist_hz:
        raise EstimateError(f"high_hz is {high_hz} Hz; it must lie between 0 and half the rate, {nyquist_hz:g} Hz")
    edge_s = EDGE_PERIODS / (nyquist_hz - high_hz)

    def gain(frequency_hz: Real) -> NDArray[np.complexfloating]:
        passed = _raised_cosine((nyquist_hz - frequency_hz) / (nyquist_hz - high_hz))
        return passed * (2j * np.pi * frequency_hz) ** times

    # Mirrored oddly: the slope goes on across the end, and the slope is what is wanted.
    def run(x: Real) -> Real:
        return _filtered(x, series, edge_s, gain, "odd")

    note = f"differentiated {times}x below {high_hz:g} Hz; each run's first and last {edge_s:.3g} s are uncertain"
    return _converted(series, run, times=times, band_hz=(0.0, high_hz), edge_s=edge_s, notes=(note,))


def integrate_density(density: PowerSpectralDensity, *, low_hz: float = 0.0, times: int = 1) -> PowerSpectralDensity:
    """Give the spectral density of the integral: G / omega^(2 times) from `low_hz` upwards.

    The line at 0 Hz and those below `low_hz` are left out, since leakage of a sensor's drift would be raised there
    without bound; a note names the limit. `EstimateError` when no line remains, `SetupError` when a unit has no
    integral.
    """
    _require_times(times)
    return _scaled_density(density, low_hz=low_hz, times=-times)


def differentiate_density(density: PowerSpectralDensity, *, times: int = 1) -> PowerSpectralDensity:
    """Give the spectral density of the derivative: G omega^(2 times); `SetupError` when a unit has none."""
    _require_times(times)
    return _scaled_density(density, low_hz=0.0, times=times)


def _scaled_density(density: PowerSpectralDensity, *, low_hz: float, times: int) -> PowerSpectralDensity:
    frequency_hz = density.frequency_hz
    # Left out rather than set to zero or NaN: a level summed over the rest is then right by itself.
    kept = (frequency_hz >= low_hz) & ((frequency_hz > 0) | (times > 0))
    if not kept.any():
        raise EstimateError(f"low_hz is {low_hz} Hz, above the last line at {frequency_hz[-1]:g} Hz; lower it")
    factor = (2 * np.pi * frequency_hz[kept]) ** (2 * times)
    channels = tuple(replace(c, unit=_unit(c.unit, times), overload=None) for c in density.channels)
    note = f"spectral density integrated {-times}x; it begins at {frequency_hz[kept][0]:g} Hz"
    return replace(
        density,
        frequency_hz=frequency_hz[kept],
        values=density.values[:, kept] * factor,
        std=density.std[:, kept] * factor,
        channels=channels,
        provenance=density.provenance.with_notes(note) if times < 0 else density.provenance,
    )


def _converted(
    series: TimeSeries,
    run: Callable[[Real], Real],
    *,
    times: int,
    band_hz: tuple[float, float],
    edge_s: float,
    notes: tuple[str, ...],
) -> FilteredSeries:
    channels = tuple(replace(c, unit=_unit(c.unit, times)) for c in series.channels)
    return filter_runs(series, run, edges_s=(edge_s, edge_s), band_hz=band_hz, channels=channels, notes=notes)


def _detrended(x: Real) -> Real:
    # With the time counted from the middle, slope and mean are independent.
    at = np.linspace(-1.0, 1.0, x.size)
    slope = (at @ x) / (at @ at)
    line: Real = x - x.mean() - slope * at
    return line


def _filtered(x: Real, series: TimeSeries, edge_s: float, gain: Gain, reflection: Literal["even", "odd"]) -> Real:
    """Multiply the spectrum of a run by `gain`, the run mirrored at its ends so that it doesn't begin with a step."""
    # A record can't be mirrored further than it's long.
    margin = min(x.size - 1, int(np.ceil(edge_s * series.sample_rate_hz)))
    padded = np.pad(x, margin, mode="reflect", reflect_type=reflection)
    # The mirrored part fades out, else the circular transform would join two strangers.
    fade = _raised_cosine(np.arange(margin) / margin)
    padded[:margin] *= fade
    padded[padded.size - margin :] *= fade[::-1]
    length = scipy.fft.next_fast_len(padded.size, real=True)
    spectrum = scipy.fft.rfft(padded, length) * gain(scipy.fft.rfftfreq(length, 1 / series.sample_rate_hz))
    filtered: Real = scipy.fft.irfft(spectrum, length)[margin : margin + x.size]
    return filtered


def _raised_cosine(position: Real) -> Real:
    """0 below 0, 1 above 1, smooth between."""
    rising: Real = (1 - np.cos(np.pi * np.clip(position, 0.0, 1.0))) / 2
    return rising


def _unit(unit: str, times: int) -> str:
    for _ in range(abs(times)):
        unit = differentiated(unit) if times > 0 else integrated(unit)
    return unit


def _require_times(times: int) -> None:
    if times < 1:
        raise EstimateError(f"times is {times}; integrate or differentiate at least once")

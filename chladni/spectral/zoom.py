"""Zoom: amplitudes on lines as fine as one likes within a band, by the chirp z-transform."""

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum, Quantity
from chladni.spectral.filters import channel_runs, require_measured
from chladni.spectral.windows import Window, noise_bandwidth_bins, window_name, window_samples

MOST_LINES = 1_000_000


def zoom_spectrum(
    source: SeriesLike,
    *,
    band_hz: tuple[float, float],
    lines: int = 2000,
    window: Window = "hann",
    quantity: Quantity = "peak",
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> AmplitudeSpectrum:
    """Give the amplitudes of the whole record on fine lines within a band.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        of all channels; the longest run that all of them have is transformed at once, without means.
    band_hz
        First and last line, between 0 and half the sample rate.
    lines
        How many, at least 2. More of them read a peak's place and height finer; what lies closer together than
        1/length of the record they don't part.
    window
        As in `scipy.signal.get_window`.
    quantity
        ``peak`` or ``rms`` of a sine.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    AmplitudeSpectrum
        A single average: right for tones, whose uncertainty it doesn't tell (`std` is infinite).

    Raises
    ------
    EstimateError
        When the band isn't one, the lines are too many or too few, or nothing was measured.

    Notes
    -----
    `scipy.signal.zoom_fft` (chirp z-transform; Rabiner, Schafer & Rader 1969, Bell System Technical Journal 48(5)).

    Examples
    --------
    >>> tone = 2.0 * np.sin(2 * np.pi * 50.123 * np.arange(10_000) / 1000)
    >>> found = zoom_spectrum(tone, band_hz=(49.0, 51.0), lines=2001, sample_rate_hz=1000.0)
    >>> highest = found.values[0].argmax()
    >>> round(float(found.frequency_hz[highest]), 3), round(float(found.values[0, highest]), 3)
    (50.123, 2.0)
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    from scipy.signal import zoom_fft

    low_hz, high_hz = band_hz
    if not 0 <= low_hz < high_hz <= series.sample_rate_hz / 2:
        raise EstimateError(
            f"a band from {low_hz:g} to {high_hz:g} Hz isn't one within 0 to {series.sample_rate_hz / 2:g} Hz"
        )
    if not 2 <= lines <= MOST_LINES:
        raise EstimateError(f"{lines} lines; give 2 to {MOST_LINES}")
    runs = list(channel_runs(np.logical_and.reduce(require_measured(series), axis=0)))
    if not runs:
        raise EstimateError("no sample was measured in all channels at once")
    first, last = max(runs, key=lambda run: run[1] - run[0])
    values = series.values[:, first:last].astype(np.float64)
    shape = window_samples(window, last - first)
    if not shape.sum() > 0:
        raise EstimateError(f"{last - first} samples without a gap are too few for a spectrum; read more")
    weighted = (values - values.mean(axis=1, keepdims=True)) * shape
    spectrum = zoom_fft(weighted, [low_hz, high_hz], lines, fs=series.sample_rate_hz, endpoint=True)
    gain = 2 / shape.sum() / (1 if quantity == "peak" else np.sqrt(2))
    amplitude = gain * np.abs(spectrum)
    segment_s = (last - first) / series.sample_rate_hz
    return AmplitudeSpectrum(
        frequency_hz=np.linspace(low_hz, high_hz, lines),
        values=amplitude,
        std=np.full(amplitude.shape, np.inf),
        quantity=quantity,
        channels=series.channels,
        provenance=Provenance(
            estimator=f"zoom spectrum, {quantity}",
            window=window_name(window),
            segment_s=segment_s,
            averages=1,
            effective_averages=1.0,
            notes=(f"tones closer than {noise_bandwidth_bins(shape) / segment_s:.3g} Hz run together",),
        ),
    )

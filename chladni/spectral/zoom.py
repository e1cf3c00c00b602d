"""Zoom: amplitudes on lines as fine as one likes within a band, by the chirp z-transform."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import numpy as np

from chladni.io.source import Blocks, SeriesLike, blocks_of, log_or_series
from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum, Quantity
from chladni.spectral.blocks import leading_part
from chladni.spectral.filters import channel_runs, measured_samples
from chladni.spectral.windows import Window, noise_bandwidth_bins, window_name, window_samples

MOST_LINES = 1_000_000
# Of a record that fits in memory a part this long is one transform; longer ones are summed.
SAMPLES_AT_ONCE, VALUES_AT_ONCE = 1 << 20, 1 << 22
# Straight lines between so many samples of a window miss a Hann window by less than 1e-12.
LONGEST_WINDOW = 1 << 22


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
        A log (read block by block when it's large), the path to one, a series, or an array ``[channel, sample]``:
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
    opened = log_or_series(source, sample_rate_hz=sample_rate_hz)
    part: dict[str, Any] = {"channels": channels, "start_s": start_s, "end_s": end_s}
    return zoom_of_blocks(
        lambda: blocks_of(opened, **part), band_hz=band_hz, lines=lines, window=window, quantity=quantity
    )


def zoom_of_blocks(
    read: Callable[[], TimeSeries | Blocks],
    *,
    band_hz: tuple[float, float],
    lines: int = 2000,
    window: Window = "hann",
    quantity: Quantity = "peak",
) -> AmplitudeSpectrum:
    """Zoom into blocks; several are read twice: where the longest run lies must be known before it's weighted.

    Parameters
    ----------
    read
        Gives the blocks from the first on, or a series.
    band_hz, lines, window, quantity
        As for `zoom_spectrum`.
    """
    whole = _single(read())
    run = _longest_run(whole)
    low_hz, high_hz = band_hz
    if not 0 <= low_hz < high_hz <= run.sample_rate_hz / 2:
        raise EstimateError(
            f"a band from {low_hz:g} to {high_hz:g} Hz isn't one within 0 to {run.sample_rate_hz / 2:g} Hz"
        )
    if not 2 <= lines <= MOST_LINES:
        raise EstimateError(f"{counted(lines, 'line')}; give 2 to {MOST_LINES}")
    shape = window_samples(window, min(run.samples, LONGEST_WINDOW))
    if not shape.sum() > 0:
        raise EstimateError(f"{counted(run.samples, 'sample')} without a gap: too few for a spectrum; read more")
    again = whole if isinstance(whole, TimeSeries) else read()
    gain = 2 / (shape.mean() * run.samples) / (1 if quantity == "peak" else np.sqrt(2))
    amplitude = gain * np.abs(_transformed(again, run, shape, band_hz, lines))
    segment_s = run.samples / run.sample_rate_hz
    return AmplitudeSpectrum(
        frequency_hz=np.linspace(low_hz, high_hz, lines),
        values=amplitude,
        std=np.full(amplitude.shape, np.inf),
        quantity=quantity,
        channels=run.channels,
        provenance=Provenance(
            estimator=f"zoom spectrum, {quantity}",
            window=window_name(window),
            segment_s=segment_s,
            averages=1,
            effective_averages=1.0,
            notes=(f"tones closer than {noise_bandwidth_bins(shape) / segment_s:.3g} Hz run together",),
        ),
    )


def _single(source: TimeSeries | Blocks) -> TimeSeries | Blocks:
    """Give a lone block as the series that it is: it needn't be read again."""
    if isinstance(source, TimeSeries):
        return source
    blocks = iter(source)
    begun = [*islice(blocks, 2)]
    return begun[0] if len(begun) == 1 else chain(begun, blocks)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Run:
    """The longest run that all channels have: its first sample, counted from the first of all, and its means."""

    channels: tuple[Channel, ...]
    sample_rate_hz: float
    first: int
    samples: int
    means: Real


def _placed(source: TimeSeries | Blocks) -> Iterator[tuple[int, TimeSeries]]:
    """Give blocks with the number of their first sample; between them samples may be missing."""
    _, blocks = leading_part(source, 1)
    start_ns: int | None = None
    for block in blocks:
        start_ns = block.start_time_ns if start_ns is None else start_ns
        yield round((block.start_time_ns - start_ns) / NS_PER_S * block.sample_rate_hz), block


def _longest_run(source: TimeSeries | Blocks) -> _Run:
    best, first, length, end, seen = (0, 0), 0, 0, 0, None
    largest: Real = np.zeros(0)
    known: Mask = np.zeros(0, dtype=bool)
    sums, best_sums = np.zeros(0), np.zeros(0)
    for place, block in _placed(source):
        if seen is None:
            largest, known = np.zeros(len(block.channels)), np.zeros(len(block.channels), dtype=bool)
        seen = block
        measured = measured_samples(block)
        known |= measured.any(axis=1)
        largest = np.maximum(largest, np.max(np.abs(block.values), axis=1, initial=0.0, where=measured))
        for start, stop in channel_runs(np.logical_and.reduce(measured, axis=0)):
            if not (length and place + start == end):
                first, length, sums = place + start, 0, np.zeros(len(block.channels))
            length, end = length + stop - start, place + stop
            sums = sums + block.values[:, start:stop].sum(axis=1, dtype=np.float64)
            if length > best[1]:
                best, best_sums = (first, length), sums
    if seen is None:
        raise EstimateError("there is no sample; choose a time window in which the log has data")
    if not known.all():
        empty = [channel.name for channel, one in zip(seen.channels, known, strict=True) if not one]
        raise EstimateError(f"{', '.join(empty)}: nothing was measured; leave it out")
    if not best[1]:
        raise EstimateError("no sample was measured in all channels at once")
    require_in_range(seen.channels, largest)
    return _Run(
        channels=seen.channels,
        sample_rate_hz=seen.sample_rate_hz,
        first=best[0],
        samples=best[1],
        means=best_sums / best[1],
    )


def _transformed(
    source: TimeSeries | Blocks, run: _Run, shape: Real, band_hz: tuple[float, float], lines: int
) -> Complex:
    """``[channel, line]``: the sum over blocks of each one's chirp z-transform, turned to the run's first sample."""
    from scipy.signal import ZoomFFT

    total = np.zeros((len(run.channels), lines), dtype=complex)
    turn = -2j * np.pi * np.linspace(*band_hz, lines) / run.sample_rate_hz
    plans: dict[int, ZoomFFT] = {}
    for place, block in _placed(source):
        start, stop = max(run.first - place, 0), min(run.first + run.samples - place, block.samples)
        for begin in range(start, stop, SAMPLES_AT_ONCE):
            many = min(SAMPLES_AT_ONCE, stop - begin)
            if many not in plans:
                plans[many] = ZoomFFT(many, band_hz, lines, fs=run.sample_rate_hz, endpoint=True)
            at = place + begin - run.first
            rows = max(1, VALUES_AT_ONCE // (many + lines))
            for row in range(0, total.shape[0], rows):
                some = slice(row, row + rows)
                values = block.values[some, begin : begin + many].astype(np.float64) - run.means[some, None]
                total[some] += plans[many](values * _weights(shape, run.samples, at, many)) * np.exp(turn * at)
    return total


def _weights(shape: Real, samples: int, first: int, count: int) -> Real:
    """Give some of a window's samples, between those of one that is shorter where it would take memory."""
    if shape.size == samples:
        return shape[first : first + count]
    closed = np.append(shape, shape[0])
    at = np.arange(first, first + count) * (shape.size / samples)
    return np.asarray(np.interp(at, np.arange(closed.size), closed), dtype=np.float64)

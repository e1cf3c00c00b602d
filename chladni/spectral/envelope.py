"""Envelope spectra: what strikes or modulates in a band, and a bearing's frequencies among it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import frexp, ldexp, nan, sqrt

import numpy as np

from chladni.io.missing_samples import MissingSamples
from chladni.io.source import Blocks, SeriesLike, blocks_of, extent_of, log_or_series
from chladni.signals.channel import Channel, Names
from chladni.signals.envelope import EnvelopeSpectrum, FaultLine, Kurtogram
from chladni.signals.number_range import require_in_range
from chladni.signals.peak import Peak
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import power
from chladni.spectral.accumulator import AutoSpectraAccumulator
from chladni.spectral.band_filter import BandFilter
from chladni.spectral.bearings import Bearing, fault_frequencies_hz
from chladni.spectral.blocks import Source, leading_part
from chladni.spectral.kurtogram import kurtogram
from chladni.spectral.peaks import find_peaks
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.segmentation import plan_segmentation

# Segments end to end that a record is averaged over: few, since lines of slow shafts lie close together.
SEGMENTS = 4
# Slip of rolling elements (Randall & Antoni 2011, section 2): frequencies vary by 1 to 2 %.
SLIP = 0.02
# Multiples of a bearing's frequencies that are looked for; a band holds them when it's that many times as wide.
MULTIPLES = 3
# Lines on either side that tell the background of one.
NEIGHBOURS = 40
# Of a Hann window: lines over which the mean is spread.
LINES_OF_THE_MEAN = 1


def envelope(
    source: SeriesLike,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    band_hz: tuple[float, float] | None = None,
    resolution_hz: float | None = None,
    bearing: Bearing | None = None,
    shaft_hz: float | None = None,
) -> tuple[EnvelopeSpectrum, ...]:
    """Compute the spectrum of the squared envelope of each channel in a band.

    Parameters
    ----------
    source
        A log (read block by block when it's large, and twice where bands are to be chosen), the path to one, a series
        or an array ``[channel, sample]``; mostly accelerations at some 10 kHz.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    band_hz
        Band that is struck, such as a resonance; None takes that of greatest spectral kurtosis, see `kurtogram`.
    resolution_hz
        Distance of the lines; None for a quarter of the record a segment.
    bearing, shaft_hz
        Geometry and revolutions a second: their frequencies are looked for, with multiples and slip.

    Returns
    -------
    tuple of EnvelopeSpectrum
        One for each channel.

    Raises
    ------
    EstimateError
        When the record is too short for the band or the lines.
    SetupError
        When only one of bearing and shaft is known.

    Notes
    -----
    SES(f) = abs(F{abs(x_a)^2}) of the analytic signal x_a in the band (Randall & Antoni 2011, section 5.3), averaged
    after Welch with a Hann window, as amplitudes of sines. Filtered by `BandFilter`.

    Examples
    --------
    >>> t = np.arange(40_000) / 10_000
    >>> blows = (1 + np.cos(2 * np.pi * 87.0 * t)) * np.sin(2 * np.pi * 3000 * t)
    >>> (found,) = envelope(blows, sample_rate_hz=1e4, band_hz=(2500, 3500))
    >>> float(found.frequency_hz[np.argmax(found.amplitude * (found.frequency_hz > 5))])
    87.0
    """
    faults_hz = fault_frequencies_hz(bearing, shaft_hz)
    whole = log_or_series(source, sample_rate_hz=sample_rate_hz)

    def samples() -> TimeSeries | Blocks:
        return blocks_of(whole, channels=channels, start_s=start_s, end_s=end_s)

    lead, _ = leading_part(samples(), 1)
    names = [channel.name for channel in lead[0].channels]
    named = BandChoice(band_hz=band_hz or (0.0, 0.0))
    choices = dict.fromkeys(names, named) if band_hz else chosen_bands(samples(), faults_hz)
    _, length_s = extent_of(whole, channels=channels, start_s=start_s, end_s=end_s)
    missing = MissingSamples()
    spectra = envelope_spectra(
        missing.watch(samples()), choices, length_s=length_s, resolution_hz=resolution_hz, faults_hz=faults_hz
    )
    notes = missing.sentences(from_ns=lead[0].start_time_ns)
    return tuple(replace(one, notes=(*one.notes, *notes)) for one in spectra)


def envelope_spectra(
    source: Source,
    choices: Mapping[str, "BandChoice"],
    *,
    length_s: float,
    resolution_hz: float | None,
    faults_hz: Mapping[str, float],
) -> tuple[EnvelopeSpectrum, ...]:
    """Do the work of `envelope` on a stream of known length, for the channels that have a band."""
    lead, blocks = leading_part(source, 1)
    rate_hz = lead[0].sample_rate_hz
    accumulators = [
        EnvelopeAccumulator(
            channel,
            rate_hz,
            choices[channel.name],
            resolution_hz=SEGMENTS / length_s if resolution_hz is None else resolution_hz,
            samples=round(length_s * rate_hz),
        )
        for channel in lead[0].channels
        if channel.name in choices
    ]
    rows = [row for row, channel in enumerate(lead[0].channels) if channel.name in choices]
    for block in blocks:
        for row, one in zip(rows, accumulators, strict=True):
            valid = None if block.valid is None else block.valid[row : row + 1]
            alone = replace(block, values=block.values[row : row + 1], channels=(one.channel,), valid=valid)
            one.update(alone)
    return tuple(one.result(faults_hz) for one in accumulators)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BandChoice:
    """A band, and the kurtogram of its channel by which it was chosen, if it was."""

    band_hz: tuple[float, float]
    kurtosis: float = nan
    kurtogram: Kurtogram | None = None
    notes: tuple[str, ...] = ()


def chosen_bands(source: Source, faults_hz: Mapping[str, float]) -> dict[str, BandChoice]:
    """Choose for each channel the band of greatest spectral kurtosis, wide enough for multiples of the faults."""
    found = kurtogram(source)
    width_hz = MULTIPLES * max(faults_hz.values(), default=0.0)
    return {channel.name: _choice(found.select(row), width_hz) for row, channel in enumerate(found.channels)}


def _choice(gram: Kurtogram, least_width_hz: float) -> BandChoice:
    band = gram.best(least_width_hz=least_width_hz)
    kurtosis, std = float(gram.kurtosis[0, band]), float(gram.std[0, band])
    note = (
        f"{gram.channels[0].name}: no band is more impulsive than noise (spectral kurtosis {kurtosis:.2g}, one sigma "
        f"{std:.2g} for noise); name the band of a resonance"
    )
    return BandChoice(
        band_hz=(float(gram.low_hz[band]), float(gram.high_hz[band])),
        kurtosis=kurtosis,
        kurtogram=gram,
        notes=(note,) if kurtosis < 3 * std else (),
    )


class EnvelopeAccumulator:
    """Running envelope spectrum of one channel, see `envelope`; mutable, the result is a frozen value."""

    def __init__(
        self, channel: Channel, sample_rate_hz: float, choice: BandChoice, *, resolution_hz: float, samples: int
    ) -> None:
        self.channel = channel
        self.choice = choice
        self._filter = BandFilter(sample_rate_hz, choice.band_hz, envelope=True)
        plan = plan_segmentation(sample_rate_hz, samples_available=samples, resolution_hz=resolution_hz)
        squared = replace(channel, unit=power(channel.unit, 2), overload=None)
        self._spectra = AutoSpectraAccumulator([squared], sample_rate_hz, plan)
        self._sum, self._samples = 0.0, 0
        # Squares of squares leave the range of numbers that spectra are made of, so they are made near 1.
        self._exponent: int | None = None

    def update(self, block: TimeSeries) -> None:
        """Take in the next block, of this channel alone."""
        for squared in self._filter.feed(block):
            self._add(squared)

    def result(self, faults_hz: Mapping[str, float]) -> EnvelopeSpectrum:
        """Give the spectrum, and the lines of a bearing's frequencies in it; no more blocks may follow."""
        for squared in self._filter.rest():
            self._add(squared)
        require_in_range([self.channel], self._filter.largest)
        whole = power_spectral_density(self._spectra.result())
        size = ldexp(1.0, 2 * (self._exponent or 0))
        # The square of what fills a band holds differences of its frequencies: none is greater than its width.
        width_hz = self.choice.band_hz[1] - self.choice.band_hz[0]
        shown = max(2, int(np.searchsorted(whole.frequency_hz, width_hz, side="right")))
        density = replace(
            whole,
            frequency_hz=whole.frequency_hz[:shown],
            values=whole.values[:, :shown] * size,
            std=whole.std[:, :shown] * size,
            provenance=whole.provenance.with_estimator("squared envelope spectrum"),
        )
        found = EnvelopeSpectrum(
            channel=self.channel,
            band_hz=self.choice.band_hz,
            band_kurtosis=self.choice.kurtosis,
            density=density,
            mean=self._sum / max(1, self._samples) * sqrt(size),
            kurtogram=self.choice.kurtogram,
            notes=(*self.choice.notes, *density.provenance.notes),
        )
        peaks = _peaks(found)
        still = () if peaks else (_told_still(self.channel, density.frequency_hz[1]),)
        return replace(found, faults=tuple(_fault_lines(found, faults_hz)), peaks=peaks, notes=(*found.notes, *still))

    def _add(self, squared: TimeSeries) -> None:
        if self._exponent is None and squared.values.any():
            # A power of two loses no digit.
            self._exponent = frexp(float(squared.values.max()))[1]
        values = np.ldexp(squared.values, -(self._exponent or 0))
        self._spectra.update(replace(squared, values=values))
        self._sum += float(values.sum())
        self._samples += squared.samples


def _told_still(channel: Channel, spacing_hz: float) -> str:
    return f"{channel.name}: no line of the envelope stands out; with lines {spacing_hz:.3g} Hz apart nothing repeats"


def _peaks(found: EnvelopeSpectrum) -> tuple[Peak, ...]:
    """Name the lines that stand out, the highest first, by their amplitudes."""
    unit = found.density.channels[0].unit
    peaks = []
    for peak in find_peaks(found.density):
        line = int(np.argmin(np.abs(found.frequency_hz - peak.frequency_hz)))
        height = float(found.amplitude[line])
        # An amplitude is the root of a power.
        std = height * peak.height_std / (2 * peak.height)
        peaks.append(replace(peak, height=height, height_std=std, unit=unit))
    return tuple(sorted(peaks, key=lambda peak: -peak.height))


def _fault_lines(found: EnvelopeSpectrum, faults_hz: Mapping[str, float]) -> Iterator[FaultLine]:
    frequency_hz, amplitude = found.frequency_hz, found.amplitude
    expected = [
        (name if multiple == 1 else f"{multiple} {name}", multiple * hz)
        for name, hz in faults_hz.items()
        for multiple in range(1, MULTIPLES + 1)
        if multiple * hz <= frequency_hz[-1]
    ]
    # A line counts for the frequency that it's nearest to: some bearings' multiples lie within each other's slip.
    apart = np.abs(np.subtract.outer([hz for _, hz in expected], frequency_hz))
    nearest = np.argmin(apart, axis=0) if expected else np.empty(0, dtype=np.intp)
    for place, (name, hz) in enumerate(expected):
        reach_hz = max(float(frequency_hz[1]), SLIP * hz)
        near = np.flatnonzero((nearest == place) & (apart[place] <= reach_hz))
        # Near 0 Hz the window shows the mean.
        near = near[near > LINES_OF_THE_MEAN]
        if near.size:
            line = int(near[np.argmax(amplitude[near])])
            around = amplitude[max(LINES_OF_THE_MEAN + 1, line - NEIGHBOURS) : line + NEIGHBOURS + 1]
            yield FaultLine(
                name=name,
                expected_hz=hz,
                found_hz=float(frequency_hz[line]),
                amplitude=float(amplitude[line]),
                over_background=float(amplitude[line] / max(np.median(around), np.finfo(np.float64).tiny)),
            )

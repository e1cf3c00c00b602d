"""Time delays between points, by the phase of their cross-spectra."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.io.source import SeriesLike
from chladni.signals.channel import Names
from chladni.signals.cross_correlation import CrossCorrelation, TimeDelays
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_correlation import Transforms, correlated, paired
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.filters import bandpass, highpass, lowpass, measured_samples

# The next highest peak of the correlation is as likely the true one when it's nearly as high.
RIVAL = 0.9
# Chance of telling of a misfit where there is none.
BY_CHANCE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class _Delay:
    """Delay, one sigma, mean coherence; and how many sigma phases lie off it, 0 where chance explains that."""

    delay_s: float
    std_s: float
    coherence: float
    misfit: float


def time_delay(
    source: SeriesLike,
    *,
    references: str,
    responses: Names | None = None,
    band_hz: tuple[float, float] | None = None,
    longest_delay_s: float | None = None,
    resolution_hz: float | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> TimeDelays:
    """Tell by how much channels come after a reference.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        channels on one clock.
    references, responses
        As for `cross_correlation`.
    band_hz
        Frequencies to use; None for all. Between points of a structure that resonates, a band without resonances:
        their phases are no delay.
    longest_delay_s
        Between minus and plus this the delay is looked for; by default a tenth of the record.
    resolution_hz
        Distance of the lines on which the phase is fitted, see `cross_spectra`.
    sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    TimeDelays
        With one sigma. Of each response the longest run of samples that was measured in it and in the reference tells
        the peak.

    Raises
    ------
    EstimateError
        As `cross_correlation` does, or when the band holds no line.

    Notes
    -----
    The highest peak of the correlation, of either sign, tells the delay to a sample. The response is shifted by that,
    and the straight line -2 pi f tau through 0 is fitted to what is left of the phase of the averaged cross-spectrum,
    with the weights coherence/(1 - coherence), which are those of least variance (Knapp & Carter 1976, IEEE Trans.
    ASSP 24(4); Bendat & Piersol 2010, eq. 9.52). A note tells when another peak is nearly as high, or when phases
    lie farther off the line than their scatter explains.
    """
    chosen = paired(source, references, responses, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    nyquist_hz = chosen.sample_rate_hz / 2
    low_hz, high_hz = (0.0, nyquist_hz) if band_hz is None else band_hz
    if not 0 <= low_hz < high_hz <= nyquist_hz:
        raise EstimateError(f"a band from {low_hz:g} to {high_hz:g} Hz isn't one within 0 to {nyquist_hz:g} Hz")
    longest_s = chosen.duration_s / 10 if longest_delay_s is None else longest_delay_s
    reference, *others = (channel.name for channel in chosen.channels)
    before = _within(chosen.select(reference), low_hz, high_hz)
    correlations, found = [], []
    transforms: Transforms = {}
    for name in others:
        # One response at a time: of a long record, a few copies of many channels don't fit in memory.
        pair = chosen.select([reference, name])
        late = _within(pair.select(name), low_hz, high_hz)
        correlations.append(_near_peak(before, late, longest_s, (low_hz, high_hz), transforms))
        del late
        found.append(_fitted(pair, correlations[-1], (low_hz, high_hz), resolution_hz))
    correlation = replace(
        correlations[0],
        values=np.concatenate([one.values for one in correlations]),
        responses=chosen.channels[1:],
    )
    peaks = np.abs(correlation.values)
    return TimeDelays(
        delay_s=np.array([one.delay_s for one in found]),
        std_s=np.array([one.std_s for one in found]),
        coherence=np.array([one.coherence for one in found]),
        inverted=tuple(bool(row[one] < 0) for row, one in zip(correlation.values, peaks.argmax(axis=1), strict=True)),
        responses=correlation.responses,
        reference=correlation.reference,
        band_hz=(low_hz, high_hz),
        correlation=correlation,
        notes=(*_rivals(correlation), *_misfits(correlation, found)),
    )


def _near_peak(
    reference: TimeSeries,
    response: TimeSeries,
    longest_s: float,
    band_hz: tuple[float, float],
    transforms: "Transforms",
) -> CrossCorrelation:
    """Correlate a pair up to the lag that is asked for; where a higher one lies beyond, a peak has to stand inside.

    Unrelated signals of bandwidth B correlate by chance with a deviation of 1/sqrt(2 B T) (Bendat & Piersol 2010,
    ch. 8).
    """
    pair = _beside(reference, response)
    longest = round(longest_s * pair.sample_rate_hz)
    whole = correlated(pair, None, transforms)
    reach = whole.lag_s.size // 2
    if not 0 < longest < reach:
        return correlated(pair, longest, transforms)
    inside = slice(reach - longest, reach + longest + 1)
    # A correlation reaches to half the record.
    independent = 4 * (band_hz[1] - band_hz[0]) * float(whole.lag_s[-1])
    by_chance = np.sqrt(2 * np.log((2 * longest + 1) / BY_CHANCE) / independent)
    for channel, row in zip(whole.responses, np.abs(whole.values), strict=True):
        best, near = int(row.argmax()), row[inside]
        is_peak = 0 < near.argmax() < near.size - 1 and near.max() > by_chance
        if near.max() < RIVAL * row[best] and not is_peak:
            raise EstimateError(
                f"{channel.name}: no peak of the correlation stands within {longest_s:g} s, and the highest, "
                f"{row[best]:.2f}, lies at {whole.lag_s[best]:.4g} s; look for delays as long as that"
            )
    # A view would hold all of the correlation in memory.
    return replace(whole, lag_s=whole.lag_s[inside].copy(), values=whole.values[:, inside].copy())


def _within(series: TimeSeries, low_hz: float, high_hz: float) -> TimeSeries:
    nyquist_hz = series.sample_rate_hz / 2
    if low_hz > 0 and high_hz < nyquist_hz:
        return bandpass(series, band_hz=(low_hz, high_hz)).series
    if low_hz > 0:
        return highpass(series, low_hz=low_hz).series
    return series if high_hz >= nyquist_hz else lowpass(series, high_hz=high_hz).series


def _beside(reference: TimeSeries, response: TimeSeries) -> TimeSeries:
    both = (reference, response)
    return replace(
        reference,
        values=np.concatenate([one.values for one in both]),
        valid=np.concatenate([measured_samples(one) for one in both]),
        channels=(*reference.channels, *response.channels),
    )


def _fitted(
    pair: TimeSeries, correlation: CrossCorrelation, band_hz: tuple[float, float], resolution_hz: float | None
) -> _Delay:
    from scipy.special import chdtri

    coefficients = correlation.values[0]
    best = int(np.abs(coefficients).argmax())
    shift = round(float(correlation.lag_s[best]) * pair.sample_rate_hz)
    spectra = cross_spectra(_shifted(pair, shift), resolution_hz=resolution_hz)
    lines = (spectra.frequency_hz >= band_hz[0]) & (spectra.frequency_hz <= band_hz[1]) & (spectra.frequency_hz > 0)
    # At half the sample rate a phase is 0 or 180 degrees, whatever the delay.
    lines &= spectra.frequency_hz < pair.sample_rate_hz / 2
    if not lines.any():
        raise EstimateError(
            f"no line lies between {band_hz[0]:g} and {band_hz[1]:g} Hz; widen the band, or ask for finer lines"
        )
    omega = 2 * np.pi * spectra.frequency_hz[lines]
    cross = spectra.density[0, 1, lines] * np.sign(coefficients[best])
    power = spectra.density[0, 0, lines].real * spectra.density[1, 1, lines].real
    coherence = np.divide(np.abs(cross) ** 2, power, out=np.zeros(power.size), where=power > 0)
    averages = max(spectra.provenance.effective_averages, 1.0)
    # What unrelated channels show by chance has a phase of any angle (Carter 1987, Proc. IEEE 75(2), eq. 24).
    sure = coherence > 1 - BY_CHANCE ** (1 / max(averages - 1, 1.0))
    if not sure.any():
        raise EstimateError(
            f"{pair.channels[1].name} isn't coherent with {pair.channels[0].name} on any line; take another band, or "
            "a longer record"
        )
    # No nearer to 1 than rounding is a coherence known.
    known = np.where(sure, np.minimum(coherence, 1 - 1e-9), 0.0)
    weight = known / (1 - known)
    slope = -float(np.sum(weight * omega * np.angle(cross)) / np.sum(weight * omega**2))
    # Each phase has the variance (1 - c)/(2 n c); neighbours hang together as far as a window's lobe is wide.
    together = spectra.bandwidth_hz / float(spectra.frequency_hz[1])
    std_s = float(np.sqrt(together / (2 * averages * np.sum(weight * omega**2))))
    left = np.angle(cross * np.exp(1j * omega * slope))
    misfit = float(np.sqrt(np.mean(2 * averages * (weight * left**2)[sure])))
    # What is left of the phases scatters by chance, too.
    freedom = max(float(sure.sum()) / together, 1.0)
    bound = np.sqrt(chdtri(freedom, BY_CHANCE) / freedom)
    return _Delay(
        delay_s=shift / pair.sample_rate_hz + slope,
        std_s=std_s * max(misfit, 1.0),
        coherence=float(coherence[sure].mean()),
        misfit=misfit if misfit > bound else 0.0,
    )


def _misfits(correlation: CrossCorrelation, found: Sequence[_Delay]) -> list[str]:
    return [
        f"{channel.name}: phases lie {one.misfit:.2g} times as far off a pure delay as scatter explains. The error "
        "bar is as much wider. There are resonances or several paths: choose a band without"
        for channel, one in zip(correlation.responses, found, strict=True)
        if one.misfit
    ]


def _shifted(pair: TimeSeries, shift: int) -> TimeSeries:
    """Set the second channel earlier by so many samples."""
    late, early = max(shift, 0), max(-shift, 0)
    samples = pair.samples - abs(shift)
    measured = measured_samples(pair)
    rows = (slice(early, early + samples), slice(late, late + samples))
    return replace(
        pair,
        values=np.stack([pair.values[row, part] for row, part in enumerate(rows)]),
        valid=np.stack([measured[row, part] for row, part in enumerate(rows)]),
    )


def _rivals(correlation: CrossCorrelation) -> list[str]:
    notes = []
    for channel, row in zip(correlation.responses, np.abs(correlation.values), strict=True):
        best = int(row.argmax())
        peaks = np.flatnonzero((row[1:-1] >= row[:-2]) & (row[1:-1] >= row[2:])) + 1
        others = peaks[(row[peaks] > RIVAL * row[best]) & (peaks != best)]
        if others.size:
            other = int(others[row[others].argmax()])
            notes.append(
                f"{channel.name}: the correlation is {row[best]:.2f} at {correlation.lag_s[best]:.4g} s and "
                f"{row[other]:.2f} at {correlation.lag_s[other]:.4g} s; the delay may be that one: take a wider band"
            )
    return notes

"""Cross-correlation, and time delays between points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Names, as_names
from chladni.signals.cross_correlation import CrossCorrelation, TimeDelays
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.time_series import TimeSeries
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.filters import bandpass, channel_runs, highpass, lowpass, measured_samples

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


def cross_correlation(
    source: SeriesLike,
    *,
    references: str,
    responses: Names | None = None,
    longest_lag_s: float | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> CrossCorrelation:
    """Correlate channels with a reference over lag.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        channels on one clock; their means are taken off.
    references
        Name of the channel that the others are held against.
    responses
        Names of the others; None for all.
    longest_lag_s
        Lags from minus to plus this; by default half the record.
    sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    CrossCorrelation
        Over the longest run of samples that were measured in all these channels.

    Raises
    ------
    EstimateError
        When a channel is missing or never changes, or the lag isn't within the record.

    Notes
    -----
    rho(tau) = sum(x(t) y(t + tau)) / sqrt(sum(x^2) sum(y^2)) (Bendat & Piersol 2010, eq. 5.16 f.), by
    `scipy.signal.correlate`; the sum isn't stretched for samples that a lag leaves out, so that the ends stay quiet.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal(1000)
    >>> pair = {"a": x, "b": np.roll(x, 30)}
    >>> found = cross_correlation(pair, references="a", longest_lag_s=1.0, sample_rate_hz=100.0)
    >>> float(found.lag_s[found.values[0].argmax()])
    0.3
    """
    chosen = _chosen(source, references, responses, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    values = _whole_run(chosen)
    longest = values.shape[1] // 2 if longest_lag_s is None else round(longest_lag_s * chosen.sample_rate_hz)
    if not 0 < longest < values.shape[1]:
        raise EstimateError(
            f"the longest lag is {longest / chosen.sample_rate_hz:g} s; it must lie within the record, "
            f"{values.shape[1] / chosen.sample_rate_hz:g} s without a gap"
        )
    require_in_range(chosen.channels, np.abs(values).max(axis=1))
    return _correlated(chosen, values, longest)


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
        With one sigma.

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
    chosen = _chosen(source, references, responses, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    nyquist_hz = chosen.sample_rate_hz / 2
    low_hz, high_hz = (0.0, nyquist_hz) if band_hz is None else band_hz
    if not 0 <= low_hz < high_hz <= nyquist_hz:
        raise EstimateError(f"a band from {low_hz:g} to {high_hz:g} Hz isn't one within 0 to {nyquist_hz:g} Hz")
    filtered = _within(chosen, low_hz, high_hz)
    longest_s = filtered.duration_s / 10 if longest_delay_s is None else longest_delay_s
    whole = cross_correlation(filtered, references=references, responses=responses)
    if round(longest_s * chosen.sample_rate_hz) > 0 and longest_s < whole.lag_s[-1]:
        correlation = _up_to(whole, longest_s, (low_hz, high_hz))
    else:
        correlation = cross_correlation(filtered, references=references, responses=responses, longest_lag_s=longest_s)
    found = [
        _fitted(
            chosen.select([correlation.reference.name, channel.name]),
            row,
            correlation,
            (low_hz, high_hz),
            resolution_hz,
        )
        for row, channel in enumerate(correlation.responses)
    ]
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


def _chosen(source: SeriesLike, reference: str, responses: Names | None, **part: float | None) -> TimeSeries:
    """Give the reference and its responses, in this order."""
    named = None if responses is None else tuple(dict.fromkeys((reference, *as_names(responses))))
    series = series_of(source, channels=named, **part)
    first = series.channels[series.index(reference)].name
    others = [channel.name for channel in series.channels if channel.name != first]
    if not others:
        raise EstimateError(f"no channel but {first} is there; a second one is needed")
    return series.select([first, *others])


def _whole_run(series: TimeSeries) -> Real:
    """``[channel, sample]`` of the longest run that all channels have, without means."""
    runs = list(channel_runs(np.logical_and.reduce(measured_samples(series), axis=0)))
    if not runs:
        raise EstimateError("no sample was measured in all channels at once")
    first, last = max(runs, key=lambda run: run[1] - run[0])
    values = series.values[:, first:last].astype(np.float64)
    values -= values.mean(axis=1, keepdims=True)
    still = [channel.name for channel, row in zip(series.channels, values, strict=True) if not row.any()]
    if still:
        raise EstimateError(f"{', '.join(still)} never changes; leave it out")
    return values


def _correlated(series: TimeSeries, values: Real, longest: int) -> CrossCorrelation:
    from scipy.signal import correlate

    size = np.sqrt(np.sum(np.square(values), axis=1))
    zero = values.shape[1] - 1
    rows = [
        correlate(row, values[0], mode="full", method="fft")[zero - longest : zero + longest + 1] / (size[0] * own)
        for row, own in zip(values[1:], size[1:], strict=True)
    ]
    return CrossCorrelation(
        lag_s=np.arange(-longest, longest + 1) / series.sample_rate_hz,
        values=np.stack(rows),
        responses=series.channels[1:],
        reference=series.channels[0],
    )


def _up_to(whole: CrossCorrelation, longest_s: float, band_hz: tuple[float, float]) -> CrossCorrelation:
    """Cut a correlation to the lags that are asked for; where a higher one lies beyond, a peak has to stand inside.

    Unrelated signals of bandwidth B correlate by chance with a deviation of 1/sqrt(2 B T) (Bendat & Piersol 2010,
    ch. 8).
    """
    step_s = float(whole.lag_s[1] - whole.lag_s[0])
    inside = np.abs(whole.lag_s) < longest_s + 0.5 * step_s
    # A correlation reaches to half the record.
    independent = 4 * (band_hz[1] - band_hz[0]) * float(whole.lag_s[-1])
    by_chance = np.sqrt(2 * np.log(inside.sum() / BY_CHANCE) / independent)
    for channel, row in zip(whole.responses, np.abs(whole.values), strict=True):
        best, near = int(row.argmax()), row[inside]
        is_peak = 0 < near.argmax() < near.size - 1 and near.max() > by_chance
        if near.max() < RIVAL * row[best] and not is_peak:
            raise EstimateError(
                f"{channel.name}: no peak of the correlation stands within {longest_s:g} s, and the highest, "
                f"{row[best]:.2f}, lies at {whole.lag_s[best]:.4g} s; look for delays as long as that"
            )
    return replace(whole, lag_s=whole.lag_s[inside], values=whole.values[:, inside])


def _within(series: TimeSeries, low_hz: float, high_hz: float) -> TimeSeries:
    nyquist_hz = series.sample_rate_hz / 2
    if low_hz > 0 and high_hz < nyquist_hz:
        return bandpass(series, band_hz=(low_hz, high_hz)).series
    if low_hz > 0:
        return highpass(series, low_hz=low_hz).series
    return series if high_hz >= nyquist_hz else lowpass(series, high_hz=high_hz).series


def _fitted(
    pair: TimeSeries,
    row: int,
    correlation: CrossCorrelation,
    band_hz: tuple[float, float],
    resolution_hz: float | None,
) -> _Delay:
    from scipy.special import chdtri

    best = int(np.abs(correlation.values[row]).argmax())
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
    cross = spectra.density[0, 1, lines] * np.sign(correlation.values[row, best])
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

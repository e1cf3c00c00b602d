"""Cross-correlation of channels over the lag between them."""

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Names, as_names
from chladni.signals.cross_correlation import CrossCorrelation
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.time_series import TimeSeries
from chladni.spectral.filters import channel_runs, measured_samples


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
    rho(tau) = sum(x(t) y(t + tau)) / sqrt(sum(x^2) sum(y^2)) (Bendat & Piersol 2010, eq. 5.16 f.), by FFT;
    the sum isn't stretched for samples that a lag leaves out, so that the ends stay quiet.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal(1000)
    >>> pair = {"a": x, "b": np.roll(x, 30)}
    >>> found = cross_correlation(pair, references="a", longest_lag_s=1.0, sample_rate_hz=100.0)
    >>> float(found.lag_s[found.values[0].argmax()])
    0.3
    """
    chosen = paired(source, references, responses, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    return correlated(chosen, None if longest_lag_s is None else round(longest_lag_s * chosen.sample_rate_hz))


def paired(source: SeriesLike, reference: str, responses: Names | None, **part: float | None) -> TimeSeries:
    """Give the reference and its responses, in this order."""
    named = None if responses is None else tuple(dict.fromkeys((reference, *as_names(responses))))
    series = series_of(source, channels=named, **part)
    first = series.channels[series.index(reference)].name
    others = [channel.name for channel in series.channels if channel.name != first]
    if not others:
        raise EstimateError(f"no channel but {first} is there; a second one is needed")
    return series.select([first, *others])


def _longest_run(series: TimeSeries) -> TimeSeries:
    """Give the longest run of samples that all channels have."""
    runs = list(channel_runs(np.logical_and.reduce(measured_samples(series), axis=0)))
    if not runs:
        raise EstimateError("no sample was measured in all channels at once")
    run = series.samples_between(*max(runs, key=lambda run: run[1] - run[0]))
    lowest, highest = run.values.min(axis=1), run.values.max(axis=1)
    still = [channel.name for channel, moves in zip(run.channels, lowest < highest, strict=True) if not moves]
    if still:
        raise EstimateError(f"{', '.join(still)} never changes; leave it out")
    require_in_range(run.channels, np.maximum(np.abs(lowest), np.abs(highest)).astype(np.float64))
    return run


#: Conjugate spectrum of a reference, and the root of its energy, by the samples it's of and the points it has.
Transforms = dict[tuple[int, int, int], tuple[Complex, float]]


def correlated(series: TimeSeries, longest: int | None, transforms: Transforms | None = None) -> CrossCorrelation:
    """Correlate all channels with the first, up to so many samples of lag; half the record if none is given.

    `transforms` keeps the transform of the reference for the next call of the same samples.
    """
    import scipy.fft

    run = _longest_run(series)
    longest = run.samples // 2 if longest is None else longest
    if not 0 < longest < run.samples:
        raise EstimateError(
            f"the longest lag is {longest / run.sample_rate_hz:g} s; it must lie within the record, "
            f"{run.duration_s:g} s without a gap"
        )
    # Zeros as many as the longest lag keep its end from meeting the beginning.
    points = scipy.fft.next_fast_len(run.samples + longest, real=True)

    def transformed(row: Real) -> tuple[Complex, float]:
        centred = row.astype(np.float64)
        centred -= centred.mean()
        return scipy.fft.rfft(centred, points), float(np.sqrt(centred @ centred))

    transforms = {} if transforms is None else transforms
    key = (run.start_time_ns, run.samples, points)
    if key not in transforms:
        # Responses that miss samples elsewhere come in turn; one transform is as large as the record.
        transforms.clear()
        first, size = transformed(run.values[0])
        transforms[key] = np.conj(first, out=first), size
    first, size = transforms[key]
    rows = np.empty((len(run.channels) - 1, 2 * longest + 1))
    for row, values in zip(rows, run.values[1:], strict=True):
        spectrum, own = transformed(values)
        spectrum *= first
        over_lag = scipy.fft.irfft(spectrum, points)
        row[:longest], row[longest:] = over_lag[-longest:], over_lag[: longest + 1]
        row /= size * own
    return CrossCorrelation(
        lag_s=np.arange(-longest, longest + 1) / run.sample_rate_hz,
        values=rows,
        responses=run.channels[1:],
        reference=run.channels[0],
    )

"""Probability density of amplitudes, beside the Gaussian one."""

import numpy as np

from chladni.io.missing_samples import missing_notes
from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.random_vibration import ProbabilityDensity
from chladni.spectral.filters import require_measured


def probability_density(
    source: SeriesLike,
    *,
    bins: int = 60,
    widest: float = 5.0,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> ProbabilityDensity:
    """Tell how often amplitudes occur, beside what Gaussian noise has.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        of all channels.
    bins
        How many, at least 2.
    widest
        From minus to plus so many standard deviations; what lies beyond isn't counted.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    ProbabilityDensity
        In standard deviations from the mean.

    Raises
    ------
    EstimateError
        When an argument is out of its range, or a channel never changes.

    Notes
    -----
    Share of samples in a bin over its width W (Bendat & Piersol 2010, eq. 8.69). Its variance is p (1 - p W)/(N W)
    for N independent samples. At least as many are as there are samples over the sum of their squared
    autocorrelation: whether a sample lies in a bin is forgotten sooner than its value.

    Examples
    --------
    >>> found = probability_density(np.random.default_rng(1).standard_normal(100_000), sample_rate_hz=1000.0)
    >>> bool(np.abs(found.density[0] - found.gaussian).max() < 0.02)
    True
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    if not (bins >= 2 and 0 < widest < np.inf):
        raise EstimateError(f"{bins} bins to {widest:g} standard deviations; give 2 or more, above 0")
    edges = np.linspace(-widest, widest, bins + 1)
    rows = []
    for channel, values, known in zip(series.channels, series.values, require_measured(series), strict=True):
        x = values[known].astype(np.float64)
        size = float(x.std()) if x.size else 0.0
        if not size > 0:
            raise EstimateError(f"{channel.name} never changes; leave it out")
        deviation = (x - x.mean()) / size
        share = np.histogram(deviation, edges)[0] / x.size
        independent = x.size / _held_together(deviation)
        rows.append((share, np.sqrt(share * (1 - share) / independent), float(x.mean()), size))
    width = float(edges[1] - edges[0])
    return ProbabilityDensity(
        deviation=(edges[1:] + edges[:-1]) / 2,
        density=np.stack([share for share, _, _, _ in rows]) / width,
        std=np.stack([std for _, std, _, _ in rows]) / width,
        mean=np.array([mean for _, _, mean, _ in rows]),
        standard_deviation=np.array([size for _, _, _, size in rows]),
        channels=series.channels,
        notes=missing_notes(series),
    )


def _held_together(deviation: Real) -> float:
    """How many samples count as one: the sum of the squared autocorrelation, that is of the squared spectrum."""
    power = np.abs(np.fft.rfft(deviation)) ** 2
    # Half of the lines are there, and those of a periodogram scatter by as much as they are: twice the square.
    return max(1.0, float(deviation.size * np.sum(power**2) / (4 * power.sum() ** 2)))

"""Real and power cepstra of averaged spectra."""

from typing import get_args

import numpy as np
import scipy.fft

from chladni.io.source import Blocks, SeriesLike, blocks_of
from chladni.signals.arrays import Index, Real
from chladni.signals.cepstrum import Cepstrum, CepstrumKind
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import shown
from chladni.spectral.accumulator import AutoSpectraAccumulator, one_sided_weights
from chladni.spectral.blocks import Source, leading_part
from chladni.spectral.cross_spectra import segment_average
from chladni.spectral.leakage import named_window
from chladni.spectral.psd import power_spectral_density

# Lines over which a Hann window spreads the mean, which is removed.
LINES_OF_THE_MEAN = 2
# Chance that scatter alone makes a peak, in a channel's whole cepstrum.
FALSE_ALARM = 0.05
MOST_PEAKS = 10


def cepstrum(
    source: SeriesLike | Blocks,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    kind: CepstrumKind = "real",
    resolution_hz: float | None = None,
) -> Cepstrum:
    """Compute the cepstrum of each channel: what repeats along its spectrum.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series, an array ``[channel, sample]``, or
        consecutive blocks of a series.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    kind
        ``real``: the inverse transform of ln abs(X). ``power``: the square of that of ln abs(X)^2.
    resolution_hz
        Distance of the lines; quefrencies reach to half of one over it. None chooses, see `plan_segmentation`.

    Returns
    -------
    Cepstrum
        Peaks are those that scatter explains with a chance of 5 % in the whole cepstrum, beyond the quefrencies that
        hold the spectrum's smooth shape: those before the first value within that scatter.

    Raises
    ------
    EstimateError
        When a channel never changes, or there is too little to average.
    SetupError
        When there is no such kind, or the resolution needs a longer record.

    Notes
    -----
    Bogert, Healy & Tukey (1963); Childers, Skinner & Kemerait (1977), Proc. IEEE 65, 1428-1443: eq. 3 for the power
    cepstrum, which is 4 times the square of the real one. Of the power averaged after Welch with a Hann window. An
    echo of strength a after tau has the real cepstrum a/2 at tau, -a^2/4 at 2 tau, and so on. With n effective
    averages of N samples a value scatters by sqrt(c psi_1(n) / (4 N)): psi_1(n) is the variance of the logarithm of a
    line, and c(tau) = N sum(w^2(k) w^2(k + tau)) / sum(w^2)^2 comes from neighbouring lines of a window w.

    Examples
    --------
    >>> noise = np.random.default_rng(1).standard_normal(200_000)
    >>> echoed = noise + 0.5 * np.roll(noise, 50)  # after 50 ms
    >>> found = cepstrum(echoed, sample_rate_hz=1000.0, resolution_hz=0.5)
    >>> found.peaks_s[0][0], round(found.at(0, 0.05), 2)
    (0.05, 0.25)
    """
    blocks = blocks_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    density, rate_hz = cepstrum_spectra(blocks, resolution_hz=resolution_hz)
    return cepstrum_of(density, kind=kind, sample_rate_hz=rate_hz)


def cepstrum_spectra(source: Source, *, resolution_hz: float | None) -> tuple[PowerSpectralDensity, float]:
    """Average the spectra whose logarithms cepstra are made of, after Welch, and give the sample rate."""
    lead, blocks = leading_part(source, 1)
    spectra = segment_average(
        AutoSpectraAccumulator,
        # A series tells its length, which its blocks don't.
        source if isinstance(source, TimeSeries) else blocks,
        resolution_hz=resolution_hz,
        window="hann",
        overlap=0.5,
        detrend="constant",
    )
    return power_spectral_density(spectra), lead[0].sample_rate_hz


def cepstrum_of(density: PowerSpectralDensity, *, kind: CepstrumKind, sample_rate_hz: float) -> Cepstrum:
    """Make the cepstra of densities, see `cepstrum`."""
    if kind not in get_args(CepstrumKind):
        raise SetupError(f"kind {shown(kind)} is none of {', '.join(get_args(CepstrumKind))}")
    still = [one.name for one, power in zip(density.channels, density.values, strict=True) if not power.any()]
    if still:
        raise EstimateError(f"channel {still[0]!r} never changes: its spectrum has no logarithm; leave it out")
    account = density.provenance
    # Lines don't tell whether they are of an odd or an even number of samples.
    samples = round(account.segment_s * sample_rate_hz)
    whole = scipy.fft.irfft(_log_magnitude(density.values / one_sided_weights(samples)), samples, axis=1)
    values = np.asarray(whole[:, : samples // 2 + 1], dtype=np.float64)
    quefrency_s = np.arange(values.shape[1], dtype=np.float64) * (account.segment_s / samples)
    std = _scatter(account, samples, values.shape[1])
    return Cepstrum(
        quefrency_s=quefrency_s,
        values=values if kind == "real" else 4 * values**2,
        std=std,
        kind=kind,
        peaks_s=tuple(tuple(quefrency_s[_peaks(row, std)].tolist()) for row in values),
        channels=density.channels,
        provenance=account.with_estimator(f"{kind} cepstrum"),
    )


def _log_magnitude(power: Real) -> Real:
    """``ln abs(X)`` of two-sided power; what holds nothing has the smallest magnitude that sums resolve."""
    power = power.copy()
    # The mean was taken out: its lines go on as the spectrum does beside them.
    beside = min(LINES_OF_THE_MEAN, power.shape[1] - 1)
    power[:, :beside] = power[:, beside : beside + 1]
    least = power.max(axis=1, keepdims=True) * np.finfo(np.float64).eps ** 2
    return np.asarray(np.log(np.maximum(power, least)) / 2, dtype=np.float64)


def _scatter(account: Provenance, samples: int, count: int) -> Real:
    """``[quefrency]`` one sigma of the real cepstrum; its window makes neighbouring lines alike."""
    from scipy.special import polygamma

    squared = named_window(account.window) ** 2
    # Around a circle, as the transform of the lines' correlation has it; 1 on average.
    shared = scipy.fft.irfft(np.abs(scipy.fft.rfft(squared)) ** 2, squared.size) * squared.size / squared.sum() ** 2
    at = np.arange(count) / samples * squared.size
    correlation = np.interp(at, np.arange(squared.size + 1), np.append(shared, shared[0]))
    return np.asarray(np.sqrt(correlation * polygamma(1, account.effective_averages) / (4 * samples)))


def _peaks(values: Real, std: Real) -> Index:
    """Quefrencies that stand out, the highest first, beyond the smooth shape of the spectrum."""
    from scipy.special import ndtri

    bound = -float(ndtri(FALSE_ALARM / values.size)) * std
    # At 0 stands the mean of the logarithm, and the end has no neighbour.
    quiet = np.flatnonzero(np.abs(values[1:]) < bound[1:])
    first = int(quiet[0]) + 2 if quiet.size else values.size
    inner = values[1:-1]
    tops = np.flatnonzero((inner > values[:-2]) & (inner >= values[2:]) & (inner > bound[1:-1])) + 1
    tops = tops[tops >= first]
    return np.asarray(tops[np.argsort(-values[tops])][:MOST_PEAKS], dtype=np.intp)

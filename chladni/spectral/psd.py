"""Power spectral densities after Welch: periodograms of windowed segments that overlap, averaged."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.cross_spectra import AutoSpectra, CrossSpectra
from chladni.signals.power_spectral_density import PowerSpectralDensity


def power_spectral_density(spectra: CrossSpectra | AutoSpectra) -> PowerSpectralDensity:
    """Take the auto-spectral densities with their random errors.

    Parameters
    ----------
    spectra
        Averaged spectra of the channels.

    Returns
    -------
    PowerSpectralDensity
        ``[channel, frequency]`` in unit^2/Hz. One sigma is G / sqrt(n) with n effective averages (Bendat & Piersol
        2010, eq. 8.156; on the first and last line, which are real, the scatter is sqrt(2) times as large). For
        periodic excitation with power R of the mean of M periods and scatter S of one, its square is
        (2 R S + S^2 (M - 1)(M - 2)/M^2) / M, which is right on average for Gaussian scatter.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.time_series import TimeSeries
    >>> from chladni.spectral.cross_spectra import cross_spectra
    >>> noise = np.random.default_rng(1).standard_normal((1, 100_000))
    >>> series = TimeSeries(values=noise, sample_rate_hz=200.0, channels=(Channel(name="a", unit="N"),))
    >>> psd = power_spectral_density(cross_spectra(series, resolution_hz=1.0))
    >>> bool(abs(psd.values[0, 1:-1].mean() - 1 / 100) < 0.0002)  # variance 1 spread over 100 Hz
    True
    """
    values = auto_densities(spectra.density)
    return PowerSpectralDensity(
        frequency_hz=spectra.frequency_hz,
        values=values,
        std=_std(spectra, values),
        channels=spectra.channels,
        bandwidth_hz=spectra.bandwidth_hz,
        provenance=spectra.provenance.with_estimator("PSD"),
    )


def auto_densities(density: NDArray[Any]) -> Real:
    """Give the diagonal of ``[channel, channel, frequency]`` as ``[channel, frequency]``, real; or what is that."""
    return np.asarray((np.einsum("iif->if", density) if density.ndim == 3 else density).real, dtype=np.float64)


def _std(spectra: CrossSpectra | AutoSpectra, values: Real) -> Real:
    if spectra.noise_density is None:
        return np.asarray(values / np.sqrt(spectra.provenance.effective_averages), dtype=np.float64)
    # Scatter of |mean + noise|^2: the noise beats with the mean, and with itself.
    periods = spectra.provenance.averages
    scatter = auto_densities(spectra.noise_density)
    repeated = np.maximum(values - scatter * (periods - 1) / periods, 0.0)
    # Scatter with itself: E[S^2] is M/(M - 1) of its square, and R holds 1/M of the scatter already.
    own = scatter**2 * ((periods - 1) * (periods - 2) / periods**2)
    return np.asarray(np.sqrt((2 * repeated * scatter + own) / periods), dtype=np.float64)

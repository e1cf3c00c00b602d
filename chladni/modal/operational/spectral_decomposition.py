"""Singular values and vectors of the matrix of response spectra, line by line."""

from dataclasses import dataclass
from math import sqrt

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value
from chladni.signals.wording import counted
from chladni.spectral.effective_averages import window_correlation
from chladni.spectral.leakage import named_window

# Below so many effective averages the scatter of a line is as large as itself, and no peak can be told from it.
LEAST_AVERAGES = 4.0
# A shorter axis has no room for a peak, its two flanks and a floor.
LEAST_LINES = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpectralDecomposition(Value):
    """First singular values of the spectral matrix and their vectors.

    Attributes
    ----------
    frequency_hz
        ``[line]``, evenly spaced.
    matrix
        ``[line, channel, channel]`` complex: mean of x x^H, so that x = psi q gives psi psi^H S_qq; each channel over
        its `scale`.
    values
        ``[line, order]`` singular values, falling.
    vectors
        ``[line, channel, order]`` their vectors.
    scale
        ``[channel]`` 1 when all channels have one unit, else the RMS of each, so that units can be compared.
    channels
        Of the spectra.
    record_s
        Length of a record whose lines, without any window, would scatter as much.
    bandwidth_hz
        Noise bandwidth of a line.
    provenance
        Of the spectra.
    """

    frequency_hz: Real
    matrix: Complex
    values: Real
    vectors: Complex
    scale: Real
    channels: tuple[Channel, ...]
    record_s: float
    bandwidth_hz: float
    provenance: Provenance

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def spacing_hz(self) -> float:
        """Distance of the lines."""
        return float(self.frequency_hz[1] - self.frequency_hz[0])

    @property
    def averages(self) -> float:
        """Effective averages."""
        return self.provenance.effective_averages


def decompose(spectra: CrossSpectra) -> SpectralDecomposition:
    """Decompose the spectral matrix of responses (Brincker, Zhang & Andersen 2001).

    The density holds conj(x_i) x_j; its transpose has the shapes themselves as singular vectors, where the density
    would give their conjugates.

    Raises
    ------
    EstimateError
        When the spectra are no linear average of noise, have too few averages or lines, or hold NaN.
    """
    _require_random_average(spectra)
    _require_numbers(spectra)
    # Rotations in rad/s^2 beside accelerations in m/s^2 would count by their numbers, which mean nothing together.
    units = {channel.unit for channel in spectra.channels}
    power = np.einsum("iif->i", spectra.density).real
    scale = np.sqrt(np.where(power > 0, power, 1.0)) if len(units) > 1 else np.ones(power.size)
    matrix = np.ascontiguousarray(spectra.density.transpose(2, 1, 0) / np.outer(scale, scale))
    # A Hermitian matrix without negative eigenvalues has its eigenvectors for singular vectors.
    values, vectors = np.linalg.eigh(matrix)
    return SpectralDecomposition(
        frequency_hz=np.asarray(spectra.frequency_hz, dtype=np.float64),
        matrix=matrix,
        # Rounding leaves eigenvalues of -1e-17 where there are none.
        values=np.maximum(values[:, ::-1], 0.0),
        vectors=vectors[:, :, ::-1],
        scale=scale,
        channels=spectra.channels,
        record_s=spectra.provenance.effective_averages * _length_of_correlation_s(spectra.provenance),
        bandwidth_hz=spectra.bandwidth_hz,
        provenance=spectra.provenance,
    )


def _length_of_correlation_s(provenance: Provenance) -> float:
    """Seconds of record that one independent segment is worth.

    The mean of all segments that a record of T seconds holds, however they overlap, scatters like T over the integral
    of the squared autocorrelation of the window; Welch's overlapped segments come within a few percent of it.
    """
    window = named_window(provenance.window)
    squares = window_correlation(window, 1)
    return float(provenance.segment_s * (2 * squares.sum() - squares[0]) / window.size)


def _require_random_average(spectra: CrossSpectra) -> None:
    provenance = spectra.provenance
    if provenance.averaging not in ("linear", "exponential"):
        raise EstimateError(
            f"modes from responses alone need a linear or exponential average of random responses, but these spectra "
            f"are a {provenance.averaging} one; average anew, or use frequency responses"
        )
    if provenance.effective_averages < LEAST_AVERAGES:
        raise EstimateError(
            f"{provenance.effective_averages:.3g} effective averages are too few to tell peaks from scatter, at "
            f"least {LEAST_AVERAGES:g} are needed; take a longer record or a coarser resolution"
        )
    if spectra.frequency_hz.size < LEAST_LINES:
        raise EstimateError(
            f"{counted(spectra.frequency_hz.size, 'line')} are too few for peaks, at least {LEAST_LINES} are needed; "
            "ask for a finer resolution"
        )


def _require_numbers(spectra: CrossSpectra) -> None:
    for row, channel in enumerate(spectra.channels):
        bad = ~np.isfinite(spectra.density[row]).all(axis=0)
        if bad.any():
            raise EstimateError(
                f"spectra of channel {channel.name!r} aren't finite on {counted(int(bad.sum()), 'line')}, from "
                f"{spectra.frequency_hz[np.argmax(bad)]:g} Hz on; leave the channel out or mark its samples invalid"
            )
    # A single dead channel is no reason to refuse the others.
    power = np.einsum("iif->i", spectra.density).real
    if not np.any(power > 0):
        raise EstimateError("no channel has any power; check that the sensors were connected")


def relative_std(decomposition: SpectralDecomposition) -> float:
    """One sigma of a line over the line."""
    return 1 / sqrt(decomposition.averages)

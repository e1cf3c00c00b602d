"""Shapes of modes from the spectral matrix around their peaks, with their covariance."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.operational.spectral_decomposition import SpectralDecomposition
from chladni.signals.arrays import Complex, Real

# Shapes worse conditioned than this together can't be told apart by these sensors: each is then taken alone.
WORST_CONDITION = 20.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseShape:
    """A shape and its covariance, in a scale that whoever made it says.

    Attributes
    ----------
    vector
        ``[channel]``.
    covariance
        ``[channel, channel]`` E[d d^H] of its error d, as circular complex numbers.
    """

    vector: Complex
    covariance: Complex


def shape_at(decomposition: SpectralDecomposition, line: int, half_width_hz: float) -> ResponseShape:
    """First singular vector of the spectral matrix summed over the lines within `half_width_hz` of a peak.

    With A the sum, its eigenvectors v_j and eigenvalues a_j, the error of the first one is to first order
    sum_j v_j (v_j^H dA v_1)/(a_1 - a_j), and the variance of v_j^H dA v_1 is that of a sum of cross-spectra,
    sum_k S_1k S_jk / (T df), with T the length of the record, df the spacing and S_jk = v_j^H G_k v_j (Brillinger
    1981, section 9.4).
    """
    # Where the mode is strong; with more lines the scatter of the shape falls, with too many that of others comes in.
    reach = max(1, int(half_width_hz / decomposition.spacing_hz))
    matrices = decomposition.matrix[max(line - reach, 0) : line + reach + 1]
    values, vectors = np.linalg.eigh(matrices.sum(axis=0))
    powers = np.maximum(np.einsum("cj,kcd,dj->kj", vectors.conj(), matrices, vectors).real, 0.0)
    variance = powers[:, -1] @ powers[:, :-1] / (decomposition.record_s * decomposition.spacing_hz)
    apart = np.maximum(values[-1] - values[:-1], np.finfo(float).eps * values[-1])
    others = vectors[:, :-1]
    return ResponseShape(vector=vectors[:, -1], covariance=(others * (variance / apart**2)) @ others.conj().T)


def largest_one(shape: ResponseShape, scale: Real) -> tuple[Complex, Complex]:
    """Shape in the channels' units with its largest component 1, and one sigma of real + j imaginary parts."""
    vector = shape.vector * scale
    largest = int(np.argmax(np.abs(vector)))
    unit = vector / vector[largest]
    # psi_i = v_i / v_m: its error is (d_i - psi_i d_m) / v_m.
    change = np.diag(scale) / vector[largest]
    change = change.astype(np.complex128)
    change[:, largest] -= unit * scale[largest] / vector[largest]
    variance = np.einsum("ij,jk,ik->i", change, shape.covariance, change.conj()).real
    # A circular error has half of its variance in either part.
    std = np.sqrt(np.maximum(variance, 0.0) / 2)
    std[largest] = 0.0
    return unit, std * (1 + 1j)


def modal_filters(shapes: list[Complex]) -> list[Complex]:
    """Vectors w, one for each shape, with w^H psi = 1 for its own shape and 0 for the others where sensors allow it.

    Other modes are then out of the spectrum of each modal coordinate, which psi^H alone does for orthogonal shapes
    only (Zhang, Wang & Tamura 2010 weight by psi).
    """
    if not shapes:
        return []
    together = np.stack(shapes, axis=1)
    if together.shape[1] <= together.shape[0] and np.linalg.cond(together) <= WORST_CONDITION:
        return list(np.linalg.pinv(together).conj())
    return list(shapes)


def modal_spectrum(decomposition: SpectralDecomposition, weights: Complex) -> Real:
    """``[line]`` spectrum of the modal coordinate w^H x."""
    # As a product of matrices, which calls BLAS; hundreds of channels take minutes otherwise.
    spectrum = (decomposition.matrix @ weights) @ weights.conj()
    return np.asarray(np.maximum(spectrum.real, 0.0), dtype=np.float64)

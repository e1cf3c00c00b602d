"""First-order covariance of the poles and shapes of subspace models, from the scatter of the correlations."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.fft import fft, ifft, next_fast_len
from scipy.special import ndtri, stdtrit

from chladni.modal.operational.correlation import CorrelationFunctions
from chladni.modal.operational.ssi import FIRST_LAG, OrderModel, SubspaceDecomposition, continuous
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError

# Values of sensitivities held at a time: some tens of megabytes.
VALUES_TOGETHER = 1 << 21


class ErrorPropagation:
    """Carries the deviations of the correlation functions between blocks over to what is computed from them.

    The Hankel matrix enters a pole only through its leading left singular vectors U. To first order a deviation dH
    turns them by dU = (I - U U^T) dH V S^-1, and the poles by

        d mu = chi^H O_up^+ (dO_down - mu dO_up) phi,   chi^H phi = 1,

    with mu, chi, phi an eigenvalue of A and its left and right eigenvectors (Reynders, Pintelon & De Roeck 2008,
    Mech. Syst. Signal Process. 22, 948; Doehler & Mevel 2013, the same, 38, 346). Both are linear in dH, with a
    sensitivity a v^T for each pole. Since H repeats each correlation along its antidiagonals, the sensitivity
    to the correlations is the convolution of a and v over their lags: one short transform a pole, and one product
    with the deviations of all blocks, instead of a matrix of the size of H for each singular vector.

    Parameters
    ----------
    correlations, decomposition
        The functions and what `decompose` gave for them.
    """

    def __init__(self, correlations: CorrelationFunctions, decomposition: SubspaceDecomposition) -> None:
        rows, scale = decomposition.block_rows, decomposition.scale
        self._lags = 2 * rows - 1
        self._shape = correlations.values.shape[1:]
        self._decomposition = decomposition
        used = correlations.deviations[:, FIRST_LAG : FIRST_LAG + self._lags]
        scaled = used / scale[:, None] / scale[correlations.references]
        self._deviations = np.ascontiguousarray(scaled.reshape(correlations.blocks, -1).T)

    def poles(self, model: OrderModel) -> Complex:
        """``[pole, block]`` deviations of the poles in rad/s."""
        eigenvalue = model.eigenvalue
        turned = self._off_the_subspace(
            _shifted(model.left_vectors[model.kept] @ model.pseudo_inverse, eigenvalue, self._decomposition.channels),
            model,
        )
        moved = self._propagated(turned, self._inputs(model, slice(None)))
        return np.asarray(moved / eigenvalue[:, None] * self._decomposition.sample_rate_hz, dtype=np.complex128)

    def shape(self, model: OrderModel, pole: int) -> Complex:
        """``[channel, block]`` deviations of the shape of one pole whose largest component is 1."""
        decomposition = self._decomposition
        channels = decomposition.channels
        top = decomposition.left[:channels, : model.order]
        eigenvalue = model.eigenvalue[pole]
        # Phi (mu - Lambda)^+ X^H: how the other eigenvectors mix into this one when A moves.
        gap = eigenvalue - model.eigenvalues
        gap[model.kept[pole]] = np.inf
        resolvent = (model.vectors / gap) @ model.left_vectors
        mixing = top @ resolvent @ model.pseudo_inverse
        sensitivity = _shifted(mixing, np.full(channels, eigenvalue), channels)
        sensitivity[:, :channels] += np.eye(channels)
        turned = self._off_the_subspace(sensitivity, model)
        inputs = np.repeat(self._inputs(model, slice(pole, pole + 1)), channels, axis=0)
        moved = self._propagated(turned, inputs) * decomposition.scale[:, None]
        shape = top @ model.right[:, pole] * decomposition.scale
        return _normalised(shape, moved)

    def _inputs(self, model: OrderModel, poles: slice) -> Complex:
        """``[pole, column]`` V S^-1 phi."""
        order = model.order
        weighted = model.right[:, poles] / self._decomposition.singular[:order, None]
        return np.asarray((self._decomposition.right[:, :order] @ weighted).T, dtype=np.complex128)

    def _off_the_subspace(self, rows: Complex, model: OrderModel) -> Complex:
        """Rows times I - U U^T: a turn within the subspace only changes the basis."""
        basis = self._decomposition.left[:, : model.order]
        return np.asarray(rows - (rows @ basis) @ basis.T, dtype=np.complex128)

    def _propagated(self, outputs: Complex, inputs: Complex) -> Complex:
        """``[result, block]`` sums of a dH v over the Hankel matrix, a and v one row a result."""
        some = max(VALUES_TOGETHER // max(self._deviations.shape[0], 1), 1)
        parts = [
            self._together(outputs[first : first + some], inputs[first : first + some])
            for first in range(0, outputs.shape[0], some)
        ]
        return np.concatenate([np.zeros((0, self._deviations.shape[1]), dtype=np.complex128), *parts])

    def _together(self, outputs: Complex, inputs: Complex) -> Complex:
        rows = self._decomposition.block_rows
        channels, references = self._shape
        length = next_fast_len(self._lags)
        one = fft(outputs.reshape(-1, rows, channels), length, axis=1)
        other = fft(inputs.reshape(-1, rows, references), length, axis=1)
        sensitivity = ifft(one[:, :, :, None] * other[:, :, None, :], axis=1)[:, : self._lags]
        flat = sensitivity.reshape(outputs.shape[0], -1)
        # One product of real matrices is half the work of one that takes the deviations for complex; BLAS wants the
        # parts in one piece.
        parts = np.concatenate([flat.real, flat.imag]) @ self._deviations
        count = len(flat)
        return np.asarray(parts[:count] + 1j * parts[count:], dtype=np.complex128)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoleDeviations:
    """Deviations of natural frequency and damping ratio between blocks.

    Attributes
    ----------
    frequency_hz, damping_ratio
        ``[pole, block]``; the covariance of two of them is the sum over blocks of their product.
    """

    frequency_hz: Real
    damping_ratio: Real

    @property
    def frequency_std_hz(self) -> Real:
        """``[pole]`` one sigma."""
        return np.asarray(np.sqrt(np.sum(self.frequency_hz**2, axis=1)), dtype=np.float64)

    @property
    def damping_std(self) -> Real:
        """``[pole]`` one sigma."""
        return np.asarray(np.sqrt(np.sum(self.damping_ratio**2, axis=1)), dtype=np.float64)


def pole_deviations(pole: Complex, deviations: Complex) -> PoleDeviations:
    """Turn deviations of poles into those of frequency and damping.

    Parameters
    ----------
    pole
        ``[pole]`` in rad/s.
    deviations
        ``[pole, block]`` in rad/s.

    Notes
    -----
    d omega = Re(conj(s) ds)/omega and d zeta = -Re(ds)/omega - zeta d omega/omega, from omega = abs(s) and zeta =
    -Re(s)/omega (Pintelon, Guillaume & Schoukens 2007, Mech. Syst. Signal Process. 21, 2359).
    """
    omega = np.abs(pole)[:, None]
    zeta = -pole.real[:, None] / omega
    d_omega = (pole.conj()[:, None] * deviations).real / omega
    return PoleDeviations(
        frequency_hz=d_omega / (2 * pi), damping_ratio=-deviations.real / omega - zeta * d_omega / omega
    )


def all_pole_deviations(
    correlations: CorrelationFunctions, decomposition: SubspaceDecomposition, models: Sequence[OrderModel]
) -> PoleDeviations:
    """Deviations of the poles of all orders, in the order of `pole_table`.

    Raises
    ------
    EstimateError
        When the functions hold no scatter between blocks.
    """
    if correlations.blocks < 2:
        raise EstimateError(f"{correlations.blocks} blocks show no scatter; at least 2 are needed for error bars")
    propagation = ErrorPropagation(correlations, decomposition)
    moved = [propagation.poles(model) for model in models]
    poles = [continuous(model.eigenvalue, decomposition.sample_rate_hz) for model in models]
    none = np.zeros((0, correlations.blocks), dtype=np.complex128)
    return pole_deviations(np.concatenate([none[:, 0], *poles]), np.concatenate([none, *moved]))


def student_factor(blocks: int) -> float:
    """Factor that makes 1.96 sigma a 95 % interval when sigma itself is estimated from so many blocks.

    Examples
    --------
    >>> round(student_factor(51), 3)
    1.025
    """
    return float(stdtrit(blocks - 1, 0.975) / ndtri(0.975))


def shape_std(deviations: Complex) -> Complex:
    """One sigma of the real part + j one sigma of the imaginary part, from deviations ``[..., block]``."""
    real = np.sqrt(np.sum(deviations.real**2, axis=-1))
    imag = np.sqrt(np.sum(deviations.imag**2, axis=-1))
    return np.asarray(real + 1j * imag, dtype=np.complex128)


def _shifted(rows: Complex, eigenvalue: Complex, channels: int) -> Complex:
    """Rows over O down less `eigenvalue` times rows over O up, as rows over O."""
    whole = np.zeros((rows.shape[0], rows.shape[1] + channels), dtype=np.complex128)
    whole[:, channels:] = rows
    whole[:, : rows.shape[1]] -= eigenvalue[:, None] * rows
    return whole


def _normalised(shape: Complex, moved: Complex) -> Complex:
    """Deviations of shape over its largest component."""
    largest = int(np.argmax(np.abs(shape)))
    relative = shape / shape[largest]
    result = (moved - relative[:, None] * moved[largest]) / shape[largest]
    # By convention that component is 1 exactly.
    result[largest] = 0
    return np.asarray(result, dtype=np.complex128)

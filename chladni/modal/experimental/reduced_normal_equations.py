"""Normal equations of a matrix-fraction fit of frequency responses, reduced to the denominator."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from chladni.modal.experimental.line_weights import WeightedLines
from chladni.modal.experimental.unit_circle import UnitCircle
from chladni.signals.arrays import Complex, Real

# Powers of z on an arc are nearly dependent, more so on lines with gaps: this part of the mean diagonal keeps the
# numerators' matrix positive definite above rounding.
NUMERATOR_RIDGE = 1e-13
# Without noise the denominator's matrix is singular, and any of many denominators fits. A ridge just above rounding
# picks the shortest, whose surplus poles are unstable as they are under noise (Kumaresan and Tufts 1982).
DENOMINATOR_RIDGE = 3e-13
# Complex numbers held for one chunk of responses: 64 MB.
CHUNK = 4_000_000
# All of the noise that fits under the data would make the least-squares fit a total one, consistent but with noise
# poles on both sides; four fifths leave a fifth of the bias and keep them apart.
NOISE_SHARE = 0.8
# Lines with gaps leave the noise matrix nearly singular; this part of its mean diagonal bounds its inverse.
NOISE_RIDGE = 1e-6


def reduced_normal_matrix(lines: WeightedLines, circle: UnitCircle, order: int) -> Complex:
    """Assemble M, whose quadratic form is the least-squares cost of a denominator with the best numerators.

    Parameters
    ----------
    lines
        Frequency responses and their weights.
    circle
        Where the lines lie.
    order
        Of denominator and numerators.

    Returns
    -------
    ``[(order + 1) references, (order + 1) references]``, hermitian positive definite. Its leading blocks belong to
    the lower orders of the denominator, with numerators of the full order.

    Notes
    -----
    The right matrix fraction H(z) A(z) = B(z) with A = sum alpha_r z^r, B_o = sum beta_or z^r, is linear in the
    coefficients; for each output o the normal equations have the blocks R_o, S_o, T_o, and eliminating the
    numerators leaves M = sum_o T_o - S_o^H R_o^-1 S_o (Guillaume et al. 2003). On lines at
    z = exp(j angle) every block depends on the difference of its row and column only and is read off one FFT
    (Cauberghe 2004). Most of what noise of the known std contributes is taken off, see
    `without_noise`.
    """
    # Numerators keep the full order at every order of the denominator: they only take lags at the end of the circle,
    # where little is left of any mode, and one matrix then serves all orders.
    power = lines.weight**2
    references = lines.values.shape[1]
    # Sum over the responses before the FFT: there are references^2 of these, however many responses.
    squares = np.zeros((references, *lines.values.shape[1:]), dtype=np.complex128)
    eliminated = np.zeros(((order + 1) * references,) * 2, dtype=np.complex128)
    for part in _chunks(lines.weight.shape[0], references * max((order + 1) ** 2, circle.length)):
        values = lines.values[part]
        weighted = power[part, None] * values
        squares += np.einsum("oik,ojk->ijk", values.conj(), weighted)
        eliminated += _eliminated(circle, power[part], circle.moments(weighted, order))
    blocks = _toeplitz(circle.moments(squares, order), order)
    matrix = np.array(blocks.transpose(2, 0, 3, 1), order="C").reshape(eliminated.shape)
    diagonal = np.diag_indices_from(matrix)
    ridge = DENOMINATOR_RIDGE * matrix[diagonal].real
    matrix -= eliminated
    matrix = without_noise((matrix + matrix.conj().T) / 2, lines, circle, order)
    matrix[diagonal] += ridge
    return matrix


def _toeplitz(moments: Complex, order: int) -> Complex:
    """``[..., row, column]`` with the moment of lag row - column, from ``[..., lag]``; a view."""
    return sliding_window_view(moments, order + 1, axis=-1)[..., ::-1]


def _chunks(responses: int, numbers: int) -> list[slice]:
    """Cut the responses so that no more than a chunk's numbers are held at once, so many for each."""
    size = max(1, CHUNK // numbers)
    return [slice(start, start + size) for start in range(0, responses, size)]


def _eliminated(circle: UnitCircle, power: Real, moments: Complex) -> Complex:
    """Sum over the responses of S^H R^-1 S, by the Cholesky factors of R."""
    responses, order = len(moments), moments.shape[-1] // 2
    share, common = _common_power(power)
    if common is None:
        factor = _factors(_toeplitz(circle.moments(power, order), order))
        cross = _toeplitz(moments, order)
        stacked = np.array(cross.transpose(0, 2, 3, 1), order="C").reshape(responses, order + 1, -1)
        for response in range(responses):
            _solve_in_place(factor[response], stacked[response])
        return _gram(stacked.reshape(responses * (order + 1), -1))
    # Responses weighted alike share R, up to a factor that goes into S.
    factor = _factors(_toeplitz(circle.moments(common[None], order), order))
    cross = _toeplitz(moments / np.sqrt(share)[:, None, None], order)
    wide = np.array(cross.transpose(2, 0, 3, 1), order="C")
    _solve_in_place(factor[0], wide.reshape(order + 1, -1))
    return _gram(wide.reshape((order + 1) * responses, -1))


def _common_power(power: Real) -> tuple[Real, Real | None]:
    """Factor of each response and the lines' weights they share, None when they differ by more than rounding."""
    total = power.sum(axis=1)
    share = np.where(total > 0, total, 1.0)
    common = power[np.argmax(total)] / share[np.argmax(total)]
    alike = bool(np.all(total > 0)) and np.allclose(power / share[:, None], common, rtol=1e-12, atol=0)
    return share, common if alike else None


def _factors(numerators: Complex) -> Complex:
    """Lower Cholesky factors of matrices ``[response, row, row]``, kept positive definite."""
    matrix = numerators.copy()
    diagonal = np.einsum("orr->or", matrix)
    # A response without a usable line has R = 0 and S = 0: any positive diagonal makes it vanish.
    diagonal += np.where(diagonal.real > 0, NUMERATOR_RIDGE * diagonal.real, 1.0)
    return np.asarray(np.linalg.cholesky(matrix), dtype=np.complex128)


def _solve_in_place(factor: Complex, right: Complex) -> None:
    """Replace `right` by factor^-1 right; both are rows in memory, which BLAS sees as their transposes."""
    from scipy.linalg.blas import ztrsm

    ztrsm(1.0, factor.T, right.T, side=1, lower=0, overwrite_b=1)


def _gram(tall: Complex) -> Complex:
    """``tall^H tall``, half of which BLAS computes."""
    from scipy.linalg.blas import zherk

    upper = zherk(1.0, tall.T)
    return np.asarray(upper.T + np.triu(upper, 1).conj())


def without_noise(matrix: Complex, lines: WeightedLines, circle: UnitCircle, order: int) -> Complex:
    """Take the expected contribution of noise off a reduced normal matrix, as far as it stays positive definite.

    Noise of H enters the quadratic form of A as if each line carried A itself, so that a small A, with roots off the
    circle and too much damping or none, looks best. With N its expectation, M - 0.8 lambda N is used, where lambda is
    the smallest generalised eigenvalue of (M, N), about 1 for the right std, whose scale hence doesn't matter
    (between the least-squares and the generalised total least-squares estimates of Verboven 2002).
    """
    if not np.any(lines.noise_power):
        return matrix
    from scipy.linalg import eigh, toeplitz

    references = lines.reference_scale.size
    noise = np.zeros_like(matrix)
    for reference, moments in enumerate(circle.moments(lines.noise_power, order)):
        noise[reference::references, reference::references] = toeplitz(moments[order:], moments[order::-1])
    diagonal = np.diag_indices_from(noise)
    noise[diagonal] += NOISE_RIDGE * np.mean(noise[diagonal].real)
    smallest = eigh(matrix, noise, eigvals_only=True, subset_by_index=(0, 0), check_finite=False)[0]
    # Exact data under a std that isn't theirs have an eigenvalue of zero, up to rounding.
    return np.asarray(matrix - NOISE_SHARE * max(smallest, 0.0) * noise)

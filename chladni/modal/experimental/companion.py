"""Denominators of all orders, and their roots."""

from collections.abc import Iterator

import numpy as np

from chladni.signals.arrays import Complex


def denominators(matrix: Complex, references: int, orders: range) -> Iterator[Complex]:
    """Solve for the coefficients alpha_1 to alpha_k of each order k, alpha_0 being the identity.

    Parameters
    ----------
    matrix
        Reduced normal matrix of the highest order.
    references
        Size of its blocks.
    orders
        Rising.

    Yields
    ------
    ``[k, reference, reference]``.

    Raises
    ------
    numpy.linalg.LinAlgError
        When the matrix isn't positive definite.

    Notes
    -----
    With the Cholesky factor L of M without its first block row and column, and y = -L^-1 M_10, the coefficients of
    order k are the leading part of L^-H times that of y: one factorisation serves every order.

    With alpha_0 fixed, the roots z that only model noise lie outside the unit circle, that is among unstable poles,
    while fixing alpha_k would draw them inside (Cauberghe, Guillaume, Verboven, Vanlanduit and Parloo 2005).
    """
    from scipy.linalg import solve_triangular

    # The inverse of a triangle starts with the inverses of all its leading blocks.
    factor = np.linalg.cholesky(matrix[references:, references:])
    inverse = solve_triangular(factor, np.eye(len(factor)), lower=True, check_finite=False)
    right = -inverse @ matrix[references:, :references]
    for order in orders:
        size = order * references
        yield (inverse[:size, :size].conj().T @ right[:size]).reshape(order, references, references)


def stable_roots(coefficients: Complex, *, beyond: float = 0.0) -> Complex:
    """Roots z of det(I + sum alpha_r z^r) within the unit circle, or so little `beyond` it.

    Parameters
    ----------
    coefficients
        ``[k, reference, reference]`` alpha_1 to alpha_k.
    beyond
        Largest log of abs(z).

    Notes
    -----
    1/z are the eigenvalues of the block companion matrix of alpha_1 to alpha_k, which is monic: no coefficient is
    divided by.
    """
    order, references = coefficients.shape[:2]
    companion = np.zeros((order * references, order * references), dtype=np.complex128)
    # Transposed blocks have the same determinant.
    companion[:references] = -coefficients.transpose(2, 0, 1).reshape(references, -1)
    below = np.arange((order - 1) * references)
    companion[below + references, below] = 1
    # Only eigenvalues: few of the roots are physical, and their vectors follow from A itself at less cost.
    inverse = np.linalg.eigvals(companion)
    return np.asarray(1 / inverse[np.abs(inverse) > np.exp(-beyond)])


def participation(coefficients: Complex, roots: Complex) -> Complex:
    """Row vectors L with L A(z) = 0 at each root: how strongly each reference drives that pole.

    Returns
    -------
    ``[root, reference]`` of length 1.

    Notes
    -----
    H = B A^-1, and near a root A^-1 is v L/(z - root), so that the residue's row space is L.
    """
    order, references = coefficients.shape[:2]
    if references == 1:
        return np.ones((roots.size, 1), dtype=np.complex128)
    powers = roots[:, None] ** np.arange(1, order + 1)
    value = np.eye(references) + np.tensordot(powers, coefficients, axes=1)
    left = np.linalg.svd(value)[0]
    return np.asarray(left[:, :, -1].conj())

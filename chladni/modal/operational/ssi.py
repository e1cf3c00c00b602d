"""Covariance-driven stochastic subspace identification: poles and shapes of models of all orders."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import qr, solve_triangular, svd

from chladni.modal.operational.correlation import CorrelationFunctions
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.value import Value

# White noise of sensors is correlated with itself at lag 0 only, so that the first lag used is 1.
FIRST_LAG = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SubspaceDecomposition(Value):
    """Singular vectors of the block Hankel matrix H_ij = R_(i+j+1) of correlation functions in units of one sigma.

    Attributes
    ----------
    left
        ``[row, order]`` left singular vectors, rows by lag, then channel: the observability matrix in one of its
        bases.
    singular
        ``[order]`` singular values, falling.
    right
        ``[column, order]`` right singular vectors, by lag, then reference.
    block_rows
        Lags in `left` and in `right`.
    scale
        ``[channel]`` what one sigma of each channel is, in its own unit.
    sample_rate_hz
        One over the step between lags.
    """

    left: Real
    singular: Real
    right: Real
    block_rows: int
    scale: Real
    sample_rate_hz: float

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def channels(self) -> int:
        """Rows of the matrix for one lag."""
        return int(self.scale.size)

    @property
    def rank(self) -> int:
        """Orders whose singular vectors are determined."""
        floor = self.singular[:1] * self.left.shape[0] * np.finfo(np.float64).eps
        return int(np.count_nonzero(self.singular > floor))


class OrderModel:
    """Poles of the model of one order, and what their sensitivities are computed from when they're asked for.

    Attributes
    ----------
    order
        Number of states n.
    eigenvalues, vectors
        ``[state]`` and ``[state, state]``: all eigenvalues of A and its right eigenvectors.
    kept
        ``[pole]`` those inside the unit circle with a positive imaginary part.
    """

    def __init__(self, inverse: Real, basis: Real, shifted: Real) -> None:
        self.order = int(inverse.shape[0])
        self._inverse, self._basis = inverse, basis
        state = inverse @ shifted
        eigenvalues, vectors = np.linalg.eig(state)
        self.eigenvalues, self.vectors = eigenvalues.astype(np.complex128), vectors.astype(np.complex128)
        self.kept = np.flatnonzero((self.eigenvalues.imag > 0) & (np.abs(self.eigenvalues) < 1))

    @property
    def eigenvalue(self) -> Complex:
        """``[pole]`` eigenvalue of A of each pole."""
        return np.asarray(self.eigenvalues[self.kept], dtype=np.complex128)

    @property
    def right(self) -> Complex:
        """``[state, pole]`` its right eigenvector."""
        return np.asarray(self.vectors[:, self.kept], dtype=np.complex128)

    @cached_property
    def left_vectors(self) -> Complex:
        """``[state, state]`` left eigenvectors of A, their product with `vectors` 1."""
        return np.asarray(np.linalg.inv(self.vectors), dtype=np.complex128)

    @cached_property
    def pseudo_inverse(self) -> Real:
        """``[state, row]`` of the upper block rows of O."""
        return self._inverse @ self._basis.T


def decompose(
    correlations: CorrelationFunctions, *, block_rows: int, max_order: int | None = None
) -> SubspaceDecomposition:
    """Decompose the block Hankel matrix of correlation functions, once for all model orders.

    Parameters
    ----------
    correlations
        With lags up to ``2 * block_rows - 1`` at least. Each channel counts in units of its own sigma, so that
        channels of different units and levels weigh the same.
    block_rows
        Lags in the rows and in the columns of the matrix, at least 2.
    max_order
        Largest model order, at most ``(block_rows - 1) * channels`` and ``block_rows * references``; None for that.

    Raises
    ------
    EstimateError
        When lags are missing or a channel doesn't vary.
    SetupError
        When a number is out of its range.

    Notes
    -----
    Reference-based, Peeters & De Roeck (1999), Mech. Syst. Signal Process. 13, eqs. 17 to 21.
    """
    channels, references = correlations.values.shape[1:]
    _require_lags(correlations, block_rows)
    limit = min((block_rows - 1) * channels, block_rows * references)
    order = limit if max_order is None else max_order
    if not 1 <= order <= limit:
        raise SetupError(
            f"max_order {order} must be from 1 to {limit}: {block_rows} block rows of {channels} channels and "
            f"{references} references hold no more; take more block rows or a lower order"
        )
    scale = _scale(correlations)
    hankel = block_hankel(correlations.values / scale[:, None] / scale[correlations.references], block_rows)
    left, singular, right = svd(hankel, full_matrices=False, overwrite_a=True, check_finite=False)
    return SubspaceDecomposition(
        left=left[:, :order],
        singular=singular[:order],
        right=right[:order].T,
        block_rows=block_rows,
        scale=scale,
        sample_rate_hz=correlations.sample_rate_hz,
    )


def block_hankel(functions: Real, block_rows: int) -> Real:
    """Give ``[row, column]`` with R_(i+j+1) as block i, j, from ``[lag, channel, reference]``."""
    rows = np.arange(block_rows)
    blocks = functions[FIRST_LAG + rows[:, None] + rows]
    channels = functions.shape[1]
    return np.asarray(blocks.transpose(0, 2, 1, 3).reshape(block_rows * channels, -1), dtype=np.float64)


def order_models(decomposition: SubspaceDecomposition, orders: Sequence[int]) -> Iterator[OrderModel]:
    """Give the model of each order, from one QR decomposition for all of them.

    Orders beyond the rank of the Hankel matrix give nothing.

    Notes
    -----
    With O up = Q R, the least-squares A of order n is R_n^-1 (Q^T O down)_n, where _n takes the leading n rows and
    columns: Doehler & Mevel (2012), Control Eng. Pract. 20, section 4.
    """
    wanted = [order for order in orders if order <= decomposition.rank]
    if not wanted:
        return
    observability = decomposition.left[:, : max(wanted)]
    upper, lower = observability[: -decomposition.channels], observability[decomposition.channels :]
    basis, triangle = (np.asarray(part, dtype=np.float64) for part in qr(upper, mode="economic", check_finite=False))
    shifted = basis.T @ lower
    # The inverse of a triangle's corner is the corner of its inverse: one solution serves all orders. NumPy and SciPy
    # bring a BLAS each, whose waiting threads would fight for the cores if each order went through both.
    inverse = solve_triangular(triangle, np.eye(len(triangle)), check_finite=False)
    for order in wanted:
        corner = slice(order), slice(order)
        yield OrderModel(inverse[corner], basis[:, :order], shifted[corner])


def continuous(eigenvalue: Complex, sample_rate_hz: float) -> Complex:
    """Poles in rad/s of eigenvalues of the discrete model."""
    return np.asarray(np.log(eigenvalue) * sample_rate_hz, dtype=np.complex128)


def shapes_of(decomposition: SubspaceDecomposition, model: OrderModel) -> Complex:
    """``[pole, channel]`` shapes of length 1, in the channels' own units."""
    top = decomposition.left[: decomposition.channels, : model.order]
    shapes = (top @ model.right).T * decomposition.scale
    return np.asarray(shapes / np.linalg.norm(shapes, axis=1, keepdims=True), dtype=np.complex128)


def subspace_poles(
    correlations: CorrelationFunctions, *, block_rows: int, orders: Sequence[int] | None = None
) -> PoleTable:
    """Find the poles and shapes of models of all orders, without their uncertainty.

    Parameters
    ----------
    correlations
        With lags up to ``2 * block_rows - 1`` at least.
    block_rows
        Lags in the rows and in the columns of the Hankel matrix.
    orders
        Model orders, rising; None for 2, 4, 6, ... up to the largest that the matrix holds or 60.

    Returns
    -------
    PoleTable
        With shapes of length 1 as vectors, in the channels' own units.

    Raises
    ------
    EstimateError, SetupError
        See `decompose`.

    Notes
    -----
    Van Overschee & De Moor (1996), Subspace identification for linear systems, chapter 3; Peeters & De Roeck (1999).

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> lag = np.arange(21)
    >>> decay = np.exp(-0.05 * lag) * np.cos(0.5 * lag)
    >>> exact = CorrelationFunctions(
    ...     values=decay[:, None, None], deviations=np.zeros((2, 21, 1, 1)), variance=np.ones(1),
    ...     sample_rate_hz=1.0, channels=(Channel(name="a"),), references=np.zeros(1, int), samples=1000,
    ... )
    >>> subspace_poles(exact, block_rows=10, orders=[2]).pole.round(6)
    array([-0.05+0.5j])
    """
    channels, references = correlations.values.shape[1:]
    if orders is None:
        orders = range(2, min(60, (block_rows - 1) * channels, block_rows * references) + 1, 2)
    decomposition = decompose(correlations, block_rows=block_rows, max_order=max(orders, default=0))
    models = list(order_models(decomposition, orders))
    return pole_table(decomposition, models, orders)


def pole_table(
    decomposition: SubspaceDecomposition,
    models: Sequence[OrderModel],
    orders: Sequence[int],
    *,
    frequency_std_hz: Real | None = None,
    damping_std: Real | None = None,
) -> PoleTable:
    """Gather the poles of all models."""
    poles = [continuous(model.eigenvalue, decomposition.sample_rate_hz) for model in models]
    none = np.zeros((0, decomposition.channels), dtype=np.complex128)
    return PoleTable(
        orders=np.array(orders, dtype=np.int64),
        order=np.repeat(np.array([model.order for model in models], dtype=np.int64), [pole.size for pole in poles]),
        pole=np.concatenate([np.zeros(0, dtype=np.complex128), *poles]),
        vector=np.concatenate([none, *(shapes_of(decomposition, model) for model in models)]),
        frequency_std_hz=frequency_std_hz,
        damping_std=damping_std,
    )


def _require_lags(correlations: CorrelationFunctions, block_rows: int) -> None:
    if block_rows < 2:
        raise SetupError(f"block_rows {block_rows} must be at least 2")
    if correlations.lags < 2 * block_rows - 1:
        raise EstimateError(
            f"{block_rows} block rows need correlations up to lag {2 * block_rows - 1}, but they end at lag "
            f"{correlations.lags}; compute more lags or take fewer block rows"
        )


def _scale(correlations: CorrelationFunctions) -> Real:
    constant = np.flatnonzero(~(correlations.variance > 0))
    if constant.size:
        names = ", ".join(correlations.channels[row].name for row in constant)
        raise EstimateError(f"channel {names} doesn't vary, so that it correlates with nothing; leave it out")
    return np.asarray(np.sqrt(correlations.variance), dtype=np.float64)

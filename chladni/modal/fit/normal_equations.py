"""Weighted normal equations of the modal model, for every response at once."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real

# Products of basis functions that are held at once, in numbers (32 MB).
LARGEST_TABLE = 2**22
# Multiplications that a set of Gram matrices may take (some seconds); beyond it weights are averaged over neighbours.
LARGEST_WORK = 2**34
# Largest set of Gram matrices held at once, in numbers.
LARGEST_BATCH = 2**23
# Weights that differ by less, relative to each other, differ by rounding.
ALIKE = 1e-12
# Directions weaker than this, relative to the strongest, can't be told from rounding.
WEAKEST = 1e-13
# A matrix whose weakest direction is this much stronger is inverted at a fifth of the cost of looking at directions.
WELL_ABOVE = 1e4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeightCourse:
    """What the weights of all functions have in common along the lines, and how many lines are taken together.

    Weights differ from function to function, products of basis functions don't: the Gram matrices of all functions
    are one matrix product of weights and products. Blocks are single lines unless that would take too long; then a
    function's weights, over the profile that all functions have in common, are averaged within a block. That alters
    the curvature that steps and error bars come from, and the solution not at all. Where the weights of all functions
    are the profile up to a factor, one block of all lines is exact.

    Attributes
    ----------
    profile
        ``[line]``.
    block
        Lines in a block.
    """

    profile: Real
    block: int

    def summed(self, lines: Real) -> Real:
        """``[..., block]`` sums over the lines of each block."""
        if self.block == 1:
            return lines
        starts = np.arange(0, self.profile.size, self.block)
        return np.asarray(np.add.reduceat(lines, starts, axis=-1), dtype=np.float64)

    def batches(self, responses: int, references: int, columns: int) -> list[slice]:
        """Cut the responses so that their Gram matrices fit in memory."""
        size = max(1, LARGEST_BATCH // (references * columns**2))
        return [slice(first, min(first + size, responses)) for first in range(0, responses, size)]

    def gram(self, functions: Complex, weights: Real) -> Real:
        """Give ``[..., column, column]`` Re(sum of w conj(P_a) P_b) from ``[column, line]`` and ``[..., line]``."""
        columns = len(functions)
        profile, means = self.summed(self.profile), self.summed(weights)
        means = np.divide(means, profile, out=np.zeros_like(means), where=profile > 0)
        scaled = functions * np.sqrt(self.profile)
        rows, others = np.triu_indices(columns)
        upper = np.zeros((*weights.shape[:-1], rows.size))
        step = max(1, LARGEST_TABLE // rows.size)
        for first in range(0, means.shape[-1], step):
            part = scaled[:, first * self.block : (first + step) * self.block]
            products = _line_products(part) if self.block == 1 else _block_products(part, self.block)
            upper += means[..., first : first + step] @ products.T
        place = np.empty((columns, columns), dtype=np.intp)
        place[rows, others] = place[others, rows] = np.arange(rows.size)
        return np.take(upper, place, axis=-1)


def weight_course(weights: Real, modes: int) -> WeightCourse:
    """Plan the Gram matrices of so many modes and their slopes for weights ``[response, reference, line]``."""
    lines = weights.shape[-1]
    strongest = weights.max(axis=-1, keepdims=True)
    used = strongest[..., 0] > 0
    courses = weights[used] / strongest[used]
    profile = courses.mean(axis=0) if len(courses) else np.zeros(lines)
    if np.all(np.abs(courses - profile) <= ALIKE * profile):
        return WeightCourse(profile=profile, block=lines)
    # Shapes have fewer functions than slopes. Blocks of the same size keep what is left of the curvature positive.
    columns = 4 * modes + 4
    return WeightCourse(profile=profile, block=-(-weights.size * columns * (columns + 1) // (2 * LARGEST_WORK)))


def _line_products(functions: Complex) -> Real:
    """``[pair, line]`` Re(conj(P_a) P_b), for the pairs of `numpy.triu_indices`."""
    columns, lines = functions.shape
    real, imag = np.ascontiguousarray(functions.real), np.ascontiguousarray(functions.imag)
    products = np.empty((columns * (columns + 1) // 2, lines))
    first = 0
    for row in range(columns):
        pairs = products[first : first + columns - row]
        np.multiply(real[row], real[row:], out=pairs)
        pairs += imag[row] * imag[row:]
        first += columns - row
    return products


def _block_products(functions: Complex, block: int) -> Real:
    """``[pair, block]`` sums of the same over blocks of lines."""
    columns, lines = functions.shape
    blocks = -(-lines // block)
    padded = np.zeros((columns, blocks * block), dtype=np.complex128)
    padded[:, :lines] = functions
    parts = padded.view(np.float64).reshape(columns, blocks, -1).transpose(1, 0, 2)
    rows, others = np.triu_indices(columns)
    return np.ascontiguousarray((parts @ parts.transpose(0, 2, 1))[:, rows, others].T)


def projections(functions: Complex, weighted: Complex) -> Real:
    """Give ``[..., column]``: Re of the sum over lines of conj(P_a) times `weighted` ``[..., line]``."""
    return np.asarray(_parts(weighted) @ _parts(functions).T, dtype=np.float64)


def combinations(coefficients: Real, functions: Complex) -> Complex:
    """Add up functions ``[column, line]`` with real ``coefficients[..., column]``."""
    return np.asarray((coefficients @ _parts(functions)).view(np.complex128), dtype=np.complex128)


def weighted_power(weighted: Complex, values: Complex) -> Real:
    """``[row]`` sum of weight |value|^2, from ``[row, ...]`` weight times value and value."""
    rows = len(values)
    return np.asarray(np.einsum("ik,ik->i", _parts(weighted).reshape(rows, -1), _parts(values).reshape(rows, -1)))


def _parts(values: Complex) -> Real:
    """Re and Im of each line side by side: real products of them cost half of complex ones, and no copy."""
    return np.ascontiguousarray(values).view(np.float64)


def rotated(pairs: Real, factors: Complex) -> Real:
    """Turn columns for Re, Im of a product into columns for Re, Im of its second factor, given the first.

    Parameters
    ----------
    pairs
        ``[..., 2 mode]`` columns (or elements of a gradient) for Re and Im of factor times unknown.
    factors
        ``[..., mode]`` complex; broadcasts.
    """
    # For a = f d: the columns g0, g1 of a give Re(conj(f)(g0 + j g1)) for Re d and Im(...) for Im d.
    whole = np.ascontiguousarray(pairs).view(np.complex128)
    return np.ascontiguousarray(whole * factors.conj()).view(np.float64)


def rotated_rows(matrix: Real, factors: Complex) -> Real:
    """Do the same to the rows of ``[..., 2 mode, column]``."""
    return np.swapaxes(rotated(np.swapaxes(matrix, -1, -2), factors[..., np.newaxis, :]), -1, -2)


def symmetric_inverse(matrices: Real) -> Real:
    """Invert a stack of symmetric non-negative matrices, each scaled to a unit diagonal before.

    Directions that the data say nothing about are left at zero.
    """
    diagonal = np.einsum("...aa->...a", matrices)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scales = scale[..., :, np.newaxis] * scale[..., np.newaxis, :]
    scaled = matrices * scales
    inverse, sure = _plain_inverse(scaled)
    if not np.all(sure):
        inverse[~sure] = _inverse_of_strong(scaled[~sure])
    return np.asarray(inverse * scales, dtype=np.float64)


def _plain_inverse(scaled: Real) -> tuple[Real, Mask]:
    """Invert without looking for weak directions, and tell which matrices surely have none."""
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        # One that is exactly singular stops all.
        return np.zeros_like(scaled), np.zeros(scaled.shape[:-2], dtype=np.bool_)
    # The trace of a positive matrix's inverse bounds the inverse of its least eigenvalue from above.
    bound = np.einsum("...aa->...", np.abs(inverse))
    sure = bound * WELL_ABOVE * WEAKEST * len(scaled.T) < 1
    # Rounding may leave a weak direction with a negative eigenvalue, which shows on the diagonal of the inverse.
    sure &= np.all(np.einsum("...aa->...a", inverse) > 0, axis=-1)
    return (inverse + np.swapaxes(inverse, -1, -2)) / 2, np.asarray(sure)


def _inverse_of_strong(scaled: Real) -> Real:
    strengths, directions = np.linalg.eigh(scaled)
    strong = strengths > WEAKEST * strengths.shape[-1]
    gains = np.where(strong, 1 / np.where(strong, strengths, 1.0), 0.0)
    return np.asarray((directions * gains[..., np.newaxis, :]) @ np.swapaxes(directions, -1, -2), dtype=np.float64)

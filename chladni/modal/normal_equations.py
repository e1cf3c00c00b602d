"""Weighted normal equations of the modal model, for every response at once."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]

# Largest table of products of basis functions, in numbers (32 MB); beyond it weights are averaged over neighbours.
LARGEST_TABLE = 2**22
# Largest set of Gram matrices held at once, in numbers.
LARGEST_BATCH = 2**23
# Directions weaker than this, relative to the strongest, can't be told from rounding.
WEAKEST = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProductTable:
    """Products of all pairs of basis functions, summed over blocks of neighbouring lines.

    Weights differ from function to function, products don't: with the table, the Gram matrices of all functions are
    one matrix product. Blocks are single lines unless the table would be too large; then a function's weights, over
    the profile that all functions have in common, are averaged within a block. That alters the curvature that steps
    and error bars come from a little, and the solution not at all.

    Attributes
    ----------
    products
        ``[block, column, column]`` Re(conj(P_a) P_b) times the profile.
    profile
        ``[line]`` common course of the weights.
    block
        Lines in a block.
    """

    products: Floats
    profile: Floats
    block: int

    @property
    def columns(self) -> int:
        """Number of basis functions."""
        return int(self.products.shape[-1])

    def batches(self, responses: int, references: int) -> list[slice]:
        """Cut the responses so that their Gram matrices fit in memory."""
        size = max(1, LARGEST_BATCH // (references * self.columns**2))
        return [slice(first, min(first + size, responses)) for first in range(0, responses, size)]

    def gram(self, weights: Floats) -> Floats:
        """Give ``[..., column, column]`` from weights ``[..., line]``."""
        blocks = len(self.products)
        ratios = np.divide(weights, self.profile, out=np.zeros_like(weights), where=self.profile > 0)
        if self.block == 1:
            means = ratios
        else:
            padded = np.zeros((*weights.shape[:-1], blocks * self.block))
            padded[..., : weights.shape[-1]] = ratios
            # The last block may be short; its missing lines count for nothing.
            sizes = np.minimum(self.block, weights.shape[-1] - self.block * np.arange(blocks))
            means = padded.reshape(*weights.shape[:-1], blocks, self.block).sum(axis=-1) / sizes
        table = self.products.reshape(blocks, -1)
        return np.asarray((means @ table).reshape(*weights.shape[:-1], self.columns, self.columns), dtype=np.float64)


def product_table(functions: Complex, weights: Floats) -> ProductTable:
    """Tabulate the products of basis functions ``[column, line]`` for weights ``[response, reference, line]``."""
    columns, lines = functions.shape
    strongest = weights.max(axis=-1, keepdims=True)
    profile = np.mean(np.divide(weights, strongest, out=np.zeros_like(weights), where=strongest > 0), axis=(0, 1))
    block = max(1, -(-lines * columns**2 // LARGEST_TABLE))
    blocks = -(-lines // block)
    padded = np.zeros((columns, blocks * block), dtype=np.complex128)
    padded[:, :lines] = functions * np.sqrt(profile)
    parts = padded.reshape(columns, blocks, block).transpose(1, 2, 0)
    stacked = np.concatenate([parts.real, parts.imag], axis=1)
    return ProductTable(products=stacked.transpose(0, 2, 1) @ stacked, profile=profile, block=block)


def projections(functions: Complex, weighted: Complex) -> Floats:
    """Give ``[..., column]``: Re of the sum over lines of conj(P_a) times `weighted` ``[..., line]``."""
    rows = weighted.reshape(-1, weighted.shape[-1])
    answer = rows.real @ functions.real.T + rows.imag @ functions.imag.T
    return np.asarray(answer.reshape(*weighted.shape[:-1], len(functions)), dtype=np.float64)


def rotated(pairs: Floats, factors: Complex) -> Floats:
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


def rotated_rows(matrix: Floats, factors: Complex) -> Floats:
    """Do the same to the rows of ``[..., 2 mode, column]``."""
    return np.swapaxes(rotated(np.swapaxes(matrix, -1, -2), factors[..., np.newaxis, :]), -1, -2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SymmetricSolver:
    """Inverse of each of a stack of symmetric positive matrices, scaled to a unit diagonal before.

    Attributes
    ----------
    inverse
        ``[..., row, row]``; directions that the data say nothing about are left at zero.
    deficient
        ``[...]`` how many such directions there are.
    """

    inverse: Floats
    deficient: NDArray[np.int64]


def symmetric_inverse(matrices: Floats) -> SymmetricSolver:
    """Invert a stack of symmetric non-negative matrices."""
    diagonal = np.einsum("...aa->...a", matrices)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    scaled = matrices * scale[..., :, np.newaxis] * scale[..., np.newaxis, :]
    strengths, directions = np.linalg.eigh(scaled)
    strong = strengths > WEAKEST * strengths.shape[-1]
    gains = np.where(strong, 1 / np.where(strong, strengths, 1.0), 0.0)
    inverse = (directions * gains[..., np.newaxis, :]) @ np.swapaxes(directions, -1, -2)
    return SymmetricSolver(
        inverse=inverse * scale[..., :, np.newaxis] * scale[..., np.newaxis, :],
        deficient=np.count_nonzero(~strong, axis=-1),
    )

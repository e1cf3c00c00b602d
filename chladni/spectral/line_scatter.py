"""The noise of a function that came without its error: what its lines jump by from one to the next."""

from math import comb

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real

# Orders of differences from line to line: a curve of few lines adds least to low ones, one of many to high ones.
DIFFERENCES = (2, 3, 4, 5)
# Neighbours that know a median to a tenth.
SCATTER_LINES = 64


def std_or_scatter(values: NDArray[np.complexfloating], std: Real) -> Real:
    """``[..., line]`` std of functions; one that has none has the scatter from line to line instead.

    A file holds functions without std, coherence or averages, a single average knows none, and a model's functions
    have no error at all. What their lines jump by bounds their noise from above.
    """
    blind = ~np.isfinite(std).any(axis=-1, keepdims=True)
    return np.where(blind, line_scatter(values), std) if blind.any() else std


def line_scatter(values: NDArray[np.complexfloating]) -> Real:
    """``[..., line]`` std of the real and of the imaginary part of complex noise on smooth functions.

    The n-th difference of noise has binom(2n, n) times its variance, and the median of squares of complex noise is
    ln 2 of their mean and doesn't see the few lines in a sharp peak. What curves adds to it, so that the least of
    several orders is the nearest. Medians are those of `SCATTER_LINES` neighbours, since noise grows where a hammer
    drives less. Infinite where there are too few lines.

    Examples
    --------
    >>> line = np.arange(50)
    >>> noise = np.random.default_rng(1).standard_normal((2, 50)) * 0.01
    >>> float(line_scatter(1 / (line - 20.3 - 0.01j) + noise[0] + 1j * noise[1])[0].round(2))
    0.01
    """
    lines = values.shape[-1]
    found = [
        _course(np.abs(np.diff(values, n=order, axis=-1)) ** 2, lines) / (2 * comb(2 * order, order) * np.log(2))
        for order in DIFFERENCES
        if lines > order
    ]
    return np.sqrt(np.min(found, axis=0)) if found else np.full(values.shape, np.inf)


def _course(squares: Real, lines: int) -> Real:
    """``[..., line]`` medians of neighbours, block by block and straight lines between their middles."""
    blocks = np.array_split(squares, max(squares.shape[-1] // SCATTER_LINES, 1), axis=-1)
    medians = np.stack([np.median(block, axis=-1) for block in blocks], axis=-1)
    middles = (np.arange(len(blocks)) + 0.5) * lines / len(blocks)
    return np.apply_along_axis(lambda levels: np.interp(np.arange(lines), middles, levels), -1, medians)

"""Frequency response at every point of a scheme, exact for improper blocks and dead time."""

from collections.abc import Sequence
from math import pi

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.elements.element import Element
from chladni.models.schemes.block import Block
from chladni.models.schemes.points import Point
from chladni.models.schemes.wiring import Wiring, wired
from chladni.signals.arrays import Complex, Index, Real

# Numbers of one batch of matrices: 64 MB of complex ones.
_BATCH = 4_000_000


def point_response(
    blocks: Sequence[Block], inputs: Sequence[Terminal], points: Sequence[Point], frequency_hz: Real
) -> Complex:
    """Give ``[point, input, frequency]``.

    With N and D the blocks' numerators and denominators, ``(D - N K) v = N L u`` is solved for every frequency:
    unlike ``(I - H K) v = H L u`` it stays finite where a block has a pole (an integrator at 0 Hz) and the loop none.
    """
    wiring = wired(blocks, inputs)
    out = np.empty((len(points), len(inputs), frequency_hz.size), dtype=np.complex128)
    lines = max(1, _BATCH // len(blocks) ** 2)
    for start in range(0, frequency_hz.size, lines):
        part = slice(start, start + lines)
        above, below = _fractions(blocks, frequency_hz[part])
        matrix = -above[:, :, None] * wiring.blocks
        diagonal = np.arange(len(blocks))
        matrix[:, diagonal, diagonal] += below
        behind = _solved(matrix, above[:, :, None] * wiring.inputs)
        for row, point in enumerate(points):
            found = _entering(wiring, point.block, behind) if point.before else behind[:, point.block]
            out[row, :, part] = found.T
    return out


def _entering(wiring: Wiring, block: int, behind: Complex) -> Complex:
    """Sum that enters a block, ``[frequency, input]``, of its own sources only: others may be infinite."""
    sources = np.flatnonzero(wiring.blocks[block])
    # Where infinite signals are subtracted nothing is known.
    with np.errstate(invalid="ignore"):
        added = np.sum(behind[:, sources] * wiring.blocks[block, sources][:, None], axis=1)
    return np.asarray(added + wiring.inputs[block], dtype=np.complex128)


def _fractions(blocks: Sequence[Block], frequency_hz: Real) -> tuple[Complex, Complex]:
    """Numerator and denominator of each block, ``[frequency, block]``, the larger of each pair 1 in size."""
    s = 2j * pi * frequency_hz
    above = np.empty((s.size, len(blocks)), dtype=np.complex128)
    below = np.ones_like(above)
    for column, block in enumerate(blocks):
        acting = block.acting
        # A state space stays as it is: its coefficients would lose digits.
        if isinstance(acting, Element):
            transfer = acting.transfer
            above[:, column] = np.polyval(transfer.num, s) * np.exp(-s * transfer.delay_s)
            below[:, column] = np.polyval(transfer.den, s)
        else:
            above[:, column] = acting.frequency_response(frequency_hz)[0, 0]
    # Rows of like size keep the solution's digits when time constants are of very different size.
    size = np.maximum(np.abs(above), np.abs(below))
    size[size == 0] = 1.0
    return above / size, below / size


def _solved(matrix: Complex, right: Complex) -> Complex:
    """Solve for all frequencies at once; one by one when a frequency is a pole."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.complex128)
    except np.linalg.LinAlgError:
        return np.stack([_solved_line(one, side) for one, side in zip(matrix, right, strict=True)])


def _solved_line(matrix: Complex, right: Complex) -> Complex:
    """Solve loop by loop along the signals' way: what doesn't come from the pole stays finite."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.complex128)
    except np.linalg.LinAlgError:
        pass
    found = np.full_like(right, np.nan)
    for group in _along_the_way(matrix):
        ahead = np.setdiff1d(np.flatnonzero(matrix[group].any(axis=0)), group)
        with np.errstate(invalid="ignore"):
            side = right[group] - np.sum(matrix[np.ix_(group, ahead)][:, :, None] * found[ahead], axis=1)
        try:
            found[group] = np.linalg.solve(matrix[np.ix_(group, group)], side)
        except np.linalg.LinAlgError:
            found[group] = complex(np.inf)
    return found


def _along_the_way(matrix: Complex) -> list[Index]:
    """Groups of unknowns that depend on each other, each after those that it depends on."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(matrix != 0, directed=True, connection="strong")
    needs = [set(label[matrix[label == group].any(axis=0)]) - {group} for group in range(count)]
    order: list[int] = []
    while len(order) < count:
        order += [group for group in range(count) if group not in order and needs[group] <= set(order)]
    return [np.flatnonzero(label == group) for group in order]

"""Whether a pole found in one half of a record explains the other half."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.modal.operational.correlation import CorrelationFunctions
from chladni.modal.operational.ssi import block_hankel, decompose, order_models, pole_table
from chladni.modal.poles.pole_selection import PoleSelection
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Real, Whole

# Orders looked at: more tell the same again.
ORDERS = 10
# A pole of half the record is the same as one of the whole when no further from it than this share of its frequency.
NEAR = 0.02


def replication(
    correlations: CorrelationFunctions,
    table: PoleTable,
    selection: PoleSelection,
    *,
    block_rows: int,
) -> Real:
    """Give for each chosen mode how much of it comes back in data that it was not found in.

    Poles are found anew from every second block. The coefficient of a pole with eigenvectors chi, phi of A is
    c = chi^H U^T H' V S^-1 phi, where U, S, V decompose the Hankel matrix of these blocks and H' is that of the
    others: with H' = H it is 1 exactly. What is a property of the structure comes back as 1 give or take its scatter;
    what a rich model made of the scatter of one half has nothing to do with the scatter of the other, and comes back
    near 0 however sure its poles look and however many orders show it.

    Returns
    -------
    ndarray
        ``[mode]`` the lesser of both directions, each the median over the orders that hold the mode.
    """
    orders = _some(np.unique(table.order[selection.member >= 0]))
    even, odd = _halves(correlations)
    directions = [
        _coefficients(correlations, one, other, block_rows, orders) for one, other in ((even, odd), (odd, even))
    ]
    scores = [[_score(found, table, selection, mode) for found in directions] for mode in range(selection.row.size)]
    return np.asarray(np.array(scores, dtype=np.float64).reshape(-1, 2).min(axis=1), dtype=np.float64)


def _some(orders: Whole) -> list[int]:
    places = np.unique(np.linspace(0, orders.size - 1, min(ORDERS, orders.size)).round().astype(np.int64))
    return [int(order) for order in orders[places]]


def _halves(correlations: CorrelationFunctions) -> tuple[Real, Real]:
    """Correlation functions of the even and of the odd blocks, taken as equally long."""
    blocks = correlations.blocks
    # Deviations are scaled to the covariance of the mean: this undoes it for the mean of some blocks.
    scale = np.sqrt((blocks - 1) * blocks)
    one, other = (correlations.values + scale * correlations.deviations[half::2].mean(axis=0) for half in (0, 1))
    return one, other


def _coefficients(
    correlations: CorrelationFunctions, own: Real, foreign: Real, block_rows: int, orders: Sequence[int]
) -> tuple[PoleTable, Real]:
    half = replace(correlations, values=own)
    decomposition = decompose(half, block_rows=block_rows, max_order=max(orders, default=1))
    scale = decomposition.scale
    hankel = block_hankel(foreign / scale[:, None] / scale[correlations.references], block_rows)
    core = decomposition.left.T @ hankel @ decomposition.right / decomposition.singular
    models = list(order_models(decomposition, orders))
    found = [
        np.einsum("ps,st,tp->p", model.left_vectors[model.kept], core[: model.order, : model.order], model.right)
        for model in models
    ]
    return pole_table(decomposition, models, orders), np.concatenate([np.zeros(0), *(part.real for part in found)])


def _score(found: tuple[PoleTable, Real], table: PoleTable, selection: PoleSelection, mode: int) -> float:
    halved, coefficients = found
    scores = []
    for row in np.flatnonzero(selection.member == mode):
        if table.order[row] not in halved.orders:
            continue
        same_order = np.flatnonzero(halved.order == table.order[row])
        distance = np.abs(halved.frequency_hz[same_order] / table.frequency_hz[row] - 1)
        near = distance.size > 0 and distance.min() <= NEAR
        scores.append(float(coefficients[same_order[np.argmin(distance)]]) if near else 0.0)
    return float(np.median(scores)) if scores else 0.0

"""Poles that agree over model orders, gathered into clusters with at most one pole of each order."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import SetupError

# Pairs weighed at a time: some hundred megabytes at the most, however many poles there are.
PAIRS_TOGETHER = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusterTolerance:
    """How far two poles of different orders may be apart to be one.

    Attributes
    ----------
    frequency
        Largest difference of natural frequencies over their mean.
    damping
        Largest difference of damping ratios over the greater one.
    vector
        Largest 1 - MAC of the vectors, 0 to 1.
    orders
        Largest distance in the list of orders: what a mode may be missing in between.
    sigmas
        Where the table knows its sigmas, differences within so many of the smaller one are allowed too.
    """

    frequency: float = 0.01
    damping: float = 0.5
    vector: float = 0.15
    orders: int = 6
    sigmas: float = 3.0

    def __post_init__(self) -> None:
        for name in ("frequency", "damping", "vector"):
            if not getattr(self, name) > 0:
                raise SetupError(f"{name} tolerance {getattr(self, name)} must be above 0")
        if self.orders < 1:
            raise SetupError(f"order tolerance {self.orders} must be at least 1")


def cluster_poles(table: PoleTable, rows: Whole, tolerance: ClusterTolerance) -> Whole:
    """Join poles to clusters, the nearest pair first, never two of one order.

    Parameters
    ----------
    table
        All poles.
    rows
        ``[candidate]`` those to be joined.
    tolerance
        Poles further apart are never joined directly.

    Returns
    -------
    ndarray
        ``[candidate]`` cluster of each, numbered from 0.

    Notes
    -----
    Single linkage with the constraint that poles of one order are different poles, which is what keeps close modes
    apart (compare Reynders, Houbrechts & De Roeck 2012, Mech. Syst. Signal Process. 29, section 3).
    """
    if not rows.size:
        return np.zeros(0, np.int64)
    # Position in the list of orders, so that steps of two or five count as one.
    step = np.searchsorted(table.orders, table.order[rows])
    first, second, distance = _near_pairs(table, rows, step, tolerance)
    nearest = np.argsort(distance, kind="stable")
    return _join(step, first[nearest].tolist(), second[nearest].tolist())


def _near_pairs(table: PoleTable, rows: Whole, step: Whole, tolerance: ClusterTolerance) -> tuple[Whole, Whole, Real]:
    """Candidates within the tolerance of each other, and their distance in tolerances."""
    frequency_hz = table.frequency_hz[rows]
    by_frequency = np.argsort(frequency_hz, kind="stable")
    reach = _frequency_reach(table, rows, tolerance)
    # Sorted, the partners of a pole are those that follow it, as far as its own tolerance reaches.
    rising = frequency_hz[by_frequency]
    counts = np.searchsorted(rising, rising + reach[by_frequency], side="right") - np.arange(rising.size) - 1
    found: list[tuple[Whole, Whole, Real]] = []
    for start, stop in _runs(counts):
        left, offset = _unrolled(counts[start:stop])
        first, second = by_frequency[start + left], by_frequency[start + left + 1 + offset]
        apart = np.abs(step[first] - step[second])
        near = (apart > 0) & (apart <= tolerance.orders)
        found.append(_within(table, rows, first[near], second[near], tolerance))
    firsts, seconds, distances = zip(*found, strict=True)
    return np.concatenate(firsts), np.concatenate(seconds), np.concatenate(distances)


def _unrolled(counts: Whole) -> tuple[Whole, Whole]:
    """Rows repeated as often as they have partners, and the number of each partner."""
    left = np.repeat(np.arange(counts.size), counts)
    return left, np.arange(left.size) - np.repeat(np.cumsum(counts) - counts, counts)


def _runs(counts: Whole) -> list[tuple[int, int]]:
    """Stretches of poles whose pairs fit together into memory."""
    total = np.cumsum(counts)
    cuts = np.flatnonzero(np.diff(total // PAIRS_TOGETHER)) + 1
    return list(zip([0, *cuts.tolist()], [*cuts.tolist(), counts.size], strict=True))


def _frequency_reach(table: PoleTable, rows: Whole, tolerance: ClusterTolerance) -> Real:
    reach = tolerance.frequency * table.frequency_hz[rows]
    if table.frequency_std_hz is None:
        return reach
    return np.maximum(reach, tolerance.sigmas * table.frequency_std_hz[rows])


def _damping_reach(table: PoleTable, first: Whole, second: Whole, tolerance: ClusterTolerance) -> Real:
    damping = table.damping_ratio
    reach = tolerance.damping * np.maximum(damping[first], damping[second])
    if table.damping_std is None:
        return reach
    return np.maximum(reach, tolerance.sigmas * np.minimum(table.damping_std[first], table.damping_std[second]))


def _within(
    table: PoleTable, rows: Whole, first: Whole, second: Whole, tolerance: ClusterTolerance
) -> tuple[Whole, Whole, Real]:
    reach = _frequency_reach(table, rows, tolerance)
    frequency_hz, damping = table.frequency_hz[rows], table.damping_ratio
    a, b = rows[first], rows[second]
    by_frequency = np.abs(frequency_hz[first] - frequency_hz[second]) / np.minimum(reach[first], reach[second])
    by_damping = np.abs(damping[a] - damping[b]) / _damping_reach(table, a, b, tolerance)
    near = (by_frequency <= 1) & (by_damping <= 1)
    first, second = first[near], second[near]
    # Vectors have length 1, so that the MAC is their product squared.
    likeness = np.abs(np.einsum("pc,pc->p", table.vector[a[near]].conj(), table.vector[b[near]])) ** 2
    by_vector = (1 - likeness) / tolerance.vector
    alike = by_vector <= 1
    distance = (by_frequency + by_damping)[near] + by_vector
    return first[alike], second[alike], distance[alike]


def _join(step: Whole, first: list[int], second: list[int]) -> Whole:
    """Union of pairs in the order given, refused when both clusters hold a pole of one order."""
    parent = list(range(step.size))
    # A bit for each order: two clusters may join when no bit is set in both.
    held = [1 << place for place in step.tolist()]

    def root(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    for a, b in zip(first, second, strict=True):
        one, other = root(a), root(b)
        if one != other and not held[one] & held[other]:
            parent[other] = one
            held[one] |= held[other]
    roots = np.array([root(node) for node in range(step.size)])
    return np.asarray(np.unique(roots, return_inverse=True)[1], dtype=np.int64)

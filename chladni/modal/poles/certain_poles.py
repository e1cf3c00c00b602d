"""Which pole of a cluster stands for the mode: the one that is known best."""

import numpy as np

from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Real, Whole


def certain_pole(table: PoleTable, cluster: Whole, *, least_order: int = 0) -> int:
    """Give the row of the pole with the least sigma among those that the cluster doesn't contradict.

    The least order that describes a mode estimates it best, since every state more adds scatter; an order too low
    merges modes, and gives a wrong pole that looks sure. A pole within one of its own sigmas of the medians of the
    cluster, in frequency and damping, is not such a one. Where none is, the one nearest in its sigmas is taken.

    Parameters
    ----------
    table
        With standard deviations.
    cluster
        Rows of the poles of one mode, at least one.
    least_order
        Poles of lower orders are taken only when the cluster has no other. A model that lacks one of the modes puts
        that mode's motion into the shapes of the others.
    """
    high = cluster[table.order[cluster] >= least_order]
    cluster = high if high.size else cluster
    frequency_std, damping_std = pole_std(table, cluster)
    frequency, damping = table.frequency_hz[cluster], table.damping_ratio[cluster]
    off = np.maximum(
        np.abs(frequency - np.median(frequency)) / frequency_std, np.abs(damping - np.median(damping)) / damping_std
    )
    total = np.hypot(frequency_std / frequency, damping_std)
    agreeing = np.flatnonzero(off <= 1)
    if not agreeing.size:
        return int(cluster[np.argmin(off)])
    return int(cluster[agreeing[np.argmin(total[agreeing])]])


def pole_std(table: PoleTable, rows: Whole) -> tuple[Real, Real]:
    """Standard deviations of frequency and damping of some rows; infinite where the table has none."""
    if table.frequency_std_hz is None or table.damping_std is None:
        return np.full(rows.size, np.inf), np.full(rows.size, np.inf)
    tiny = np.finfo(np.float64).tiny
    return np.maximum(table.frequency_std_hz[rows], tiny), np.maximum(table.damping_std[rows], tiny)


def least_std(frequency_hz: Real, damping_ratio: Real, duration_s: float) -> tuple[Real, Real]:
    """Smallest standard deviations that a record under unmeasured random loads allows.

    sigma_f = f sqrt(zeta/(2 pi n)) and sigma_zeta = sqrt(zeta/(2 pi n)) for n = f T cycles of a mode that is seen
    without noise (Au 2014, Mech. Syst. Signal Process. 48, 15).

    Examples
    --------
    >>> std_hz, _ = least_std(np.array([1.88]), np.array([0.0157]), 5400.0)
    >>> float(round(std_hz[0] * 1e3, 2))
    0.93
    """
    relative = np.sqrt(damping_ratio / (2 * np.pi * frequency_hz * duration_s))
    return frequency_hz * relative, relative

"""Stabilisation: which poles of one model order agree with the order below."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import SetupError
from chladni.signals.stabilisation_diagram import StabilisationDiagram


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityLimits:
    """How much a pole may change from one order to the next and be called stable.

    Attributes
    ----------
    frequency, damping
        Relative change of natural frequency and of damping ratio.
    mac
        Least MAC of the vectors.
    """

    frequency: float = 0.01
    damping: float = 0.05
    mac: float = 0.98

    def __post_init__(self) -> None:
        for name in ("frequency", "damping", "mac"):
            if not 0 < getattr(self, name) < 1:
                raise SetupError(f"stability limit {name} {getattr(self, name)} must be above 0 and below 1")


def pole_status(table: PoleTable, limits: StabilityLimits | None = None) -> Whole:
    """Compare each pole with the poles of the order below.

    Parameters
    ----------
    table
        Poles of all orders.
    limits
        What counts as agreement; None for the defaults of `StabilityLimits`.

    Returns
    -------
    ndarray
        ``[pole]`` index into `POLE_STATUSES`: the best agreement with any pole of the order below, where damping
        counts only together with frequency, and the vector only with both.
    """
    limits = limits or StabilityLimits()
    status = np.zeros(table.order.size, np.int64)
    start = np.searchsorted(table.order, table.orders, side="left")
    stop = np.searchsorted(table.order, table.orders, side="right")
    for below in range(table.orders.size - 1):
        lower, upper = slice(start[below], stop[below]), slice(start[below + 1], stop[below + 1])
        if lower.start < lower.stop and upper.start < upper.stop:
            status[upper] = _agreement(table, lower, upper, limits)
    return status


def _agreement(table: PoleTable, lower: slice, upper: slice, limits: StabilityLimits) -> Whole:
    frequency = _change(table.frequency_hz[upper], table.frequency_hz[lower]) <= limits.frequency
    damping = frequency & (_change(table.damping_ratio[upper], table.damping_ratio[lower]) <= limits.damping)
    # Vectors have length 1, so that the MAC is their product squared.
    likeness = np.abs(table.vector[upper].conj() @ table.vector[lower].T) ** 2
    vector = damping & (likeness >= limits.mac)
    levels = frequency.astype(np.int64) + damping + vector
    return np.asarray(levels.max(axis=1), dtype=np.int64)


def _change(upper: Real, lower: Real) -> Real:
    return np.abs(upper[:, None] - lower) / lower


def stabilisation_diagram(
    table: PoleTable,
    *,
    member: Whole,
    indicator_hz: Real,
    indicator: Real,
    indicator_name: str,
    indicator_unit: str,
    limits: StabilityLimits | None = None,
) -> StabilisationDiagram:
    """Put the poles of all orders above an indicator function.

    Parameters
    ----------
    table
        Poles of all orders.
    member
        ``[pole]`` mode that each was taken for, -1 for none.
    indicator_hz, indicator, indicator_name, indicator_unit
        See `StabilisationDiagram`.
    limits
        See `pole_status`.
    """
    return StabilisationDiagram(
        order=table.order,
        frequency_hz=table.frequency_hz,
        damping_ratio=table.damping_ratio,
        status=pole_status(table, limits),
        mode=member,
        indicator_hz=indicator_hz,
        indicator=indicator,
        indicator_name=indicator_name,
        indicator_unit=indicator_unit,
    )

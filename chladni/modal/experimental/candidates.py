"""Poles that may be modes, before the data are asked whether they need them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.poles.pole_selection import PoleSelection, SelectionRules, select_poles
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Complex, Mask, Whole
from chladni.signals.order_spread import OrderSpread


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """What a stabilisation diagram offers.

    Attributes
    ----------
    table
        All poles.
    pole, vector
        ``[candidate]`` in rad/s and ``[candidate, reference]``.
    member
        ``[pole]`` candidate of each row of the table, -1 for none.
    spread
        Of each candidate over the orders.
    asked
        ``[candidate]`` whether its frequency was asked for: it stays whatever the data say.
    only_asked
        Whether frequencies were asked for: then the others only help to fit.
    notes
        Of the table and of what was asked for.
    """

    table: PoleTable
    pole: Complex
    vector: Complex
    member: Whole
    spread: OrderSpread
    asked: Mask
    only_asked: bool
    notes: tuple[str, ...]


def candidates(table: PoleTable, rules: SelectionRules, frequencies_hz: Sequence[float] | None) -> Candidates:
    """Choose automatically, and add what was asked for by frequency."""
    chosen = select_poles(table, rules=rules)
    if frequencies_hz is None:
        return _gathered(table, [chosen], asked=np.zeros(chosen.row.size, bool), only_asked=False)
    wanted = select_poles(table, frequencies_hz=frequencies_hz, rules=rules)
    further = np.setdiff1d(wanted.row, chosen.row).size
    asked = np.concatenate([np.isin(chosen.row, wanted.row), np.ones(further, bool)])
    return _gathered(table, [chosen, wanted], asked=asked, only_asked=True)


def _gathered(table: PoleTable, selections: list[PoleSelection], *, asked: Mask, only_asked: bool) -> Candidates:
    """Join selections of one table, in which a cluster that both hold has the same row in both."""
    seen: set[int] = set()
    member = np.full(table.order.size, -1)
    rows: list[int] = []
    spreads: list[tuple[float, ...]] = []
    for selection in selections:
        for mode, row in enumerate(selection.row.tolist()):
            if row in seen:
                continue
            seen.add(row)
            member[selection.member == mode] = len(rows)
            rows.append(row)
            spreads.append(_row(selection.spread, mode))
    columns = np.array(spreads, dtype=np.float64).reshape(-1, 5).T
    return Candidates(
        table=table,
        pole=table.pole[rows],
        vector=table.vector[rows],
        member=member,
        spread=OrderSpread(
            orders=columns[0].astype(np.int64),
            frequency_hz=columns[1],
            frequency_std_hz=columns[2],
            damping_ratio=columns[3],
            damping_std=columns[4],
        ),
        asked=asked,
        only_asked=only_asked,
        notes=(*table.notes, *(note for selection in selections for note in selection.notes)),
    )


def _row(spread: OrderSpread, mode: int) -> tuple[float, ...]:
    return (
        float(spread.orders[mode]),
        float(spread.frequency_hz[mode]),
        float(spread.frequency_std_hz[mode]),
        float(spread.damping_ratio[mode]),
        float(spread.damping_std[mode]),
    )

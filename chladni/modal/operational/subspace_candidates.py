"""Which poles of subspace models are modes of the structure, and which are noise or machines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.operational.correlation import CorrelationFunctions
from chladni.modal.operational.replication import replication
from chladni.modal.poles.certain_poles import certain_pole, least_std, pole_std
from chladni.modal.poles.pole_selection import PoleSelection, SelectionRules, select_poles
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.wording import counted

# Relative standard deviations between which the replication asked for rises. Poles of white noise have 0.4 with two
# channels, of which half may come back, and 0.15 with ten, of which less than a sixth does.
SURE = (0.1, 0.26)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseRules:
    """What a candidate must show to be taken for a mode.

    Attributes
    ----------
    replication, least_replication
        Least share of it that comes back in data that it was not found in (`replication`): the second for a pole
        whose damping is known to a tenth, rising to the first for one that is known to a quarter.
    damping_std
        Largest standard deviation of the damping ratio over the ratio, and of the frequency over the half-power
        half-width.
    over_least_std
        Largest standard deviation over the least that a record of this length allows (`least_std`).
    share, over_least_std_of_few
        Part of the model orders below which a candidate must be surer than that: richer models may give a strong mode
        two poles, so that few orders hold it as one.
    harmonic_distance, harmonic_damping
        A pole within this share of the frequency of a machine's line and with no more than this damping ratio is
        that line.
    same_shape
        Two poles whose shapes have this MAC or more, and whose frequencies lie within half a half-power width, are
        one mode that the models told twice: these sensors couldn't tell two such modes apart. So are two poles that
        near which never stand in one model.
    """

    replication: float = 0.55
    least_replication: float = 0.15
    damping_std: float = 0.5
    over_least_std: float = 12.0
    share: float = 0.3
    over_least_std_of_few: float = 3.0
    harmonic_distance: float = 0.01
    harmonic_damping: float = 0.005
    same_shape: float = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenPoles:
    """Rows of a table of poles that stand for modes.

    Attributes
    ----------
    selection
        Clusters that were looked at.
    clusters
        ``[mode]`` number of each mode's cluster in `selection`.
    rows
        ``[mode]`` row of the pole that stands for it.
    notes
        What was left out, and why.
    """

    selection: PoleSelection
    clusters: Whole
    rows: Whole
    notes: tuple[str, ...]


def choose_poles(
    correlations: CorrelationFunctions,
    table: PoleTable,
    *,
    block_rows: int,
    band_hz: tuple[float, float],
    harmonics: Sequence[MachineHarmonic],
    count: int | None = None,
    frequencies_hz: Sequence[float] | None = None,
    selection: SelectionRules,
    rules: ResponseRules,
) -> ChosenPoles:
    """Choose the poles that are modes.

    Parameters
    ----------
    correlations, block_rows
        What the table was made from.
    table
        With standard deviations.
    band_hz
        Where modes may be.
    harmonics
        Lines of machines.
    count
        Largest number of modes: those that most orders hold.
    frequencies_hz
        Frequencies to take a mode at, whatever the rules say of it; that is told in a note.
    selection, rules
        What makes poles a candidate, and a candidate a mode.
    """
    found = select_poles(table, band_hz=band_hz, frequencies_hz=frequencies_hz, rules=selection)
    rows = np.array(
        [certain_pole(table, np.flatnonzero(found.member == mode)) for mode in range(found.row.size)], dtype=np.int64
    )
    shares = replication(correlations, table, found, block_rows=block_rows)
    few = found.spread.orders < round(rules.share * table.orders.size)
    unsure = _unsure(table, rows, shares, few, correlations.duration_s, rules)
    machine = np.array([_is_harmonic(table, row, harmonics, rules) for row in rows], dtype=np.bool_)
    if frequencies_hz is not None:
        kept, notes = np.arange(rows.size), _doubts(table, rows, unsure, machine)
    else:
        kept, notes = _kept(table, rows, found, unsure, machine, few, rules)
    # Of models that hold all modes, wanted or not: how many are asked for changes none of them.
    final = _of_full_models(table, found, kept)
    if frequencies_hz is None and count is not None:
        strongest = np.argsort(-found.spread.orders[kept], kind="stable")[:count]
        notes += _shortfall(count, kept.size)
        kept, final = kept[strongest], final[strongest]
    rising = np.argsort(table.frequency_hz[final], kind="stable")
    return ChosenPoles(selection=found, clusters=kept[rising], rows=final[rising], notes=found.notes + notes)


def _of_full_models(table: PoleTable, found: PoleSelection, kept: Whole) -> Whole:
    """Poles of models that are rich enough to hold all modes."""
    clusters = [np.flatnonzero(found.member == mode) for mode in kept]
    least = max((int(table.order[cluster].min()) for cluster in clusters), default=0)
    return np.array([certain_pole(table, cluster, least_order=least) for cluster in clusters], dtype=np.int64)


def _unsure(table: PoleTable, rows: Whole, shares: Real, few: Mask, duration_s: float, rules: ResponseRules) -> Mask:
    frequency_hz, damping = table.frequency_hz[rows], table.damping_ratio[rows]
    frequency_std, damping_std = pole_std(table, rows)
    spread = np.hypot(frequency_std / frequency_hz, damping_std) / np.sqrt(2)
    least = least_std(frequency_hz, damping, duration_s)[1]
    # A pole of noise that many channels make look sure doesn't come back at all; one of a mode may come back in part,
    # where half of the record gives its models two poles for it.
    needed = np.interp(spread / damping, SURE, (rules.least_replication, rules.replication))
    most = np.where(few, rules.over_least_std_of_few, rules.over_least_std)
    wide = (spread > rules.damping_std * damping) | (spread > most * least)
    return np.asarray((shares < needed) | wide, dtype=np.bool_)


def _is_harmonic(table: PoleTable, row: int, harmonics: Sequence[MachineHarmonic], rules: ResponseRules) -> bool:
    frequency_hz = table.frequency_hz[row]
    near = any(abs(line.frequency_hz / frequency_hz - 1) <= rules.harmonic_distance for line in harmonics)
    return near and bool(table.damping_ratio[row] <= rules.harmonic_damping)


def _kept(
    table: PoleTable,
    rows: Whole,
    found: PoleSelection,
    unsure: Mask,
    machine: Mask,
    few: Mask,
    rules: ResponseRules,
) -> tuple[Whole, tuple[str, ...]]:
    kept, notes = np.flatnonzero(~unsure & ~machine), []
    if np.any(machine):
        notes.append(f"{_at(table, rows[machine])}: poles next to lines of machines are left out")
    # What few orders show is nothing that a person would ask about.
    noise = unsure & ~machine & ~few
    if np.any(noise):
        notes.append(
            f"{_at(table, rows[noise])}: many orders hold a pole there, but it doesn't come back in the other half "
            "of the record, or its error bar is as wide as what it says: noise, unless a longer record shows it again"
        )
    twice = _repeated(table, rows[kept], [np.flatnonzero(found.member == mode) for mode in kept], rules)
    if np.any(twice):
        notes.append(
            f"{_at(table, rows[kept[twice]])}: a second pole of the mode beside it, with the same shape or never in "
            "one model with it, left out"
        )
        kept = kept[~twice]
    return kept, tuple(notes)


def _shortfall(count: int, found: int) -> tuple[str, ...]:
    if found >= count:
        return ()
    return (f"{counted(count, 'mode')} asked for, but the record holds no more than {found} that are sure",)


def _repeated(table: PoleTable, rows: Whole, clusters: Sequence[Whole], rules: ResponseRules) -> Mask:
    """Poles within the half-power half-width of one that more orders hold, and that no model tells from it.

    Two close modes have different shapes, and a model that is rich enough has a pole for each of them: what has the
    same shape, or never stands beside the other in one model, is the other.
    """
    repeated = np.zeros(rows.size, dtype=np.bool_)
    strongest = np.argsort([-cluster.size for cluster in clusters], kind="stable")
    frequency_hz, width_hz = table.frequency_hz[rows], (table.frequency_hz * table.damping_ratio)[rows]
    # Vectors have length 1, so that the MAC is their product squared.
    alike = np.abs(table.vector[rows].conj() @ table.vector[rows].T) ** 2 >= rules.same_shape
    orders = [table.order[cluster] for cluster in clusters]
    apart = np.array([[np.intersect1d(one, other).size == 0 for other in orders] for one in orders], dtype=np.bool_)
    for place, row in enumerate(strongest):
        stronger = strongest[:place][~repeated[strongest[:place]]]
        near = np.abs(frequency_hz[stronger] - frequency_hz[row]) <= np.maximum(width_hz[stronger], width_hz[row])
        repeated[row] = bool(np.any(near & (alike[row, stronger] | apart[row, stronger])))
    return repeated


def _doubts(table: PoleTable, rows: Whole, unsure: Mask, machine: Mask) -> tuple[str, ...]:
    notes = []
    if np.any(machine):
        notes.append(
            f"{_at(table, rows[machine])}: taken as asked, but it's the line of a machine rather than a mode"
        )
    if np.any(unsure & ~machine):
        notes.append(f"{_at(table, rows[unsure & ~machine])}: taken as asked, but it can't be told from noise")
    return tuple(notes)


def _at(table: PoleTable, rows: Whole) -> str:
    return ", ".join(f"{frequency_hz:.4g}" for frequency_hz in sorted(table.frequency_hz[rows])) + " Hz"

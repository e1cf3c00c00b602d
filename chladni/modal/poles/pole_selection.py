"""Automatic choice of poles from a stabilisation diagram, and a user's own choice."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from chladni.modal.poles.pole_clusters import ClusterTolerance, cluster_poles
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Complex, Real, Whole
from chladni.signals.errors import SetupError
from chladni.signals.order_spread import OrderSpread
from chladni.signals.value import Value, require_shape
from chladni.signals.wording import counted


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionRules:
    """What makes poles of many orders one mode.

    Attributes
    ----------
    tolerance
        How far poles of one mode may be apart.
    share
        Part of the orders that must hold the mode, counted from the lowest order that could hold so many modes.
    least_orders
        Orders that must hold it in any case.
    damping
        Lowest and highest damping ratio of a mode.
    frequency_std, damping_std
        Where the table knows its sigmas: the largest of the frequency over the frequency, and of the damping over the
        damping, of a pole that is looked at.
    near
        A frequency asked for belongs to a pole no further from it than this part of it.
    """

    tolerance: ClusterTolerance = field(default_factory=ClusterTolerance)
    share: float = 0.3
    least_orders: int = 3
    damping: tuple[float, float] = (1e-5, 0.2)
    frequency_std: float = 0.02
    damping_std: float = 1.0
    near: float = 0.02

    def __post_init__(self) -> None:
        if not 0 < self.share <= 1:
            raise SetupError(f"share of orders {self.share} must be above 0 and at most 1")
        if self.least_orders < 1:
            raise SetupError(f"least number of orders {self.least_orders} must be at least 1")
        low, high = self.damping
        if not 0 <= low < high < 1:
            raise SetupError(f"damping ratios from {low} to {high} must rise from 0 to below 1")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoleSelection(Value):
    """Modes chosen from a table of poles, by rising frequency.

    Attributes
    ----------
    row
        ``[mode]`` row in the table of the pole that stands for the mode: the one in the middle of its cluster.
    pole, vector
        ``[mode]`` in rad/s and ``[mode, component]`` of that row.
    member
        ``[pole]`` mode of each row of the table, -1 for none.
    spread
        Mean and standard deviation of each cluster, and the number of its orders.
    notes
        What was asked for and isn't there, and why.
    """

    row: Whole
    pole: Complex
    vector: Complex
    member: Whole
    spread: OrderSpread
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("pole", self.pole, self.row.shape, "modes")
        require_shape("vector", self.vector, (self.row.size, self.vector.shape[1]), "modes x components")
        require_shape("spread", self.spread.orders, self.row.shape, "modes")
        self._freeze()


def select_poles(
    table: PoleTable,
    *,
    band_hz: tuple[float, float] | None = None,
    count: int | None = None,
    frequencies_hz: Sequence[float] | None = None,
    rules: SelectionRules | None = None,
) -> PoleSelection:
    """Choose the poles that a person would pick from a stabilisation diagram, or none.

    Poles inside the band and the range of damping are joined over the orders (`cluster_poles`); a cluster that enough
    orders hold is a mode. Two clusters that their own scatter can't tell apart are one mode.

    Parameters
    ----------
    table
        Poles of all orders.
    band_hz
        Lowest and highest natural frequency of a mode; None for no limit.
    count
        Largest number of modes: those that most orders hold. When fewer are there, a note says so.
    frequencies_hz
        Frequencies to take a mode at instead of choosing, each the nearest cluster, stable or not; one without any
        pole near is told in a note. Excludes `count`.
    rules
        What makes poles one mode; None for the defaults of `SelectionRules`.

    Returns
    -------
    PoleSelection
        Possibly without modes.

    Raises
    ------
    SetupError
        When `count` is not positive, a frequency is not inside the band, or both are given.

    Examples
    --------
    >>> orders = np.arange(1, 11)
    >>> pole = np.full(10, -0.6 + 62.8j)  # at every order: 1 % of damping at 10 Hz
    >>> table = PoleTable(orders=orders, order=orders, pole=pole, vector=np.ones((10, 1), complex))
    >>> chosen = select_poles(table, count=2)
    >>> chosen.spread.frequency_hz.round(2), chosen.notes
    (array([10.]), ('2 modes asked for, but the poles of no more than 1 agree over the model orders',))
    """
    rules = rules or SelectionRules()
    require_request(count, frequencies_hz, band_hz)
    if frequencies_hz is not None:
        chosen, notes = _nearest(table, _clusters(table, band_hz, rules, least=1), frequencies_hz, rules)
        return _selection(table, chosen, notes)
    clusters = _clusters(table, band_hz, rules, least=_orders_needed(table, rules))
    stable = _different(table, clusters, rules)
    notes = ()
    if count is not None:
        notes = _shortfall(count, len(stable))
        stable = _strongest(table, stable, count)
    return _selection(table, stable, notes)


def require_request(
    count: int | None, frequencies_hz: Sequence[float] | None, band_hz: tuple[float, float] | None
) -> None:
    """Raise `SetupError` when a number of modes or their frequencies can't be asked for so."""
    if band_hz is not None and not 0 <= band_hz[0] < band_hz[1] < np.inf:
        raise SetupError(f"band {band_hz[0]:g} to {band_hz[1]:g} Hz must rise from 0 Hz or more")
    if count is not None and count < 1:
        raise SetupError(f"count {count} must be at least 1; leave it out to get all modes")
    if frequencies_hz is None:
        return
    if count is not None:
        raise SetupError("count and frequencies_hz exclude each other: the frequencies are the count")
    if not len(frequencies_hz):
        raise SetupError("frequencies_hz is empty; leave it out to have the modes chosen")
    low, high = band_hz or (0.0, np.inf)
    for frequency_hz in frequencies_hz:
        if not (low <= frequency_hz <= high and 0 < frequency_hz < np.inf):
            where = f"the band {low:g} to {high:g} Hz" if band_hz else "the positive frequencies"
            raise SetupError(f"frequency {frequency_hz:g} Hz is not inside {where}")


def _clusters(
    table: PoleTable, band_hz: tuple[float, float] | None, rules: SelectionRules, *, least: int
) -> list[Whole]:
    """Clusters of at least so many poles, without what hangs on them."""
    rows = _candidates(table, band_hz, rules)
    label = cluster_poles(table, rows, rules.tolerance)
    parts = np.split(rows[np.argsort(label, kind="stable")], np.cumsum(np.bincount(label))[:-1])
    trimmed = (_trimmed(table, part, rules) for part in parts if part.size >= least)
    return [cluster for cluster in trimmed if cluster.size >= least]


def _candidates(table: PoleTable, band_hz: tuple[float, float] | None, rules: SelectionRules) -> Whole:
    low, high = band_hz or (0.0, np.inf)
    frequency_hz, damping = table.frequency_hz, table.damping_ratio
    kept = (frequency_hz >= low) & (frequency_hz <= high) & (frequency_hz > 0)
    kept &= (damping >= rules.damping[0]) & (damping <= rules.damping[1])
    if table.frequency_std_hz is not None:
        kept &= table.frequency_std_hz <= rules.frequency_std * frequency_hz
    if table.damping_std is not None:
        kept &= table.damping_std <= rules.damping_std * damping
    return np.flatnonzero(kept)


def _orders_needed(table: PoleTable, rules: SelectionRules) -> int:
    # A table of a single order, as of a fit with a known order, must be able to hold modes too.
    return min(max(rules.least_orders, round(rules.share * table.orders.size)), max(table.orders.size, 1))


def _centre(table: PoleTable, cluster: Whole) -> tuple[float, float]:
    return float(np.median(table.frequency_hz[cluster])), float(np.median(table.damping_ratio[cluster]))


def _trimmed(table: PoleTable, cluster: Whole, rules: SelectionRules) -> Whole:
    """Drop what only a chain of neighbours connects with the middle of the cluster."""
    frequency_hz, damping = _centre(table, cluster)
    off = np.abs(table.frequency_hz[cluster] - frequency_hz) / (rules.tolerance.frequency * frequency_hz)
    off_damping = np.abs(table.damping_ratio[cluster] - damping) / (rules.tolerance.damping * damping)
    return cluster[(off <= 1) & (off_damping <= 1)]


def _middle(table: PoleTable, cluster: Whole) -> int:
    """Row of the pole nearest to the medians, in units of the cluster's own scatter."""
    centre = _centre(table, cluster)
    columns = (table.frequency_hz[cluster], table.damping_ratio[cluster])
    distance = np.zeros(cluster.size)
    for column, middle in zip(columns, centre, strict=True):
        off = np.abs(column - middle)
        distance += off / (np.median(off) or 1.0)
    # Among equals the highest order, which is the least biased by what the model leaves out.
    best = np.flatnonzero(distance <= distance.min() * (1 + 1e-9))
    return int(cluster[best[-1]])


def _different(table: PoleTable, clusters: list[Whole], rules: SelectionRules) -> list[Whole]:
    """Keep of clusters that are the same pole twice the one that most orders hold."""
    ranked = _strongest(table, clusters, len(clusters))
    if not ranked:
        return []
    same = np.ones((len(ranked), len(ranked)), bool)
    for column in (table.frequency_hz, table.damping_ratio):
        middle = np.array([np.median(column[cluster]) for cluster in ranked])
        scatter = np.array([_scatter(column[cluster]) for cluster in ranked])
        same &= np.abs(middle[:, None] - middle) <= 2 * np.hypot(scatter[:, None], scatter)
    vectors = table.vector[[_middle(table, cluster) for cluster in ranked]]
    same &= np.abs(vectors.conj() @ vectors.T) ** 2 >= 1 - rules.tolerance.vector
    kept: list[int] = []
    for place in range(len(ranked)):
        if not same[place, kept].any():
            kept.append(place)
    return [ranked[place] for place in kept]


def _scatter(values: Real) -> float:
    """Give a standard deviation that a few strays don't widen."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _strongest(table: PoleTable, clusters: list[Whole], count: int) -> list[Whole]:
    def rank(cluster: Whole) -> tuple[int, float]:
        frequency_hz = table.frequency_hz[cluster]
        return -cluster.size, _scatter(frequency_hz) / float(np.median(frequency_hz))

    return sorted(clusters, key=rank)[:count]


def _shortfall(count: int, found: int) -> tuple[str, ...]:
    if found >= count:
        return ()
    return (f"{counted(count, 'mode')} asked for, but the poles of no more than {found} agree over the model orders",)


def _nearest(
    table: PoleTable, clusters: list[Whole], frequencies_hz: Sequence[float], rules: SelectionRules
) -> tuple[list[Whole], tuple[str, ...]]:
    """Take for each frequency the nearest cluster that no other frequency is nearer to."""
    stable = [cluster for cluster in clusters if cluster.size >= _orders_needed(table, rules)]
    chosen: dict[float, Whole] = {}
    wanted = list(dict.fromkeys(float(frequency_hz) for frequency_hz in frequencies_hz))
    # What many orders hold is looked at first; a pole of few orders is better than none.
    for pool in (_different(table, stable, rules), [c for c in clusters if c.size < _orders_needed(table, rules)]):
        centres = [_centre(table, cluster)[0] for cluster in pool]
        pairs = sorted(
            (abs(centre - frequency_hz) / frequency_hz, frequency_hz, place)
            for place, centre in enumerate(centres)
            for frequency_hz in wanted
            if frequency_hz not in chosen
        )
        taken: set[int] = set()
        for distance, frequency_hz, place in pairs:
            if distance <= rules.near and frequency_hz not in chosen and place not in taken:
                chosen[frequency_hz] = pool[place]
                taken.add(place)
    notes = tuple(
        f"no pole within {rules.near:.0%} of {frequency_hz:g} Hz that another frequency hasn't taken: no mode there"
        for frequency_hz in wanted
        if frequency_hz not in chosen
    )
    return list(chosen.values()), notes


def _selection(table: PoleTable, clusters: list[Whole], notes: tuple[str, ...]) -> PoleSelection:
    middle = np.array([_middle(table, cluster) for cluster in clusters], dtype=np.int64)
    rising = np.argsort(table.frequency_hz[middle], kind="stable")
    ordered = [clusters[place] for place in rising]
    member = np.full(table.order.size, -1)
    for mode, cluster in enumerate(ordered):
        member[cluster] = mode
    row = middle[rising]
    return PoleSelection(
        row=row,
        pole=table.pole[row],
        vector=table.vector[row],
        member=member,
        spread=_spread(table, ordered),
        notes=notes,
    )


def _spread(table: PoleTable, clusters: list[Whole]) -> OrderSpread:
    frequency_hz = [table.frequency_hz[cluster] for cluster in clusters]
    damping = [table.damping_ratio[cluster] for cluster in clusters]
    return OrderSpread(
        orders=np.array([cluster.size for cluster in clusters], dtype=np.int64),
        frequency_hz=np.array([np.mean(values) for values in frequency_hz], dtype=np.float64),
        frequency_std_hz=np.array([np.std(values) for values in frequency_hz], dtype=np.float64),
        damping_ratio=np.array([np.mean(values) for values in damping], dtype=np.float64),
        damping_std=np.array([np.std(values) for values in damping], dtype=np.float64),
    )

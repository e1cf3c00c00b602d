"""Poles of a whole band, with a closer look where the first fit leaves something unexplained."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d

from chladni.modal.experimental.judged_lines import TOLERATED, JudgedLines
from chladni.modal.experimental.plscf import polyreference_poles
from chladni.modal.poles.pole_table import PoleTable
from chladni.signals.arrays import Complex, Mask
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse

Band = tuple[float, float]
DEFAULT_ORDER = 60
# Poles of all references together, beyond which the diagram gets slower and no clearer.
MOST_POLES = 240
# Lines for each order: with fewer the highest orders follow every line.
LINES_PER_ORDER = 4
# Lines that a closer look takes at a time, and the least it needs.
LONGEST_LOOK, SHORTEST_LOOK = 512, 64
# Lines over which unexplained power is gathered: peaks from one line to many lines wide.
SCALES = (5, 17, 65)
# Standard deviations of the mean square: high, since a closer look costs time and few averages have heavy tails.
UNEXPLAINED = 8.0


def default_order(lines: int, references: int) -> int:
    """Order up to which poles are looked for when nobody says: as many as the lines carry, at most 60.

    Examples
    --------
    >>> default_order(4096, 1), default_order(100, 1), default_order(4096, 8)
    (60, 25, 30)
    """
    return max(2, min(DEFAULT_ORDER, lines // LINES_PER_ORDER, MOST_POLES // references))


@dataclass(frozen=True, slots=True, kw_only=True)
class PoleSearch:
    """Cores, each of which is fitted with a margin on either side and gives the poles inside it.

    Attributes
    ----------
    max_order
        Highest order of a core; None chooses by its lines.
    cores_hz
        Rising, adjacent bands; the first search has one.
    tables
        Poles of each core.
    """

    max_order: int | None
    cores_hz: tuple[Band, ...]
    tables: tuple[PoleTable, ...] = field(default=())

    @property
    def table(self) -> PoleTable:
        """All poles, by order."""
        return _merged(self.tables)


def first_search(response: FrequencyResponse, lines: JudgedLines, *, max_order: int | None) -> PoleSearch:
    """Look for poles in all lines at once."""
    core = (float(lines.frequency_hz[0]), float(lines.frequency_hz[-1]))
    return PoleSearch(
        max_order=max_order, cores_hz=(core,), tables=(_poles(response, lines, core, max_order, margin=0),)
    )


def closer_search(
    search: PoleSearch, response: FrequencyResponse, lines: JudgedLines, synthesised: Complex
) -> PoleSearch | None:
    """Look again, in short bands, where the fit leaves more than noise.

    Parameters
    ----------
    search
        What was looked at so far.
    response, lines
        What was measured.
    synthesised
        ``[response, reference, line]`` receptance of the modes found so far.

    Returns
    -------
    PoleSearch or None
        None when nothing is left to look at that wasn't looked at so closely before.
    """
    looks = [
        look
        for look in _looks(lines, unexplained_lines(lines, synthesised))
        if not any(_alike(look, core) for core in search.cores_hz)
    ]
    if not looks:
        return None
    parts = dict(zip(search.cores_hz, search.tables, strict=True))
    for look in looks:
        table = _poles(response, lines, look, search.max_order, margin=SHORTEST_LOOK // 4)
        parts = {core: _without(part, look) for core, part in parts.items()}
        parts[look] = table
    return replace(search, cores_hz=tuple(parts), tables=tuple(parts.values()))


def unexplained_lines(lines: JudgedLines, synthesised: Complex) -> Mask:
    """``[line]`` where the mean square of what is left, over any of `SCALES`, is more than noise and model error."""
    weight = lines.weight**2 / 2
    # Between resonances a fit may be off by a share of what is near, not of the little that is left there.
    near = uniform_filter1d(np.abs(lines.values) ** 2, SHORTEST_LOOK // 2, axis=-1, mode="nearest")
    left = weight * np.abs(lines.values - synthesised) ** 2 / (1 + weight * TOLERATED**2 * near)
    used = np.count_nonzero(lines.weight, axis=(0, 1))
    mean = left.sum(axis=(0, 1)) / np.maximum(used, 1)
    found = np.zeros(mean.shape, bool)
    for scale in SCALES:
        if scale > mean.size:
            break
        functions = uniform_filter1d(used.astype(float), scale, mode="nearest")
        scatter = np.sqrt(lines.correlated_lines / np.maximum(scale * functions, 1.0))
        found |= uniform_filter1d(mean, scale, mode="nearest") > 1 + UNEXPLAINED * scatter
    return found


def _looks(lines: JudgedLines, unexplained: Mask) -> list[Band]:
    """Bands around unexplained lines, none longer than `LONGEST_LOOK`, none overlapping."""
    reach = SHORTEST_LOOK // 2
    # A stretch grows by half the shortest look at each end, so that what is close together is looked at together.
    grown = uniform_filter1d(unexplained.astype(float), 2 * reach + 1, mode="constant") > 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[False], grown, [False]]).astype(int)))
    found: list[Band] = []
    for start, stop in edges.reshape(-1, 2):
        pieces = -(-(stop - start) // LONGEST_LOOK)
        cuts = np.linspace(start, stop, pieces + 1).astype(int)
        for low, high in pairwise(cuts):
            found.append((float(lines.frequency_hz[low]), float(lines.frequency_hz[high - 1])))
    return found


def _alike(look: Band, core: Band) -> bool:
    """Whether a core as short as the look covers most of it."""
    overlap = min(look[1], core[1]) - max(look[0], core[0])
    return overlap > 0.7 * max(look[1] - look[0], core[1] - core[0])


def _poles(
    response: FrequencyResponse, lines: JudgedLines, core: Band, max_order: int | None, *, margin: int
) -> PoleTable:
    first = max(int(np.searchsorted(lines.frequency_hz, core[0])) - margin, 0)
    last = min(int(np.searchsorted(lines.frequency_hz, core[1])) + margin, lines.frequency_hz.size - 1)
    # A short look carries no more than its lines do, whatever order was asked for.
    few = default_order(last + 1 - first, lines.values.shape[1])
    order = few if max_order is None else min(max_order, few) if margin else max_order
    band = (float(lines.frequency_hz[first]), float(lines.frequency_hz[last]))
    table = polyreference_poles(response, max_order=order, band_hz=band)
    return _chosen(table, (table.frequency_hz >= core[0]) & (table.frequency_hz <= core[1]))


def _without(table: PoleTable, band: Band) -> PoleTable:
    return _chosen(table, (table.frequency_hz < band[0]) | (table.frequency_hz > band[1]))


def _chosen(table: PoleTable, kept: Mask) -> PoleTable:
    return replace(table, order=table.order[kept], pole=table.pole[kept], vector=table.vector[kept])


def _merged(tables: Sequence[PoleTable]) -> PoleTable:
    if not tables:
        raise EstimateError("no poles were looked for")
    order = np.concatenate([table.order for table in tables])
    rising = np.argsort(order, kind="stable")
    return PoleTable(
        orders=np.unique(np.concatenate([table.orders for table in tables])),
        order=order[rising],
        pole=np.concatenate([table.pole for table in tables])[rising],
        vector=np.concatenate([table.vector for table in tables])[rising],
        notes=tuple(dict.fromkeys(note for table in tables for note in table.notes)),
    )

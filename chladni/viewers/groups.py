"""Which channels are drawn together: those of one unit, a few at a time."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.signals.channel import Channel
from chladni.signals.unit_text import printed_unit
from chladni.viewers.labels import quantity

LINES_IN_A_PLOT = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Channels of one unit that share a plot.

    Attributes
    ----------
    name
        ``Acceleration``, or ``Acceleration 2/3`` when the unit's channels fill several plots.
    unit
        The unit they share.
    rows
        Their places in the value they come from.
    """

    name: str
    unit: str
    rows: tuple[int, ...]

    @property
    def title(self) -> str:
        """Name and unit as printed, such as ``Acceleration [m/s²]``."""
        return f"{self.name} [{printed_unit(self.unit)}]"


def groups(channels: Sequence[Channel], *, size: int = LINES_IN_A_PLOT) -> tuple[Group, ...]:
    """Group channels by unit, at most `size` in a group, in the order in which units first appear.

    Examples
    --------
    >>> [group.title for group in groups([Channel(name="a", unit="N"), Channel(name="b", unit="m/s^2")])]
    ['Force [N]', 'Acceleration [m/s²]']
    """
    units: dict[str, list[int]] = {}
    for row, channel in enumerate(channels):
        units.setdefault(channel.unit, []).append(row)
    return tuple(group for unit, rows in units.items() for group in _pages(unit, rows, size))


def _pages(unit: str, rows: list[int], size: int) -> list[Group]:
    # Rounded up in whole numbers.
    pages = -(-len(rows) // size)
    # Pages of equal length read better than full ones and a rest of one.
    length = -(-len(rows) // pages)
    parts = [tuple(rows[start : start + length]) for start in range(0, len(rows), length)]
    names = [f"{quantity(unit)} {number}/{len(parts)}" for number in range(1, len(parts) + 1)]
    return [
        Group(name=name if len(parts) > 1 else quantity(unit), unit=unit, rows=part)
        for name, part in zip(names, parts, strict=True)
    ]

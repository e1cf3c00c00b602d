"""Columns of a table or a set of arrays: their names, units and numbers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from chladni.io.files.contents import unit_in_si
from chladni.signals.channel import Channel
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S
from chladni.signals.visible import visible

if TYPE_CHECKING:
    import pyarrow as pa

_TITLE = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>.*)\))$")
# "F / N" is how ISO 80000-1 heads a table, "F, N" how spreadsheets do.
_DIVIDED = re.compile(r"^(?P<name>.*?\S)(?:\s+/\s*|\s*,\s+)(?P<unit>\S+)$")
# Our own titles carry the start, so that a table keeps absolute time without a column of 19 digits.
_TIME_FROM = re.compile(r"^(?P<unit>\w+) from (?P<start>-?[0-9]{1,12}(\.[0-9]{1,30})?)$")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Column:
    """One number a row, or one text.

    Attributes
    ----------
    name
        Of the channel that it may be.
    numbers
        ``[row]`` numbers, ``datetime64`` or ``timedelta64``; None for text.
    text
        ``[row]`` cells as they are written, None where the file holds binary numbers.
    unit
        What the file says, None when it says nothing.
    start_ns
        What the numbers of a time column count from.
    """

    name: str
    numbers: NDArray[Any] | None = None
    text: "pa.Array | None" = None
    unit: str | None = None
    start_ns: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Title:
    """The head of a column: its name, the unit when there's one, and what times count from."""

    name: str
    unit: str | None
    start_ns: int = 0


def parse_titles(texts: Sequence[str]) -> list[Title]:
    """Take ``name [unit]`` and ``name (unit)`` apart, and ``name / unit`` or ``name, unit`` where all are so.

    Examples
    --------
    >>> parse_titles(["Kraft (kN)"])
    [Title(name='Kraft', unit='kN', start_ns=0)]
    >>> [title.unit for title in parse_titles(["t / s", "F / kN"])], parse_titles(["hammer / N", "tip"])[0].unit
    (['s', 'kN'], None)
    """
    divided = [_DIVIDED.match(text) for text in texts]
    # A lone "phase / A" may as well be the phase called A; a whole line of them is how its writer writes units.
    if len(texts) > 1 and all(match is not None and is_unit(match["unit"]) for match in divided):
        return [Title(name=match["name"], unit=match["unit"]) for match in divided if match is not None]
    return [_parse_title(text) for text in texts]


def _parse_title(text: str) -> Title:
    match = _TITLE.match(text)
    if match is None or not match["name"] or not _is_unit(text, match):
        return Title(name=text, unit=None)
    # An empty pair of brackets is how some tools write "no unit".
    unit = (match["square"] if match["square"] is not None else match["round"]).strip() or "1"
    started = _TIME_FROM.match(unit)
    if started is None:
        return Title(name=match["name"], unit=unit)
    return Title(name=match["name"], unit=started["unit"], start_ns=int(Decimal(started["start"]) * NS_PER_S))


def is_unit(text: str) -> bool:
    """Whether a text is a unit, whatever it measures."""
    from chladni.signals.unit_labels import require_label

    try:
        require_label(text)
    except SetupError:
        return False
    return True


def _is_unit(text: str, match: re.Match[str]) -> bool:
    """Whether the brackets at the end of a title hold a unit: not an index of a message path, not a remark."""
    # In a message path [0] is an index; a unit stands apart from it by a blank.
    if match["square"] is not None:
        return not text.startswith("/") or text[match.start("square") - 2].isspace()
    return is_unit(match["round"])


def with_units(columns: Sequence[Column], units: Mapping[str, str] | None, *, where: str) -> list[Column]:
    """Give the columns with the units that the caller states; `SetupError` for a column that isn't there."""
    names = [column.name for column in columns]
    for name in units or {}:
        if name not in names:
            raise SetupError(f"{where}: has no channel {name!r} to give a unit; channels: {', '.join(names)}")
    return [replace(column, unit=(units or {}).get(column.name, column.unit)) for column in columns]


def channels_of(
    columns: Sequence[Column], units: Mapping[str, str] | None, *, where: str
) -> tuple[list[Channel], tuple[str, ...]]:
    """Give a channel for each column, and notes on units of the file that aren't known: those channels have none.

    Raises
    ------
    SetupError
        When a unit that the caller states in `units` isn't known.
    """
    channels, notes = [], []
    for column in columns:
        unit = column.unit or "1"
        try:
            unit_in_si(column.name, unit)
        except SetupError as error:
            if column.name in (units or {}):
                raise SetupError(f"{where}: channel {column.name!r}: {error}") from error
            told = f"its unit can't be read, and its numbers are taken without one: {error}"
            notes.append(f"{where}: channel {column.name!r}: {told}; or state its unit yourself.")
            unit = "1"
        channels.append(Channel(name=column.name, unit=unit))
    return channels, tuple(notes)


def distinct(names: Sequence[str]) -> list[str]:
    """Give names of their own to columns that have the same, or are shown the same: ``a``, ``a (2)``, ...

    Examples
    --------
    >>> distinct(["a", "b", "a"])
    ['a', 'b', 'a (2)']
    """
    taken: set[str] = set()
    found = []
    for name in names:
        number, own = 1, name
        while visible(own) in taken:
            number += 1
            own = f"{name} ({number})"
        taken.add(visible(own))
        found.append(own)
    return found

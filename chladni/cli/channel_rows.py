"""Rows of a table of channels, those that differ in their names alone brought together."""

import re
from collections.abc import Sequence
from itertools import groupby

# A screen holds so many rows; a table that fits isn't shortened.
ROWS_SHOWN_SINGLY = 12
_NUMBERED = re.compile(r"(.*?)([0-9]+)([^0-9]*)")


def grouped_rows(rows: Sequence[Sequence[str]], *, most: int = ROWS_SHOWN_SINGLY) -> list[list[str]]:
    """Make one row of neighbours that agree in all but their name, the first cell, when there are more than `most`.

    Parameters
    ----------
    rows
        ``[row][cell]``; the first cell is a channel's name.
    most
        Rows that are left as they are.

    Returns
    -------
    list of list of str
        Rows in their order.

    Examples
    --------
    >>> grouped_rows([["/imu.a.x", "N"], ["/imu.a.y", "N"], ["/imu.t", "s"]], most=2)
    [['/imu.a.{x, y}', 'N'], ['/imu.t', 's']]
    """
    if len(rows) <= most:
        return [list(row) for row in rows]
    alike = groupby(rows, key=lambda row: list(row[1:]))
    return [[braced([row[0] for row in members]), *cells] for cells, members in alike]


def told_once(names: Sequence[str]) -> tuple[str, list[str]]:
    """Part the folders that all topics share from the rest of the names, which a command takes in their place.

    Parameters
    ----------
    names
        Cells of a column that begin with a channel's name.

    Returns
    -------
    shared : str
        With ``…`` in the place of the rest; empty where nothing is saved, or all names are the same.
    rest : list of str
        Topic's last part and fields, in their order: endings of the names.

    Examples
    --------
    >>> told_once(["/rig/daq.ch1", "/rig/daq.ch2"]), told_once(["/a.x", "/b.y"])
    (('/rig/…', ['daq.ch1', 'daq.ch2']), ('', ['/a.x', '/b.y']))
    """
    different = list(dict.fromkeys(names))
    if len(different) < 2:
        return "", list(names)
    # An ending without the topic's last part, such as "linear.x", would be one of other channels, too.
    head = _common_start(different)
    head = head[: head.rfind("/") + 1]
    # Where little is saved, parted names are harder to read than whole ones.
    if len(head) < max(map(len, different)) / 3:
        return "", list(names)
    return f"{head}…", [name[len(head) :] for name in names]


def braced(names: Sequence[str]) -> str:
    """Write what names have in common once, the rest in braces, as a shell would.

    Examples
    --------
    >>> braced(["/eip/level.value", "/eip/flow.value"])
    '/eip/{level, flow}.value'
    """
    if len(names) == 1:
        return names[0]
    head, tail = _shared_ends(names)
    middles = _runs([name[len(head) : len(name) - len(tail)] for name in names])
    return f"{head}{{{', '.join(middles)}}}{tail}"


def _shared_ends(names: Sequence[str]) -> tuple[str, str]:
    head = _common_start(names)
    # From the back, so that nothing is counted to both ends.
    return head, _common_start([name[len(head) :][::-1] for name in names])[::-1]


def _runs(names: list[str]) -> list[str]:
    """Write three numbered names or more that follow one another as ``data[0..63]`` or ``ch1..8``."""
    parts = [_NUMBERED.fullmatch(name) for name in names]
    # Members of one run keep the difference between their number and their place.
    keys = [part and (part[1], part[3], int(part[2]) - place) for place, part in enumerate(parts)]
    runs = [
        [names[place] for place, _ in members]
        for _, members in groupby(enumerate(keys), key=lambda pair: pair[1] or pair[0])
    ]
    return [name for run in runs for name in ([_spanned(run)] if len(run) > 2 else run)]


def _spanned(run: list[str]) -> str:
    first, last = _NUMBERED.fullmatch(run[0]), _NUMBERED.fullmatch(run[-1])
    return f"{first[1]}{first[2]}..{last[2]}{first[3]}" if first and last else ", ".join(run)


def _common_start(names: Sequence[str]) -> str:
    """What all names begin with, up to and with the last ``/`` or ``.``, and not the whole of any."""
    least, greatest = min(names), max(names)
    same = next((place for place, pair in enumerate(zip(least, greatest, strict=False)) if pair[0] != pair[1]), None)
    start = least[: len(least) - 1 if same is None else same]
    return start[: max(start.rfind("/"), start.rfind(".")) + 1]

"""Which column of a file holds the times."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.columns import Column, is_unit
from chladni.io.files.time_reading import (
    DATE_WORDS,
    NO_TIMES,
    NS_OF,
    UNIT_OF,
    TimeOptions,
    Times,
    spelled,
    times_of_numbers,
    times_of_remainder,
    times_of_text,
    words_of,
)
from chladni.io.files.time_text import TextTimes, read_time_text
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S

_TIME_WORDS: Final = DATE_WORDS | frozenset(
    [
        "t",
        "time",
        "times",
        "timestamp",
        "timestamps",
        "stamp",
        "stamps",
        "zeit",
        "zeitstempel",
        "zeitpunkt",
        "uhrzeit",
        "temps",
        "tiempo",
        "tempo",
        "tid",
        "tijd",
        "czas",
        "elapsed",
        "epoch",
    ]
)
# What stands beside them and changes nothing.
_BESIDE: Final = frozenset(
    [
        "since",
        "start",
        "of",
        "day",
        "from",
        "the",
        "axis",
        "vector",
        "utc",
        "local",
        "rel",
        "relative",
        "abs",
        "absolute",
        "unix",
        "posix",
        "system",
        "log",
        "ros",
        "rosbag",
        "header",
        "field",
    ]
)
# Spellings that are the whole name of a time. The others are also a minimum, a distance, a height.
_NAMES_OF_UNITS: Final = frozenset(UNIT_OF) - {"s", "h", "d", "min", "day", "days", "excel"}
UNNAMED: Final = "unnamed"
"""Name of a first column that has none beside others that have: where tables keep the number of the row."""
_COUNTERS: Final = frozenset(
    {UNNAMED, "#", "index", "idx", "sample", "samples", "no", "nr", "n", "row", "record", "id"}
)


def find_times(
    columns: Sequence[Column], options: TimeOptions, *, where: str
) -> tuple[Times | None, tuple[tuple[str, str], ...]]:
    """Find the times among the columns of a table.

    Returns
    -------
    times
        None when no column holds any.
    unread
        (name, reason) of further columns of times, which are no channels either.

    Raises
    ------
    SetupError
        When the column that is asked for isn't there, what its numbers count can't be told, or two columns tell
        times that differ.
    """
    texts = {column.name: times for column in columns if (times := _text_times(column)) is not None}
    groups = _candidates(columns, texts, options)
    if options.column not in (None, NO_TIMES):
        return _times_of(_asked_for(columns, groups, options, where), texts, options, where), ()
    found: list[Times] = []
    unclear: dict[str, SetupError] = {}
    for group in groups:
        try:
            found.append(_times_of(group, texts, options, where))
        except SetupError as error:
            unclear[group[0].name] = error
    if options.column == NO_TIMES:
        names = [name for times in found for name in times.columns]
        return None, tuple((name, "times that weren't asked for") for name in [*names, *unclear])
    if unclear and not found:
        raise next(iter(unclear.values()))
    return _finest(found, tuple(unclear), where) if found else (None, ())


def is_time_name(name: str) -> bool:
    """Whether a name is that of a time, with a unit or without: ``t_ms``, ``Zeit``, ``header.stamp``.

    Examples
    --------
    >>> [is_time_name(name) for name in ("timestamp_ns", "Elapsed Time", "settling_time", "force")]
    [True, True, False, False]
    """
    words = [word for word in words_of(name.rpartition(".")[2]) if word not in _BESIDE]
    others = [word for word in words if word not in UNIT_OF]
    if others:
        return all(word in _TIME_WORDS for word in others)
    return bool(words) and all(word in _NAMES_OF_UNITS for word in words)


def is_row_number(column: Column, *, first: bool) -> bool:
    """Whether a column only numbers the rows: as pandas calls it, or the first one, called so or nameless."""
    numbers = column.numbers
    named = column.name.startswith("__index_level_") or (first and column.name.lower() in _COUNTERS)
    if not named or numbers is None or numbers.dtype.kind not in "fiu" or numbers.size < 3:
        return False
    # Where a difference overflows, a sum with one doesn't.
    return bool((numbers[1:] == numbers[:-1] + 1).all())


def rises(column: Column) -> bool:
    """Whether the numbers of a column rise from each row to the next."""
    numbers = column.numbers
    if numbers is None or numbers.dtype.kind not in "fium" or numbers.size < 3:
        return False
    return bool((numbers[1:] > numbers[:-1]).all())


def _finest(found: Sequence[Times], unclear: Sequence[str], where: str) -> tuple[Times, tuple[tuple[str, str], ...]]:
    """Take the times that tell most rows apart: those to a millisecond, not the date to a second beside them."""
    best = max(found, key=lambda times: int(np.count_nonzero(np.diff(times.stamps_ns[times.known]))))
    others = [times for times in found if times is not best]
    for other in others:
        _require_agreement(best, other, where)
    names = [name for times in others for name in times.columns]
    return best, tuple((name, f"times as well; time={name} (--time) takes them") for name in [*names, *unclear])


def _require_agreement(best: Times, other: Times, where: str) -> None:
    """Two clocks that run at different speeds leave it open which one the spectra are on."""
    both = best.known & other.known
    if np.count_nonzero(both) < 2:
        return
    spans, steps = [], []
    for times in (best, other):
        stamps_ns = times.stamps_ns[both]
        spans.append(float(stamps_ns.max() - stamps_ns.min()))
        steps.append(float(np.abs(np.diff(stamps_ns)).max()))
    if abs(spans[0] - spans[1]) > 0.01 * max(spans) + 2 * max(steps):
        names = [" and ".join(times.columns) for times in (best, other)]
        told = [f"{name!r} spans {span / NS_PER_S:.6g} s" for name, span in zip(names, spans, strict=True)]
        raise SetupError(f"{where}: two columns of times differ: {', '.join(told)}; name the right one (--time NAME)")


def _text_times(column: Column) -> TextTimes | None:
    return read_time_text(column.text) if column.numbers is None and column.text is not None else None


def _asked_for(
    columns: Sequence[Column], groups: Sequence[tuple[Column, ...]], options: TimeOptions, where: str
) -> tuple[Column, ...]:
    named = {column.name: column for column in columns}
    if options.column not in named:
        raise SetupError(f"{where}: has no column {options.column!r} to be the time; columns: {', '.join(named)}")
    alone = (named[options.column],)
    return next((group for group in groups if options.column in {column.name for column in group}), alone)


def _times_of(group: tuple[Column, ...], texts: dict[str, TextTimes], options: TimeOptions, where: str) -> Times:
    names = tuple(column.name for column in group)
    if names[0] in texts:
        # A day sorts before the time of day beside it, whichever column comes first.
        *day, clock = sorted((texts[name] for name in names), key=lambda times: times.clocked)
        return times_of_text(names, day[0] if day else None, clock)
    if len(group) == 1:
        return times_of_numbers(group[0], options, where=where)
    return times_of_remainder(*group)


def _candidates(
    columns: Sequence[Column], texts: dict[str, TextTimes], options: TimeOptions
) -> list[tuple[Column, ...]]:
    """Give the columns that may hold times, alone or as two that make one time together."""
    pairs = [pair for pair in pairwise(columns) if _is_day_and_clock(pair, texts) or _is_remainder(*pair)]
    paired = {column.name for pair in pairs for column in pair}
    alone = [column for column in columns if column.name not in paired and _may_be_time(column, texts)]
    if not pairs and not alone and options.unit is not None and columns and rises(columns[0]):
        alone = [columns[0]]
    return [*pairs, *((column,) for column in alone)]


def _is_day_and_clock(pair: Sequence[Column], texts: dict[str, TextTimes]) -> bool:
    times = [texts[column.name] for column in pair if column.name in texts]
    return len(times) == 2 and {(one.dated, one.clocked) for one in times} == {(True, False), (False, True)}


def _is_remainder(whole: Column, part: Column) -> bool:
    """Whether a column of seconds is followed by what is left of them in nano- or microseconds, as in ROS."""
    names = words_of(whole.name), words_of(part.name)
    units = [UNIT_OF.get("".join(words[-1:])) for words in names]
    if names[0][:-1] != names[1][:-1] or units[0] != "seconds" or units[1] not in ("nanoseconds", "microseconds"):
        return False
    seconds, rest = whole.numbers, part.numbers
    if seconds is None or rest is None or seconds.dtype.kind not in "fiu" or rest.dtype.kind not in "fiu":
        return False
    below = NS_PER_S // NS_OF[units[1]]
    return bool((rest >= 0).all()) and float(rest.max(initial=0)) < below and _mostly_rising(seconds)


def _may_be_time(column: Column, texts: dict[str, TextTimes]) -> bool:
    if column.name in texts:
        stamps_ns = texts[column.name].stamps_ns[texts[column.name].known]
        return _mostly_rising(stamps_ns) or _falls(stamps_ns)
    if column.numbers is None or column.numbers.dtype.kind not in "fiumM":
        return False
    said = spelled(column.unit or "")
    if said not in ("", "1", *UNIT_OF) and is_unit(column.unit or ""):
        return False
    if column.numbers.dtype.kind in "mM" or is_time_name(column.name):
        # A unit of time beside the name tells times that run backwards, as of a list with the newest first.
        return _mostly_rising(column.numbers) or (said in UNIT_OF and _falls(column.numbers))
    # In a language that isn't known, the unit and a rise from row to row still tell a clock.
    return said in UNIT_OF and rises(column)


def _falls(numbers: NDArray[Any]) -> bool:
    return numbers.size > 2 and bool((numbers[1:] < numbers[:-1]).all())


def _mostly_rising(numbers: NDArray[Any]) -> bool:
    """Whether more rows rise than fall, so that a clock set back now and then is still one; true of a single row."""
    known = numbers[~np.isnat(numbers) if numbers.dtype.kind in "mM" else np.isfinite(numbers)]
    rising = np.count_nonzero(known[1:] > known[:-1])
    return known.size == 1 or bool(rising > np.count_nonzero(known[1:] < known[:-1]))

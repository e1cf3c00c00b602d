"""Time series from a set of named arrays, as ``.mat``, ``.npz`` and ``.npy`` files hold them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.columns import Column, is_unit
from chladni.io.files.contents import FileContents
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_column import is_time_name
from chladni.io.files.time_reading import NO_TIMES, NS_OF, UNIT_OF, TimeOptions, words_of
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import NS_PER_S, is_sample_rate
from chladni.signals.wording import shown

_RATE_NAMES: Final = frozenset(
    {"fs", "sr", "fsamp", "fsample", "sfreq", "framerate"}
    | {f"{how}{what}" for how in ("sample", "sampling") for what in ("rate", "freq", "frequency")}
)
_INTERVAL_NAMES: Final = frozenset(
    {"dt", "ts", "deltat", "tsample"}
    | {f"{how}{what}" for how in ("sample", "sampling") for what in ("time", "interval", "period")}
)
# A field of this name says in what the array beside it counts.
_UNIT_NAMES: Final = frozenset({"unit", "units"})
# The longer ones first: each ends in hz.
_HZ: Final = {"khz": 1e3, "mhz": 1e6, "hz": 1.0}
# Two scalars say the same rate when they're this near: an interval is often rounded.
_SAME_RATE: Final = 0.01


def series_of_arrays(
    arrays: Mapping[str, Any],
    options: TimeOptions,
    *,
    where: str,
    units: Mapping[str, str] | None = None,
    unread: tuple[tuple[str, str], ...] = (),
) -> FileContents:
    """Find the signals among named arrays, and their rate or times.

    The rate is a scalar called ``fs``, ``sample_rate`` or alike (Hz), or an interval called ``dt`` or alike (s).
    Times are a vector called ``t``, ``time`` or alike. Vectors as long as it, or else as the longest one, are
    channels; of a matrix each column or row of that length is one, ``name[0]``, ``name[1]``, ... Arrays of one struct
    (``run.time``, ``run.x``) belong together: each struct with times or a rate of its own is a series of its own. A
    text called ``unit`` or ``units`` beside one array alone is its unit, and several texts those of its channels.

    Parameters
    ----------
    where
        File, for messages.
    unread
        (name, reason) of what is left out already.

    Raises
    ------
    LogError
        When there is no signal.
    SetupError
        When nothing says the sample rate, or two things do.
    """
    signals = {name: np.asarray(array) for name, array in arrays.items() if _is_signal(array)}
    if not signals:
        raise LogError(f"{where}: holds no vector of numbers to be a signal; it has {_listed(arrays)}")
    parts, left_out = _parts(signals, arrays, options, where)
    return series_of_parts(parts, options, where=where, units=units, unread=(*unread, *left_out))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rate:
    """What a scalar says of the rate."""

    name: str
    hz: float


def _parts(
    signals: Mapping[str, NDArray[Any]], arrays: Mapping[str, Any], options: TimeOptions, where: str
) -> tuple[list[Part], list[tuple[str, str]]]:
    """Part the signals by the struct that holds their times or rate, and by length."""
    times = {name: array.size for name, array in signals.items() if _is_time_vector(name, array, options)}
    rates = _rates(arrays)
    keys = {name: _key(name, array, times, rates) for name, array in signals.items()}
    groups: dict[tuple[str, int], list[Column]] = {}
    left_out: list[tuple[str, str]] = []
    for name, array in signals.items():
        struct, length = keys[name]
        beside = [signals[other] for other, key in keys.items() if key == (struct, 0)]
        longest = length or max(max(one.shape) for one in beside)
        if longest in array.shape:
            units, unread = _units(name, signals, arrays)
            left_out += unread
            groups.setdefault((struct, longest), []).extend(_columns(name, array, longest, units))
        else:
            left_out.append((name, f"of {array.size} numbers beside {longest} samples"))
    parts = []
    for (struct, _), columns in groups.items():
        rate = _stated(_nearest(rates, struct), options, where)
        stated_hz, stated_by = (None, "") if rate is None else (rate.hz, repr(rate.name))
        parts.append(Part(columns=columns, stated_rate_hz=stated_hz, stated_by=stated_by))
    return parts, left_out


def _units(
    name: str, signals: Mapping[str, NDArray[Any]], arrays: Mapping[str, Any]
) -> tuple[tuple[str, ...], list[tuple[str, str]]]:
    """Give the units that stand beside an array, one for all or one for each channel; and what there is no unit."""
    struct = name.rpartition(".")[0]
    beside = [one for one in signals if one.rpartition(".")[0] == struct and not is_time_name(one)]
    if beside != [name]:
        # A text beside several arrays doesn't say whose it is.
        return (), []
    for key, content in arrays.items():
        if key.rpartition(".")[0] == struct and key.rpartition(".")[2].lower() in _UNIT_NAMES:
            texts = _texts(content)
            strange = [text for text in texts if not is_unit(text)]
            if strange:
                return (), [(key, f"{shown(strange[0])} is no unit that is known")]
            return texts, []
    return (), []


def _texts(content: Any) -> tuple[str, ...]:
    """Give one text, or several; none of anything else."""
    array = np.asarray(content)
    return tuple(str(one).strip() for one in array.ravel()) if array.dtype.kind == "U" and array.size else ()


def _stated(rates: list[_Rate], options: TimeOptions, where: str) -> _Rate | None:
    """Give the rate that scalars agree on; they may differ where the caller gives the right one."""
    if all(abs(rate.hz / rates[0].hz - 1) < _SAME_RATE for rate in rates):
        return rates[0] if rates else None
    if options.rate_hz is None:
        told = ", ".join(f"{rate.name} {rate.hz:g} Hz" for rate in rates)
        raise SetupError(f"{where}: states several sample rates, {told}; give the right one (--rate HZ)")
    return None


def _key(
    name: str, array: NDArray[Any], times: Mapping[str, int], rates: Mapping[str, list[_Rate]]
) -> tuple[str, int]:
    """Give the struct whose times or rate an array has, the nearest around it, and the times' length; 0 of a rate."""
    struct = name
    while struct:
        struct = struct.rpartition(".")[0]
        around = [length for other, length in times.items() if other.rpartition(".")[0] == struct]
        fitting = [length for length in around if length in array.shape]
        if fitting:
            return struct, fitting[0]
        if struct in rates and not around:
            return struct, 0
    anywhere = [(other.rpartition(".")[0], length) for other, length in times.items()]
    return next((place for place in anywhere if place[1] in array.shape), anywhere[0] if anywhere else ("", 0))


def _is_time_vector(name: str, array: NDArray[Any], options: TimeOptions) -> bool:
    if max(array.shape) != array.size or options.column == NO_TIMES:
        return False
    return name == options.column if options.column else array.dtype.kind in "mM" or is_time_name(name)


def _rates(arrays: Mapping[str, Any]) -> dict[str, list[_Rate]]:
    """Give the rates that scalars state, by the struct that they stand in."""
    rates: dict[str, list[_Rate]] = {}
    for name, content in arrays.items():
        struct, _, last = name.rpartition(".")
        number = np.asarray(content) if np.size(content) == 1 else None
        if number is not None and number.dtype.kind in "fiu":
            hz = rate_of_scalar(last, float(number.reshape(())))
            if hz is not None:
                rates.setdefault(struct, []).append(_Rate(name=name, hz=hz))
    return rates


def rate_of_scalar(name: str, number: float) -> float | None:
    """Give the rate in Hz that a number of this name states, None when it states none, or none that can be.

    Examples
    --------
    >>> [rate_of_scalar(name, 0.5) for name in ("fs", "sample_rate_kHz", "dt", "dt_ms", "mass")]
    [0.5, 500.0, 2.0, 2000.0, None]
    >>> [rate_of_scalar("fs", number) for number in (0.0, 1e-320, float("inf"))], rate_of_scalar("dt", 5e-324)
    ([None, None, None], None)
    """
    rate_hz = _stated_by(name, number) if 0 < number < np.inf else None
    return rate_hz if rate_hz is not None and is_sample_rate(rate_hz) else None


def _stated_by(name: str, number: float) -> float | None:
    words = words_of(name)
    joined = "".join(words)
    if joined in _RATE_NAMES:
        return number
    for unit, factor in _HZ.items():
        if joined.endswith(unit) and joined.removesuffix(unit) in (*_RATE_NAMES, "rate"):
            return number * factor
    if words and words[-1] in UNIT_OF and "".join(words[:-1]) in _INTERVAL_NAMES:
        return NS_PER_S / (number * NS_OF[UNIT_OF[words[-1]]])
    # Seconds by custom; whole numbers of them may be milliseconds as well.
    return 1 / number if joined in _INTERVAL_NAMES and number < 1 else None


def _nearest(rates: Mapping[str, list[_Rate]], struct: str) -> list[_Rate]:
    """Give the rates in a struct, else in the nearest around it, else all."""
    while struct not in rates and struct:
        struct = struct.rpartition(".")[0]
    return rates[struct] if struct in rates else [rate for found in rates.values() for rate in found]


def _is_signal(array: Any) -> bool:
    return isinstance(array, np.ndarray) and array.ndim in (1, 2) and array.size > 1 and array.dtype.kind in "fiubmM"


def _columns(name: str, array: NDArray[Any], length: int, units: Sequence[str]) -> list[Column]:
    """Give a column for each vector of the length; of a square matrix its columns, as MATLAB likes them.

    A single unit is that of all; as many as there are columns are theirs in turn.
    """
    rows = array.reshape(1, -1) if array.size == length else array.T if array.shape[0] == length else array
    labels = [name] if len(rows) == 1 else [f"{name}[{index}]" for index in range(len(rows))]
    known: Sequence[str | None] = (
        units if len(units) == len(rows) else [units[0] if len(units) == 1 else None] * len(rows)
    )
    return [Column(name=label, numbers=row, unit=unit) for label, row, unit in zip(labels, rows, known, strict=True)]


def _listed(arrays: Mapping[str, Any]) -> str:
    shapes = [f"{name} {np.shape(content)}" for name, content in list(arrays.items())[:12]]
    return ", ".join(shapes) or "nothing"

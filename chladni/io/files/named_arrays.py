"""Time series from a set of named arrays, as ``.mat`` and ``.npz`` files hold them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.contents import FileContents, placed_rows, series_of_rows, times_to_ns, unit_of
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError

RATE_NAMES = ("fs", "sample_rate", "sample_rate_hz", "sampling_rate", "samplerate", "rate_hz")
INTERVAL_NAMES = ("dt", "ts", "delta_t", "sample_time")
TIME_NAMES = ("t", "time", "time_s", "timestamps_s")


def series_of_arrays(
    arrays: Mapping[str, Any],
    *,
    where: str,
    sample_rate_hz: float | None = None,
    units: Mapping[str, str] | None = None,
) -> FileContents:
    """Find the signals among named arrays, and their rate or times.

    The rate is a scalar called ``fs``, ``sample_rate`` or alike (Hz), or an interval called ``dt`` or alike (s);
    times are a vector called ``t`` or ``time`` (s). Vectors as long as the time vector, or else as the longest one,
    are channels; of a matrix each row or column of that length is one, ``name[0]``, ``name[1]``, ...

    Parameters
    ----------
    where
        File and structure, for messages.

    Raises
    ------
    LogError
        When there is no signal.
    SetupError
        When nothing says the sample rate, or two things do.
    """
    # Scalars and texts are what describes the signals; they are looked up by name below.
    signals = {name: np.asarray(array) for name, array in arrays.items() if _is_signal(array)}
    times = _times(signals)
    rate_hz = _rate(arrays, where=where, given=sample_rate_hz, has_times=times is not None)
    length = len(times) if times is not None else max((max(array.shape) for array in signals.values()), default=0)
    columns, left_out = _columns(signals, length)
    if not columns or length < 2:
        raise LogError(f"{where}: holds no vector of numbers to be a signal; it has {_listed(arrays)}")
    _require_known(where, columns, units)
    channels = [Channel(name=name, unit=unit_of(name, None, units)) for name in columns]
    rows = list(columns.values())
    notes = _notes(where, left_out, length)
    if times is None:
        return FileContents(series=(series_of_rows(rows, channels, sample_rate_hz=rate_hz),), notes=notes)
    placed = placed_rows(times_to_ns(times, where=where), rows, channels, where=where)
    return replace(placed, notes=notes + placed.notes)


def _is_signal(array: Any) -> bool:
    return isinstance(array, np.ndarray) and array.ndim in (1, 2) and array.size > 1 and array.dtype.kind in "fiub"


def _times(signals: dict[str, NDArray[Any]]) -> NDArray[np.float64] | None:
    named = [name for name in signals if name.rpartition(".")[2].lower() in TIME_NAMES]
    if not named:
        return None
    return signals.pop(named[0]).astype(np.float64).ravel()


def _rate(arrays: Mapping[str, Any], *, where: str, given: float | None, has_times: bool) -> float:
    found = _scalar(arrays, RATE_NAMES)
    interval = _scalar(arrays, INTERVAL_NAMES)
    if has_times:
        if given is not None:
            raise SetupError(f"{where}: has a time vector; leave the sample rate out")
        return 1.0  # not used: the times say it
    # A rate in Hz beats an interval: 1/dt of a rounded dt is a rounded rate.
    if found is None and interval is not None and interval > 0:
        found = 1.0 / interval
    if found is not None and given is not None and not np.isclose(found, given, rtol=1e-9):
        raise SetupError(f"{where}: says {found:g} Hz, {given:g} Hz was given; leave the sample rate out")
    rate_hz = found if found is not None else given
    if rate_hz is None or not (np.isfinite(rate_hz) and rate_hz > 0):
        raise SetupError(
            f"{where}: nothing says the sample rate; give it, or store a scalar fs [Hz] or a vector time [s]; "
            f"it has {_listed(arrays)}"
        )
    return float(rate_hz)


def _scalar(arrays: Mapping[str, Any], names: tuple[str, ...]) -> float | None:
    for name, content in arrays.items():
        if name.rpartition(".")[2].lower() in names and np.size(content) == 1:
            number = np.asarray(content)
            if number.dtype.kind in "fiu":
                return float(number.reshape(()))
    return None


def _columns(
    signals: Mapping[str, NDArray[Any]], length: int
) -> tuple[dict[str, NDArray[np.floating[Any]]], list[str]]:
    columns: dict[str, NDArray[np.floating[Any]]] = {}
    left_out = []
    for name, array in signals.items():
        if length not in array.shape:
            left_out.append(name)
            continue
        # Whichever axis has the length of the signals is time; a square matrix is read in columns of time.
        rows = array.reshape(1, -1) if array.size == length else array if array.shape[1] == length else array.T
        # Integers become double, which holds 53 bits of them.
        rows = rows if rows.dtype in (np.float32, np.float64) else rows.astype(np.float64)
        labels = [name] if len(rows) == 1 else [f"{name}[{index}]" for index in range(len(rows))]
        columns |= dict(zip(labels, rows, strict=True))
    return columns, left_out


def _require_known(where: str, columns: Mapping[str, object], units: Mapping[str, str] | None) -> None:
    for name in units or {}:
        if name not in columns:
            raise SetupError(f"{where}: has no channel {name!r} to give a unit; channels: {', '.join(columns)}")


def _notes(where: str, left_out: list[str], length: int) -> tuple[str, ...]:
    if not left_out:
        return ()
    return (f"{where}: {', '.join(left_out)} left out, being of other length than {length} samples.",)


def _listed(arrays: Mapping[str, Any]) -> str:
    shapes = [f"{name} {np.shape(content)}" for name, content in list(arrays.items())[:12]]
    return ", ".join(shapes) or "nothing"

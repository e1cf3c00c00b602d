"""A time series as named arrays without objects, the layout of our ``.mat`` and ``.npz`` files.

``format`` is ``chladni.series/1``; beside it are ``series_1``, ``series_2``, ..., one for each rate, each with

===================  ==================================================================
``fs``               sample rate in Hz
``start_time_ns``    time of the first sample, ns since 1970, 64 bit integer
``names``, ``units``  one text for each channel
``points``           measurement points, empty text where unknown
``directions``       ``[channel, 3]``, NaN where unknown
``roles``            ``response`` or ``reference``
``overloads``        largest magnitude that the sensor can tell, NaN where unknown
``values``           ``[sample, channel]``, columns as MATLAB likes them
``valid``            ``[sample, channel]``, false where nothing was measured; left out when all is valid
===================  ==================================================================
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.channel import Channel, Role, Vector
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_labels import read_label
from chladni.signals.wording import counted

SERIES_FORMAT = "chladni.series/1"


def series_fields(series: TimeSeries) -> dict[str, NDArray[Any]]:
    """Give a series as arrays of numbers and texts."""
    unknown = (np.nan, np.nan, np.nan)
    channels = series.channels
    fields: dict[str, NDArray[Any]] = {
        "fs": np.array(series.sample_rate_hz),
        "start_time_ns": np.array(series.start_time_ns, dtype=np.int64),
        "names": np.array([channel.name for channel in channels]),
        "units": np.array([channel.unit for channel in channels]),
        "points": np.array([channel.point or "" for channel in channels]),
        "directions": np.array([channel.direction or unknown for channel in channels]),
        "roles": np.array([channel.role for channel in channels]),
        "overloads": np.array([np.nan if channel.overload is None else channel.overload for channel in channels]),
        "values": series.values.T,
    }
    if series.valid is not None:
        fields["valid"] = series.valid.T
    return fields


def restated(series: Sequence[TimeSeries], units: Mapping[str, str] | None, *, where: str) -> tuple[TimeSeries, ...]:
    """Take the numbers of series for those of other units.

    Parameters
    ----------
    units
        Unit by channel name of the numbers as they stand.

    Raises
    ------
    SetupError
        When a unit is unknown, or stated for a channel that isn't there.
    """
    known = [channel.name for part in series for channel in part.channels]
    for name in units or {}:
        if name not in known:
            raise SetupError(f"{where}: has no channel {name!r} to give a unit; channels: {', '.join(known)}")
    return tuple(_restated(part, units) for part in series) if units else tuple(series)


def _restated(series: TimeSeries, units: Mapping[str, str]) -> TimeSeries:
    factors, channels = np.ones(len(series.channels)), list(series.channels)
    for row, channel in enumerate(series.channels):
        if channel.name in units:
            factors[row], unit = read_label(
                units[channel.name], quantity=None if channel.unit == "1" else channel.unit
            )
            channels[row] = replace(channel, unit=unit)
    return replace(series, values=series.values * factors[:, np.newaxis], channels=tuple(channels))


def series_of_fields(fields: Mapping[str, Any], *, where: str) -> TimeSeries:
    """Make the series again; `LogError` naming the field that is missing or has the wrong shape."""
    names = _texts(fields, "names", where)
    count = len(names)
    # The names say how many columns there are, so that axes squeezed away in MATLAB come back.
    values = _rows(fields, "values", count, where)
    if values.dtype.kind != "f":
        values = values.astype(np.float64)
    channels = _channels(fields, names, where)
    valid = _rows(fields, "valid", count, where).astype(np.bool_) if "valid" in fields else None
    start_time_ns = _number(fields, "start_time_ns", where)
    if not abs(float(start_time_ns)) < 2**62:
        raise LogError(f"{where}: start_time_ns {start_time_ns} isn't within 146 years of 1970")
    # What TimeSeries refuses, such as a rate of 0, is a fault of this file and is told with its name.
    try:
        return TimeSeries(
            values=values,
            sample_rate_hz=float(_number(fields, "fs", where)),
            start_time_ns=int(start_time_ns),
            channels=channels,
            valid=valid,
        )
    except ChladniError as error:
        raise LogError(f"{where}: {error}") from error


def _channels(fields: Mapping[str, Any], names: list[str], where: str) -> tuple[Channel, ...]:
    count = len(names)
    units, points, roles = (_texts(fields, field, where, count) for field in ("units", "points", "roles"))
    directions = _rows(fields, "directions", 3, where).T if count else np.empty((0, 3))
    overloads = _rows(fields, "overloads", count, where)[:, 0] if count else np.empty(0)
    if len(directions) != count:
        raise LogError(f"{where}: directions of {counted(len(directions), 'channel')}, names of {count}")
    return tuple(
        Channel(
            name=names[row],
            unit=units[row],
            point=points[row] or None,
            direction=_direction(directions[row]),
            role=_role(roles[row], where),
            overload=float(overloads[row]) if np.isfinite(overloads[row]) else None,
        )
        for row in range(count)
    )


def _field(fields: Mapping[str, Any], name: str, where: str) -> Any:
    if name not in fields:
        raise LogError(f"{where}: has no {name!r}, which {SERIES_FORMAT} asks for")
    return fields[name]


def _number(fields: Mapping[str, Any], name: str, where: str) -> Any:
    content = np.asarray(_field(fields, name, where))
    if content.size != 1 or content.dtype.kind not in "fiu":
        raise LogError(f"{where}: {name!r} must be one number, found {content.dtype} {content.shape}")
    return content.reshape(())[()]


def _texts(fields: Mapping[str, Any], name: str, where: str, count: int | None = None) -> list[str]:
    # A cell is a list, an npz array of texts an array, and a lone text itself.
    content = _field(fields, name, where)
    listed = content if isinstance(content, list) else np.atleast_1d(content).tolist()
    texts = [text if isinstance(text, str) else "" for text in listed]
    if count is not None and len(texts) != count:
        raise LogError(f"{where}: {len(texts)} {name} for {counted(count, 'channel')}")
    return texts


def _rows(fields: Mapping[str, Any], name: str, columns: int, where: str) -> NDArray[Any]:
    """Give ``[column, sample]`` of an array whose trailing axis of length one may have been squeezed away."""
    array = np.asarray(_field(fields, name, where))
    if array.dtype.kind not in "fiub" or columns == 0 or array.size % columns or array.ndim > 2:
        raise LogError(f"{where}: {name!r} is {array.dtype} {array.shape}, not numbers in {columns} columns")
    return array.reshape(-1, columns).T


def _direction(components: NDArray[Any]) -> Vector | None:
    if not np.isfinite(components).all():
        return None
    return (float(components[0]), float(components[1]), float(components[2]))


def _role(text: str, where: str) -> Role:
    if text == "reference":
        return "reference"
    if text != "response":
        raise LogError(f"{where}: role {text!r} is neither response nor reference")
    return "response"

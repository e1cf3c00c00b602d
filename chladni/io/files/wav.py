"""WAV sound files: PCM of 8 to 32 bits and floating point."""

import struct
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_write
from chladni.io.files.contents import FileContents, one_series, require_no_gaps, series_of_rows, unit_of
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

_MAX_DATA_BYTES = 2**32 - 1024  # the sizes in a RIFF file are 32 bits wide


def read_wav(
    path: Path | str,
    *,
    full_scale: str = "1",
    names: Sequence[str] | None = None,
    units: Mapping[str, str] | None = None,
) -> FileContents:
    """Read a WAV file.

    Parameters
    ----------
    full_scale
        What the largest number of a PCM file stands for, such as ``10 V`` or ``50 g``; floating point files are
        multiplied by it. ``1`` leaves a fraction of full scale, without unit.
    names
        Names of the channels; ``ch1``, ``ch2``, ... by default.
    units
        Unit by channel name, for floating point files that hold physical values.

    Raises
    ------
    LogError
        When the file is no WAV, is cut short, or has an encoding other than PCM and floating point.
    SetupError
        When names or units don't fit.

    Notes
    -----
    PCM of n bits is ``integer / 2**(n - 1)`` of full scale, so that the lowest integer is exactly -1.
    """
    from chladni.signals.units import parse_quantity

    path = Path(path)
    _require_whole(path)
    rate_hz, frames = _frames(path)
    scale, scale_unit = parse_quantity(full_scale)
    values = _fractions(frames).T
    if scale != 1.0:
        values = values * scale
    titles = _names(path, len(values), names)
    for name in units or {}:
        if name not in titles:
            raise SetupError(f"{path}: has no channel {name!r} to give a unit; channels: {', '.join(titles)}")
    channels = [Channel(name=name, unit=unit_of(name, scale_unit, units)) for name in titles]
    return FileContents(series=(series_of_rows(list(values), channels, sample_rate_hz=float(rate_hz)),))


def write_wav(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write a floating point WAV file that holds the physical values as they are, neither scaled nor clipped.

    Returns
    -------
    losses
        Sentences on what the file doesn't hold: names, units, the start.

    Raises
    ------
    LogError
        For gaps, several rates, or more data than a WAV file holds.
    SetupError
        When the sample rate is no whole number of Hz, the only kind that a WAV file has.
    """
    from scipy.io import wavfile

    sound = one_series((series,) if isinstance(series, TimeSeries) else series, "a WAV file")
    require_no_gaps(sound, "a WAV file")
    rate_hz = round(sound.sample_rate_hz)
    if rate_hz != sound.sample_rate_hz:
        raise SetupError(
            f"a WAV file has whole sample rates, not {sound.sample_rate_hz!r} Hz; have it brought to "
            f"one (--resample {max(rate_hz, 1)})"
        )
    if sound.values.nbytes > _MAX_DATA_BYTES:
        raise LogError(
            f"{path}: {sound.values.nbytes} bytes of samples don't fit a WAV file of 4 GiB; write less at once"
        )
    with atomic_write(path, overwrite=overwrite) as file:
        wavfile.write(file, rate_hz, np.ascontiguousarray(sound.values.T))
    return _losses(sound)


def _losses(sound: TimeSeries) -> tuple[str, ...]:
    listed = ", ".join(
        f"ch{number} = {channel.name} [{channel.unit}]" for number, channel in enumerate(sound.channels, start=1)
    )
    losses = [f"A WAV file holds no names, units, points or directions; it has {listed}."]
    if sound.start_time_ns:
        losses.append(f"A WAV file holds no start; it was {sound.start_time_ns} ns since 1970.")
    return tuple(losses)


def _names(path: Path, count: int, names: Sequence[str] | None) -> list[str]:
    if names is not None and len(names) != count:
        raise SetupError(f"{path}: has {count} channels, but {len(names)} names were given; name each channel")
    return list(names) if names is not None else [f"ch{number + 1}" for number in range(count)]


def _require_whole(path: Path) -> None:
    """Walk the chunk headers, so that no length is believed that the file doesn't have."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(12)
        if len(head) < 12 or head[:4] not in (b"RIFF", b"RIFX") or head[8:] != b"WAVE":
            raise LogError(f"{path}: is no RIFF WAV file; it starts with {head[:4]!r}")
        order = "<" if head[:4] == b"RIFF" else ">"
        end = 8 + int(struct.unpack(f"{order}I", head[4:8])[0])
        described = False
        while len(chunk := file.read(8)) == 8:
            name, length = struct.unpack(f"{order}4sI", chunk)
            if file.tell() + length > size:
                there = size - file.tell()
                raise LogError(
                    f"{path}: the {name!r} part claims {length} bytes, {there} are there; the file is cut short"
                )
            # Samples without a description in front of them, or behind the announced end, are never reached.
            described |= name == b"fmt "
            if name == b"data" and described and file.tell() < end:
                return
            file.seek(length + length % 2, 1)
    raise LogError(f"{path}: holds no samples behind a description of them")


def _frames(path: Path) -> tuple[int, NDArray[Any]]:
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            # Chunks with remarks and cue points are skipped with a warning; they hold no samples.
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate_hz, frames = wavfile.read(path)
    except (ValueError, TypeError, struct.error, ZeroDivisionError, OverflowError) as error:
        raise LogError(f"{path}: this WAV file can't be read: {error}") from error
    if rate_hz <= 0 or not frames.size:
        raise LogError(f"{path}: a WAV file of {frames.size} samples at {rate_hz} Hz holds no signal")
    return int(rate_hz), frames.reshape(len(frames), -1)


def _fractions(frames: NDArray[Any]) -> NDArray[np.floating[Any]]:
    if np.issubdtype(frames.dtype, np.floating):
        return frames.astype(frames.dtype.newbyteorder("="), copy=False)
    if frames.dtype == np.uint8:
        return (frames.astype(np.float32) - 128) / 128
    # 24 bit samples come in the upper three bytes of 32; 16 bits fit single precision exactly, more need double.
    precision = np.float32 if frames.dtype.itemsize == 2 else np.float64
    fractions: NDArray[np.floating[Any]] = frames.astype(precision)
    fractions /= 2.0 ** (8 * frames.dtype.itemsize - 1)
    return fractions

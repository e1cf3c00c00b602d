"""WAV sound files (RIFF, RIFX, RF64, BW64, Wave64): PCM of 8 to 32 bits and floating point.

A recorder that lost its power never wrote the sizes into the header, one that streams can't: such files are read as
far as they go. RF64 and BW64 are those of EBU Tech 3306 and ITU-R BS.2088, Wave64 is Sony's.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_write
from chladni.io.files.bounds import Budget, memory_bytes
from chladni.io.files.contents import FileContents, one_series, require_no_gaps, series_of_rows, unit_of
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted

_MAX_DATA_BYTES: Final = 2**32 - 1024  # the sizes in a RIFF file are 32 bits wide
_UNKNOWN_SIZE: Final = 0xFFFFFFFF
_PCM: Final = 1
_FLOAT: Final = 3
_EXTENSIBLE: Final = 0xFFFE
_ENCODINGS: Final = frozenset({("u", 1), ("i", 2), ("i", 3), ("i", 4), ("f", 4), ("f", 8)})
_LONGEST_DESCRIPTION: Final = 4096
# GUIDs of Wave64: four letters, then the same twelve bytes for all but the first.
_W64_RIFF: Final = b"riff\x2e\x91\xcf\x11\xa5\xd6\x28\xdb\x04\xc1\x00\x00"
_W64_TAIL: Final = b"\xf3\xac\xd3\x11\x8c\xd1\x00\xc0\x4f\x8e\xdb\x8a"


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
        When the file is no WAV, holds no sample, or has an encoding other than PCM and floating point.
    SetupError
        When names or units don't fit.

    Notes
    -----
    PCM of n bits is ``integer / 2**(n - 1)`` of full scale, so that the lowest integer is exactly -1.
    """
    from chladni.signals.units import parse_quantity

    path = Path(path)
    with path.open("rb") as file:
        encoding, frames, notes, unread = _sound(path, file)
    scale, scale_unit = parse_quantity(full_scale)
    values = _fractions(frames).T
    if scale != 1.0:
        values *= scale
    titles = _names(path, len(values), names)
    for name in units or {}:
        if name not in titles:
            raise SetupError(f"{path}: has no channel {name!r} to give a unit; channels: {', '.join(titles)}")
    channels = [Channel(name=name, unit=unit_of(name, scale_unit, units)) for name in titles]
    series = series_of_rows(list(values), channels, sample_rate_hz=float(encoding.rate_hz))
    return FileContents(series=(series,), notes=notes, unread=unread)


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
        raise SetupError(
            f"{path}: has {counted(count, 'channel')}, but {counted(len(names), 'name')} came with it; name each "
            "channel"
        )
    return list(names) if names is not None else [f"ch{number + 1}" for number in range(count)]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Chunk:
    """A part of the file: its name, where its content begins, the length that it announces, and where the next is."""

    name: bytes
    start: int
    length: int
    next: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Encoding:
    """How samples are stored: the order of bytes, the kind of number (i, u or f), and bytes of each.

    `doubt` says how the description contradicts itself, empty when it doesn't.
    """

    rate_hz: int
    channels: int
    order: str
    letter: str
    width: int
    doubt: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Container:
    """A file as a row of chunks, with headers of 8 bytes or, in Wave64, of 24."""

    file: IO[bytes]
    size: int
    order: str
    wave64: bool

    def chunks(self, place: int) -> Iterator[_Chunk]:
        """Give the chunks from a place on, up to one that isn't headed as one."""
        header = struct.Struct("<4s12sQ" if self.wave64 else f"{self.order}4s0sI")
        # Wave64 counts the header in the length, and pads to eight bytes.
        counted, step = (header.size, 8) if self.wave64 else (0, 2)
        while place + header.size <= self.size:
            self.file.seek(place)
            name, tail, length = header.unpack(self.file.read(header.size))
            if length < counted or (self.wave64 and tail != _W64_TAIL) or not all(32 <= mark < 127 for mark in name):
                return
            start = place + header.size
            place = start + length - counted + -length % step
            yield _Chunk(name=name, start=start, length=length - counted, next=place)

    def ends_in_chunks(self, place: int) -> bool:
        """Whether chunks follow from a place to the end of the file, without a rest."""
        for chunk in self.chunks(place):
            place = chunk.next
        # Some writers leave out the bytes that make the last length even.
        return self.size <= place < self.size + 8

    def content(self, chunk: _Chunk) -> bytes:
        """Give the content of a description; a length that is no description's is not believed."""
        self.file.seek(chunk.start)
        return self.file.read(min(chunk.length, _LONGEST_DESCRIPTION))


def _container(path: Path, file: IO[bytes]) -> tuple[_Container, int]:
    """Tell the kind of container and where its first chunk is."""
    head = file.read(40)
    wave64 = head.startswith(_W64_RIFF)
    if not wave64 and (head[:4] not in (b"RIFF", b"RIFX", b"RF64", b"BW64") or head[8:12] != b"WAVE"):
        raise LogError(f"{path}: is no WAV file; it starts with {head[:4]!r}")
    order = ">" if head.startswith(b"RIFX") else "<"
    return _Container(file=file, size=path.stat().st_size, order=order, wave64=wave64), 40 if wave64 else 12


def _sound(
    path: Path, file: IO[bytes]
) -> tuple[_Encoding, NDArray[Any], tuple[str, ...], tuple[tuple[str, str], ...]]:
    """Give how samples are stored, the frames as they are, and what is told and left out."""
    container, place = _container(path, file)
    encoding: _Encoding | None = None
    sizes = b""
    for chunk in container.chunks(place):
        if chunk.name == b"fmt ":
            encoding = _encoding(path, container.content(chunk), container.order)
        elif chunk.name == b"ds64":
            sizes = container.content(chunk)
        elif chunk.name == b"data" and encoding is not None:
            # 64 bits of size stand apart, where 32 bits say that they don't know.
            if chunk.length == _UNKNOWN_SIZE and len(sizes) >= 16:
                (length,) = struct.unpack("<Q", sizes[8:16])
                chunk = replace(chunk, length=length, next=chunk.start + length + length % 2)
            there, notes, unread = _extent(path, container, chunk)
            frames = _frames(path, file, chunk.start, there, encoding)
            if frames.size:
                told = (f"{path}: {encoding.doubt}.",) if encoding.doubt else ()
                return encoding, frames, (*told, *notes), unread
            break
    raise LogError(f"{path}: holds no samples behind a description of them")


def _encoding(path: Path, described: bytes, order: str) -> _Encoding:
    if len(described) < 16:
        raise LogError(f"{path}: can't be read: its samples are described in {len(described)} bytes, 16 are due")
    kind, channels, rate_hz, second_bytes, frame_bytes, bits = struct.unpack(f"{order}HHIIHH", described[:16])
    # The extensible form keeps the code at the start of a GUID.
    if kind == _EXTENSIBLE and len(described) >= 26:
        kind = struct.unpack(f"{order}H", described[24:26])[0]
    width = frame_bytes // channels if channels and frame_bytes % channels == 0 else 0
    letter = {_PCM: "i" if width > 1 else "u", _FLOAT: "f"}.get(kind, "")
    if (letter, width) not in _ENCODINGS or not rate_hz:
        raise LogError(
            f"{path}: can't be read: encoding {kind} of {frame_bytes} bytes for {counted(channels, 'channel')} at "
            f"{rate_hz} Hz; PCM of 8, 16, 24 or 32 bits and floating point of 32 or 64 are read"
        )
    # Bytes a second and a frame are said twice. 24 bits and fewer may lie in four bytes.
    doubts = []
    if second_bytes != rate_hz * frame_bytes:
        doubts.append(f"{rate_hz} Hz of {frame_bytes} bytes a frame aren't {second_bytes} bytes a second")
    if -(-bits // 8) not in (width, 3 if width == 4 else width):
        doubts.append(f"{counted(channels, 'channel')} of {bits} bits aren't {frame_bytes} bytes a frame")
    told = "times and samples may be wrong: compare them with what was recorded, or record it again"
    doubt = f"contradicts itself: {' and '.join(doubts)}; {told}" if doubts else ""
    return _Encoding(rate_hz=rate_hz, channels=channels, order=order, letter=letter, width=width, doubt=doubt)


def _extent(
    path: Path, container: _Container, chunk: _Chunk
) -> tuple[int, tuple[str, ...], tuple[tuple[str, str], ...]]:
    """Give how many bytes of samples there are, and what is told of it: sizes are filled in when a file is closed."""
    there = container.size - chunk.start
    if chunk.length == 0 and container.ends_in_chunks(chunk.start):
        return 0, (), ()
    if chunk.length == 0 or chunk.length == _UNKNOWN_SIZE or chunk.length >= 2**63 - 24:
        return there, (f"{path}: was never closed, or streamed: its samples are read to its end.",), ()
    if chunk.length > there:
        told = f"{path}: is cut short: it announces {chunk.length} bytes of samples, {there} are there and read."
        return there, (told,), ()
    behind = container.size - chunk.start - chunk.length
    # Behind an odd length stands a byte that counts for nothing, and which some writers leave out.
    if container.size <= chunk.next or container.ends_in_chunks(chunk.next):
        return chunk.length, (), ()
    unread = (f"{counted(behind, 'byte')} at the end", "they lie behind the samples that the file announces")
    return chunk.length, (), (unread,)


def _frames(path: Path, file: IO[bytes], start: int, length: int, encoding: _Encoding) -> NDArray[Any]:
    """Read whole frames, ``[frame, channel]``, integers of three bytes widened to four."""
    frames = length // (encoding.channels * encoding.width)
    Budget(path=path, most=memory_bytes()).take(8 * frames * encoding.channels)
    file.seek(start)
    raw = np.fromfile(file, dtype=np.uint8, count=frames * encoding.channels * encoding.width)
    if encoding.width == 3:
        wide = np.zeros((raw.size // 3, 4), dtype=np.uint8)
        upper = slice(1, 4) if encoding.order == "<" else slice(0, 3)
        wide[:, upper] = raw.reshape(-1, 3)
        raw = wide.ravel()
    dtype = np.dtype(f"{encoding.order}{encoding.letter}{4 if encoding.width == 3 else encoding.width}")
    return raw.view(dtype).reshape(-1, encoding.channels)


def _fractions(frames: NDArray[Any]) -> NDArray[np.floating]:
    if np.issubdtype(frames.dtype, np.floating):
        return frames.astype(frames.dtype.newbyteorder("="), copy=False)
    if frames.dtype.itemsize == 1:
        return (frames.astype(np.float32) - 128) / 128
    # 24 bit samples come in the upper three bytes of 32; 16 bits fit single precision exactly, more need double.
    precision = np.float32 if frames.dtype.itemsize == 2 else np.float64
    fractions: NDArray[np.floating] = frames.astype(precision)
    fractions /= 2.0 ** (8 * frames.dtype.itemsize - 1)
    return fractions

"""LabVIEW's TDMS files, by nptdms, which comes with the extra ``[io]``."""

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from logging import LogRecord
from pathlib import Path
from typing import Any, BinaryIO, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.clock_verdict import round_rate
from chladni.io.files.bounds import Budget
from chladni.io.files.columns import Column
from chladni.io.files.contents import FileContents, one_line, with_notes
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_column import is_time_name
from chladni.io.files.time_reading import NO_TIMES, NS_OF, UNIT_OF, TimeOptions, spelled
from chladni.io.regular_file import open_regular
from chladni.signals.errors import LogError
from chladni.signals.time_series import NS_PER_S, is_sample_rate
from chladni.signals.wording import counted

# Property names of National Instruments, in the order of belief.
_UNITS: Final = ("unit_string", "NI_UnitDescription", "Unit", "unit", "units")

_MOST_SAID: Final = 3
# Tag, flags, version, length, offset of raw data; a flag says that the numbers behind it have their high byte first.
_LEAD_IN_BYTES: Final = 28
_BIG_ENDIAN: Final = 64
_NEVER_CLOSED: Final = 2**64 - 1
_Answer = TypeVar("_Answer")


def read_tdms(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int | None = None,
) -> FileContents:
    """Read a TDMS file: channels with their ``unit_string``, waveforms with ``wf_increment`` and ``wf_start_time``.

    Channels that are no waveforms have the times of a channel of their group that holds dates or is called a time.
    Channels are called ``channel``, or ``group/channel`` where several groups have one of that name.

    Parameters
    ----------
    sample_rate_hz
        Rate of channels that are no waveforms.
    time
        Name of the channel that holds times, ``none`` when none does.
    time_unit
        What its numbers count, see `chladni.io.files.time_reading.TIME_UNITS`.
    units
        Unit by channel name, instead of those in the file.
    max_bytes
        Most memory that the channels may take, by default as `chladni.io.files.bounds` has it.

    Raises
    ------
    LogError
        When nptdms isn't installed, the file is damaged or too large, or it holds no channel of numbers.
    SetupError
        When nothing says the times of the samples, or a unit that is stated is unknown.
    """
    path = Path(path)
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise LogError(
            f"{path}: TDMS files are read by nptdms, which this installation lacks; pip install 'chladni[io]'"
        ) from error
    budget = Budget.of_file(path, max_bytes)
    # An index beside the file may be one of another file: what is open has none.
    with _said() as said, open_regular(path, LogError) as raw:
        channels, unread = _channels(path, _answer(path, lambda: TdmsFile.open(raw)), budget)
        unread += _behind_segments(raw, path.stat().st_size)
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    contents = _contents(path, channels, unread, options, units)
    return with_notes(contents, [f"{path}: {text}." for text in dict.fromkeys(map(one_line, said))][:_MOST_SAID])


def _behind_segments(file: BinaryIO, size: int) -> tuple[tuple[str, str], ...]:
    """Tell of bytes that no whole segment announces, which nptdms passes over.

    Each segment begins with its tag, flags, version, and its length; one that was never closed has a length of ones.
    After National Instruments' "TDMS File Format Internal Structure".
    """
    place = 0
    while place < size:
        file.seek(place)
        head = file.read(_LEAD_IN_BYTES)
        if len(head) < _LEAD_IN_BYTES or not head.startswith(b"TDSm"):
            reason = "no whole segment; where bytes were added or lost, numbers before them may be wrong or missing"
            return ((f"{counted(size - place, 'byte')} at the end", reason),)
        (length,) = struct.unpack_from(">Q" if head[4] & _BIG_ENDIAN else "<Q", head, 12)
        place = size if length == _NEVER_CLOSED else place + _LEAD_IN_BYTES + length
    return ()


@contextmanager
def _said() -> Iterator[list[str]]:
    """Collect what nptdms has to say of a file, which it would write to the console."""
    from nptdms.log import log_manager

    said: list[str] = []

    def collect(record: LogRecord) -> bool:
        said.append(record.getMessage())
        return False

    log_manager.console_handler.addFilter(collect)
    try:
        yield said
    finally:
        log_manager.console_handler.removeFilter(collect)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Channel:
    """A channel with the group that it is in, and what it says of a waveform."""

    column: Column
    group: str
    rate_hz: float | None
    start_ns: int

    @property
    def samples(self) -> int:
        """Numbers that it holds."""
        return 0 if self.column.numbers is None else self.column.numbers.size


def _answer(where: object, call: Callable[[], _Answer]) -> _Answer:
    """Ask nptdms, which believes lengths and types of the file, and raises whatever comes of wrong ones."""
    try:
        return call()
    # No narrower: nptdms itself raises `Exception`, as for strain gauges and mixtures of DAQmx data that it refuses.
    except Exception as error:
        raise LogError(f"{where}: this TDMS file can't be read: {one_line(error)}") from error


def _channels(path: Path, file: Any, budget: Budget) -> tuple[list[_Channel], tuple[tuple[str, str], ...]]:
    """Read the channels of numbers, and say why others aren't; sizes are checked before memory is taken for them."""
    size = path.stat().st_size
    found = _answer(
        path, lambda: [(group.name, one, len(one), one.dtype) for group in file.groups() for one in group.channels()]
    )
    names = [channel.name for _, channel, _, _ in found]
    channels, unread = [], []
    for group, channel, length, dtype in found:
        name = channel.name if names.count(channel.name) == 1 else f"{group}/{channel.name}"
        # The samples of digital lines have a bit each, none has less.
        if length > 8 * size:
            raise LogError(f"{path}: {name!r} announces {length} numbers, the file has {size} bytes")
        reason = _why_unread(dtype, length, channel.properties)
        if not reason:
            budget.take(8 * length)
        try:
            numbers = np.empty(0) if reason else _answer(path, partial(_values, channel))
            rate_hz, start_ns = (None, 0) if reason else _waveform(channel.properties)
        except LogError as error:
            reason = str(error).removeprefix(f"{path}: ")
        if reason:
            unread.append((name, reason))
            continue
        said = next((str(channel.properties[key]) for key in _UNITS if channel.properties.get(key)), None)
        column = Column(name=name, numbers=numbers, unit=said)
        channels.append(_Channel(column=column, group=group, rate_hz=rate_hz, start_ns=start_ns))
    return channels, tuple(unread)


def _values(channel: Any) -> NDArray[Any]:
    return np.asarray(channel[:])


def _why_unread(dtype: np.dtype[Any], length: int, properties: Mapping[str, Any]) -> str:
    if dtype.kind not in "fiubmM":
        return "text" if dtype.kind == "O" else f"{dtype} numbers"
    if not length:
        return "empty"
    axis = spelled(str(properties.get("wf_xunit_string") or "s"))
    return "" if axis in UNIT_OF else f"against an axis in {axis!r}, not time"


def _waveform(properties: Mapping[str, Any]) -> tuple[float | None, int]:
    """Give the rate, None when there's no waveform, and the start in nanoseconds since 1970, 0 when nobody knows.

    Raises
    ------
    LogError
        When it starts beyond what nanoseconds hold.
    """
    unit_ns = NS_OF[UNIT_OF[spelled(str(properties.get("wf_xunit_string") or "s"))]]
    step = properties.get("wf_increment")
    rate_hz = NS_PER_S / (float(step) * unit_ns) if isinstance(step, int | float | np.number) and step > 0 else 0.0
    if not is_sample_rate(rate_hz):
        return None, 0
    offset = properties.get("wf_start_offset", 0.0)
    offset_ns = float(offset) * unit_ns if isinstance(offset, int | float | np.number) else 0.0
    start = properties.get("wf_start_time")
    # LabVIEW's clock begins in 1904: a start there is none. A date beyond what nanoseconds hold would wrap around.
    start_ns = max(0, int(start.astype("M8[us]").astype(np.int64)) * 1000) if isinstance(start, np.datetime64) else 0
    if not start_ns + abs(offset_ns) < 2**62:
        raise LogError(f"begins at {start} and {offset} more (wf_start_offset), which isn't within 146 years of 1970")
    # The division leaves a rounding in the last digit, which a rate of few digits doesn't have.
    return round_rate(rate_hz, 4e-16 * rate_hz) or rate_hz, start_ns + round(offset_ns)


def _contents(
    path: Path,
    channels: Sequence[_Channel],
    unread: tuple[tuple[str, str], ...],
    options: TimeOptions,
    units: Mapping[str, str] | None,
) -> FileContents:
    """Part the channels by group and clock, and make a series of each part."""
    if not channels:
        raise LogError(
            f"{path}: holds no channel of numbers{''.join(f'; {name}: {why}' for name, why in unread[:5])}"
        )
    # A clock beside waveforms says more than their increment, which is 1 where nobody set it.
    timed = {(one.group, one.samples) for one in channels if options.column != NO_TIMES and _holds_times(one.column)}
    parts: dict[tuple[str, int, float | None, int], list[Column]] = {}
    for one in channels:
        waveform = one.rate_hz is not None and (one.group, one.samples) not in timed
        group, rate_hz, start_ns = ("", one.rate_hz, one.start_ns) if waveform else (one.group, None, 0)
        parts.setdefault((group, one.samples, rate_hz, start_ns), []).append(one.column)
    stated = {(one.group, one.samples): one.rate_hz for one in channels if one.rate_hz is not None}
    stated = {group: rate_hz for group, rate_hz in stated.items() if group in timed}
    return series_of_parts(
        [
            Part(columns=columns, stated_rate_hz=rate_hz or stated.get((group, samples)), start_ns=start_ns)
            for (group, samples, rate_hz, start_ns), columns in parts.items()
        ],
        options,
        where=str(path),
        units=units,
        unread=unread,
    )


def _holds_times(column: Column) -> bool:
    return column.numbers is not None and (column.numbers.dtype.kind == "M" or is_time_name(column.name))

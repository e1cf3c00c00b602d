"""Finds where the records in a stretch of bytes start, many at a time where their lengths repeat.

Every record is checked to lie inside the stretch. Logs of sensors repeat a short pattern of
records (one message of each channel, say) thousands of times; once a pattern has come twice, the
walk guesses that it goes on, compares opcode and length of all further records at once and
drops back to single steps where the guess fails.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chladni.io.mcap.records import MESSAGE_FIELDS_BYTES, PREFIX_BYTES, RECORD_PREFIX, Opcode
from chladni.signals.arrays import Bytes, Whole

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PREFIX = np.dtype([("opcode", "u1"), ("length", "<u8")])
# Comparing with an enumeration's member costs more than all else in a step.
_MESSAGE = int(Opcode.MESSAGE)
_LONGEST_PATTERN = 256
_FIRST_LEAP_PERIODS = 16
_LEAP_GROWTH = 8
# A failed guess costs about as much as this many single steps.
_STEPS_AFTER_FAILURE = 32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordWalk:
    """Starts of the records found, and the first byte that is not part of one of them."""

    starts: Whole
    end: int


def walk_records(buffer: Bytes, *, start: int, stop: int, until: frozenset[int] = frozenset()) -> RecordWalk:
    """Walk the records in ``buffer[start:stop]``.

    Parameters
    ----------
    buffer
        Bytes, shape ``(byte,)``.
    start, stop
        The stretch to walk.
    until
        Opcodes that end the walk.

    Returns
    -------
    RecordWalk
        ``end`` is ``stop`` when records tile the stretch; else the start of the first record that
        is in ``until``, runs over ``stop`` or can't be one.
    """
    return _Walk(buffer, start=start, stop=stop, until=until).run()


class _Walk:
    def __init__(self, buffer: Bytes, *, start: int, stop: int, until: frozenset[int]) -> None:
        self._buffer = buffer
        self._view = buffer.data
        self._stop = stop
        self._until = frozenset(int(opcode) for opcode in until) | {0}
        self._position = start
        self._starts = array("q")
        self._period = 0
        self._next_try = 0

    def run(self) -> RecordWalk:
        while self._step_until_repeat():
            self._leap()
        return RecordWalk(starts=np.frombuffer(self._starts, np.int64), end=self._position)

    def _step_until_repeat(self) -> bool:
        """Step until the last records have come once before in the same order; False where the walk ends."""
        # All in one loop and in local names: logs without any pattern spend their time here.
        view, stop, until, unpack = self._view, self._stop, self._until, RECORD_PREFIX.unpack_from
        position, index, append = self._position, len(self._starts), self._starts.append
        last_seen: dict[int, int] = {}
        period = repeats = 0
        while position + PREFIX_BYTES <= stop:
            opcode, length = unpack(view, position)
            end = position + PREFIX_BYTES + length
            too_short = opcode == _MESSAGE and length < MESSAGE_FIELDS_BYTES
            if end > stop or too_short or opcode in until:
                break
            append(position)
            position = end
            kind = length << 8 | opcode
            distance = index - last_seen.get(kind, index)
            last_seen[kind] = index
            index += 1
            repeats = repeats + 1 if distance == period else 1
            period = distance
            if 0 < period < repeats and period < _LONGEST_PATTERN and index >= self._next_try:
                self._position, self._period = position, period
                return True
        self._position = position
        return False

    def _leap(self) -> None:
        pattern = self._starts[-self._period :]
        periods = self._count_periods(pattern)
        if periods:
            offsets = np.array(pattern, np.int64) - pattern[0]
            bases = self._position + (self._position - pattern[0]) * np.arange(periods, dtype=np.int64)
            self._starts.frombytes((bases[:, np.newaxis] + offsets).tobytes())
            self._position += periods * (self._position - pattern[0])
        if periods < _FIRST_LEAP_PERIODS:
            self._next_try = len(self._starts) + _STEPS_AFTER_FAILURE

    def _count_periods(self, pattern: Sequence[int]) -> int:
        """Count how often the pattern follows without a break, in leaps that grow while they succeed."""
        stride = self._position - pattern[0]
        most = (self._stop - self._position) // stride
        count, leap = 0, _FIRST_LEAP_PERIODS
        while count < most:
            asked = min(leap, most - count)
            found = self._matching_periods(pattern, skip=count, count=asked)
            count += found
            if found < asked:
                break
            leap *= _LEAP_GROWTH
        return count

    def _matching_periods(self, pattern: Sequence[int], *, skip: int, count: int) -> int:
        stride = self._position - pattern[0]
        for record in pattern:
            opcode, length = RECORD_PREFIX.unpack_from(self._view, record)
            prefixes: NDArray[np.void] = np.ndarray(
                count, _PREFIX, self._buffer, offset=record + (1 + skip) * stride, strides=(stride,)
            )
            same = (prefixes["opcode"] == opcode) & (prefixes["length"] == length)
            if not same.all():
                count = int(same.argmin())
        return count

"""Which time of a message is its sample's: its own stamp, when it was published, or when it was logged."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stray_stamps import find_strays, untimed
from chladni.io.decoding.columns import Decoded
from chladni.io.decoding.schema import FieldInfo
from chladni.io.known_schemas import message_type
from chladni.io.mcap.message_batch import MessageBatch
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import LogError

StampKind = Literal["header", "publish", "log"]
StampRequest = Literal["auto", "header", "publish", "log"]

EPOCH_FROM_NS: Final = 631_152_000_000_000_000
"""1990-01-01: an earlier stamp counts from when something was switched on, not from 1970."""

_OWN_NAMES = ("header.stamp", "stamp", "timestamp_sample", "timestamp", "time", "time_usec", "t")
_SECONDS = ("sec", "secs", "seconds")
_NANOSECONDS = ("nsec", "nsecs", "nanosec", "nanos", "nanoseconds")
LATEST_NS: Final = 2**62
"""Largest stamp that is taken for a time: the year 2116."""

_STEADY_LAG_NS = 5_000_000_000
_SAME_CLOCK_NS = 30_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnStamp:
    """Fields of a message that hold its own time.

    Attributes
    ----------
    name
        As it's told to people.
    leaf
        Leaf with the time, or with its whole seconds when `nanoseconds_leaf` is given.
    nanoseconds_leaf
        Leaf with the rest in nanoseconds, or None.
    unit_ns
        Nanoseconds in one unit of `leaf`; None while only the numbers could tell.
    """

    name: str
    leaf: str
    nanoseconds_leaf: str | None = None
    unit_ns: int | None

    @property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        return (self.leaf,) if self.nanoseconds_leaf is None else (self.leaf, self.nanoseconds_leaf)


@dataclass(frozen=True, slots=True, kw_only=True)
class StampChoice:
    """Which time is taken, and why.

    Attributes
    ----------
    kind
        ``header`` stands for the message's own stamp, whatever its field is called.
    reason
        For people.
    own
        Fields of the message's own stamp, when that is taken.
    shift_ns
        Added to own stamps that count from another epoch, so that they fall onto the log's clock.
    """

    kind: StampKind
    reason: str
    own: OwnStamp | None = None
    shift_ns: int = 0

    @property
    def leaves(self) -> tuple[str, ...]:
        """Every leaf that must be decoded."""
        return () if self.own is None else self.own.leaves

    @property
    def label(self) -> str:
        """What people know the stamp by."""
        return f"{self.kind} time" if self.own is None else self.own.name

    def shifted(self, shift_ns: int) -> "StampChoice":
        """Give the same choice on the log's clock."""
        reason = f"{self.reason}; its clock isn't the log's, so {shift_ns / 1e9:.6f} s are added to all its stamps"
        return replace(self, reason=reason, shift_ns=shift_ns)


def find_own_stamp(fields: Sequence[FieldInfo], schema_name: str) -> OwnStamp | None:
    """Find the field that holds the message's own time, by its name and kind; None when there's none."""
    leaves = {info.path: info for info in fields if info.array is None}
    for name in _OWN_NAMES:
        info = leaves.get(name)
        if info is not None and info.kind == "time":
            return OwnStamp(name=name, leaf=name, unit_ns=1)
        if info is not None and info.kind == "number":
            in_microseconds = message_type(schema_name).startswith("px4_msgs/") or name.endswith("usec")
            return OwnStamp(name=name, leaf=name, unit_ns=1000 if in_microseconds else None)
        pair = _seconds_and_nanoseconds(leaves, name)
        if pair is not None:
            return OwnStamp(name=name, leaf=pair[0], nanoseconds_leaf=pair[1], unit_ns=1_000_000_000)
    times = [info.path for info in leaves.values() if info.kind == "time"]
    return OwnStamp(name=times[0], leaf=times[0], unit_ns=1) if len(times) == 1 else None


def _seconds_and_nanoseconds(leaves: dict[str, FieldInfo], name: str) -> tuple[str, str] | None:
    seconds = [leaf for leaf in (f"{name}.{part}" for part in _SECONDS) if leaf in leaves]
    rest = [leaf for leaf in (f"{name}.{part}" for part in _NANOSECONDS) if leaf in leaves]
    return (seconds[0], rest[0]) if seconds and rest else None


def own_stamps_ns(own: OwnStamp, decoded: Decoded) -> tuple[Whole, Mask]:
    """Read the messages' own stamps.

    Returns
    -------
    stamps_ns : int64 array ``[message]``
        Since the stamps' own epoch; 0 where the stamp is no usable number.
    usable : bool array ``[message]``
    """
    unit_ns = 1 if own.unit_ns is None else own.unit_ns
    raw = decoded.columns[own.leaf].numbers
    stamps_ns, usable = _to_ns(raw, unit_ns)
    if own.nanoseconds_leaf is not None:
        rest, rest_usable = _to_ns(decoded.columns[own.nanoseconds_leaf].numbers, 1)
        stamps_ns, usable = stamps_ns + rest, usable & rest_usable
    return np.where(usable, stamps_ns, 0), usable & ~decoded.bad


def plausible(stamps_ns: Whole) -> Mask:
    """Which stamps can be times at all; a damaged message may claim anything."""
    possible: Mask = (stamps_ns >= 0) & (stamps_ns < LATEST_NS)
    return possible


def _to_ns(raw: NDArray[np.generic], unit_ns: int) -> tuple[Whole, Mask]:
    if unit_ns == 1 and raw.dtype == np.int64:
        # What decoders give for a stamp of type time: nothing to convert, and most logs have it.
        return raw.astype(np.int64, copy=False), np.ones(raw.size, np.bool_)
    numbers = raw.astype(np.float64)
    usable = np.isfinite(numbers) & (np.abs(numbers) * unit_ns < LATEST_NS)
    if raw.dtype.kind in "iu":
        # Integers go through integers: a double has no room for nanoseconds since 1970.
        return np.where(usable, raw, 0).astype(np.int64) * unit_ns, usable
    whole = np.floor(np.where(usable, numbers, 0.0))
    fraction = np.where(usable, numbers, 0.0) - whole
    return whole.astype(np.int64) * unit_ns + np.rint(fraction * unit_ns).astype(np.int64), usable


# --- choosing ----------------------------------------------------------------------------------------------------


Times = tuple[Whole, Whole]
"""``[message]`` stamps and log times of some messages."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TopicHead:
    """Times of the first messages of a topic; stamps that are no times are left out.

    Attributes
    ----------
    messages
        How many there are.
    own
        Fields of the own stamp, or None.
    times
        By the kind of stamp; without ``header`` where the messages have no stamp of their own.
    """

    messages: int
    own: OwnStamp | None
    times: Mapping[StampKind, Times]

    def start_ns(self, choice: StampChoice) -> int:
        """Earliest time of a topic's first messages."""
        stamps, _ = self._chosen(choice)
        return int(stamps.min(initial=LATEST_NS)) + choice.shift_ns

    def lags_ns(self, choice: StampChoice) -> Whole:
        """Time from each message's sample to its log time."""
        stamps, logged = self._chosen(choice)
        return logged - stamps - choice.shift_ns

    def offset_ns(self, choice: StampChoice) -> int:
        """Middle of the lags: a delay, or the difference of two clocks."""
        return int(np.median(self.lags_ns(choice)))

    def lag_range_ns(self, choice: StampChoice) -> tuple[int, int] | None:
        """Least and most lag; None where it changes too much for it to be a delay."""
        lags = self.lags_ns(choice)
        if not lags.size:
            return None
        low, high = int(lags.min()), int(lags.max())
        return (low, high) if high - low < _STEADY_LAG_NS else None

    def _chosen(self, choice: StampChoice) -> Times:
        nothing = np.zeros(0, np.int64)
        return self.times.get(choice.kind, (nothing, nothing))


@np.errstate(invalid="ignore")  # a damaged number may be a NaN that signals
def head_of(batches: Sequence[MessageBatch], own: OwnStamp | None, decoded: Sequence[Decoded]) -> TopicHead:
    """Collect the times of the first batches of a topic, with the own stamps' unit found out."""
    publish = np.concatenate([batch.publish_time_ns for batch in batches])
    logged = np.concatenate([batch.log_time_ns for batch in batches])
    times: dict[StampKind, Times] = {"log": _timed(logged, logged, None)}
    times["publish"] = times["log"] if np.array_equal(publish, logged) else _timed(publish, logged, logged)
    if own is not None and own.unit_ns is None:
        numbers = np.concatenate([part.columns[own.leaf].numbers for part in decoded]).astype(np.float64)
        own = replace(own, unit_ns=_unit_ns(numbers, logged))
    if own is not None and own.unit_ns is not None:
        read = [own_stamps_ns(own, part) for part in decoded]
        stamps, usable = (np.concatenate([pair[part] for pair in read]) for part in (0, 1))
        usable &= plausible(stamps)
        times["header"] = _timed(stamps[usable], logged[usable], logged[usable])
    return TopicHead(messages=len(logged), own=own, times=times)


def _timed(stamps_ns: Whole, logged_ns: Whole, by_ns: Whole | None) -> Times:
    """Leave out the stamps that are no times, and those that contradict the count of the messages around."""
    away = untimed(stamps_ns, by_ns)
    if away is not None:
        stamps_ns, logged_ns = stamps_ns[~away], logged_ns[~away]
    strays = find_strays(stamps_ns)
    return np.delete(stamps_ns, strays), np.delete(logged_ns, strays)


def _unit_ns(numbers: Real, log_ns: Whole) -> int | None:
    """Find the unit of bare numbers: by their size if they count from 1970, else by how fast they run."""
    finite = numbers[np.isfinite(numbers)]
    if not finite.size:
        return None
    for unit_ns in (1_000_000_000, 1_000_000, 1000, 1):
        if EPOCH_FROM_NS <= float(np.median(finite)) * unit_ns <= 5e18:
            return unit_ns
    # Without the outermost twentieths, where a stamp that is no time would be.
    own_span, log_span = (float(np.ptp(np.percentile(one, [5, 95]))) for one in (finite, log_ns))
    if own_span <= 0 or log_span <= 0:
        return None
    for unit_ns in (1_000_000_000, 1_000_000, 1000, 1):
        if 0.8 < own_span * unit_ns / log_span < 1.25:
            return unit_ns
    return None


def choose_stamp(head: TopicHead, request: StampRequest, *, topic: str) -> StampChoice:
    """Choose the time of a topic's samples.

    Parameters
    ----------
    head
        Times of its first messages.
    request
        ``auto``: the message's own stamp where it has one that moves, else the publish time where that differs
        from the log time and moves, else the log time. Anything else is taken without asking.
    topic
        For messages.

    Raises
    ------
    LogError
        When the own stamp is asked for and the messages have none.
    """
    if request == "publish":
        return StampChoice(kind="publish", reason="publish time, as asked for")
    if request == "log":
        return StampChoice(kind="log", reason="log time, as asked for")
    trouble = _own_trouble(head)
    if request == "header":
        if head.own is None or "header" not in head.times:
            raise LogError(f"{topic}: stamp 'header' is asked for, but {trouble}; use 'publish' or 'log'")
        return StampChoice(kind="header", reason=f"{head.own.name}, as asked for", own=head.own)
    if trouble is None and head.own is not None:
        return StampChoice(kind="header", reason=f"the message's own stamp, {head.own.name}, moves", own=head.own)
    publish_trouble = _publish_trouble(head)
    if publish_trouble is None:
        return StampChoice(kind="publish", reason=f"{trouble}; publish time moves")
    return StampChoice(kind="log", reason=f"{trouble}; {publish_trouble}")


def _own_trouble(head: TopicHead) -> str | None:
    if head.own is None:
        return "messages have no stamp of their own"
    if "header" not in head.times:
        return f"{head.own.name} is no clock: its numbers don't run with the log's time in s, ms, us or ns"
    stamps_ns, _ = head.times["header"]
    if 2 * stamps_ns.size < head.messages:
        return f"{head.own.name} is no time in {head.messages - stamps_ns.size} of the first {head.messages} messages"
    return _standstill(stamps_ns, head.own.name)


def _publish_trouble(head: TopicHead) -> str | None:
    if head.times["publish"] is head.times["log"]:
        return "publish time is the same as log time"
    return _standstill(head.times["publish"][0], "publish time")


def _standstill(stamps_ns: Whole, name: str) -> str | None:
    """Say what is wrong with stamps that don't move, or None."""
    if not stamps_ns.any():
        return f"{name} stands still at zero"
    steps = np.diff(stamps_ns)
    still = int(np.count_nonzero(steps == 0))
    # Drivers that stamp several messages at once exist; beyond half of them the stamp tells nothing.
    if steps.size and still > steps.size / 2:
        return f"{name} stands still ({still + 1} of the first {stamps_ns.size} messages have the same)"
    if steps.size and np.count_nonzero(steps < 0) > steps.size / 2:
        return f"{name} runs backwards"
    return None


def clock_shifts_ns(heads: Mapping[str, TopicHead], choices: Mapping[str, StampChoice]) -> dict[str, int]:
    """Shifts that bring own stamps onto the log's clock, where a log mixes clocks.

    Own stamps may count from a start-up, or from a day the robot believes in. As long as all topics do the same they
    stand as they are; what starts before 1990, or is mixed with topics on the log's clock or on a third one, is
    shifted. Messages are logged after they are stamped, so the smallest difference among the topics of one clock is
    the least delay: one shift for all of them keeps them in step with each other.

    Parameters
    ----------
    heads, choices
        By topic; topics without messages left out.

    Returns
    -------
    dict
        Nanoseconds to add, by topic; topics that need none are left out.
    """
    heads = {topic: head for topic, head in heads.items() if head.lags_ns(choices[topic]).size}
    clocks = _clocks({topic: head.offset_ns(choices[topic]) for topic, head in heads.items()})
    mixed = len(clocks) > 1
    shifts: dict[str, int] = {}
    for topics in clocks:
        offsets = [heads[topic].offset_ns(choices[topic]) for topic in topics]
        on_the_logs_clock = min(map(abs, offsets)) <= _SAME_CLOCK_NS
        since_1970 = all(heads[topic].start_ns(choices[topic]) >= EPOCH_FROM_NS for topic in topics)
        if not on_the_logs_clock and (mixed or not since_1970):
            shift_ns = min(int(np.min(heads[topic].lags_ns(choices[topic]))) for topic in topics)
            shifts |= dict.fromkeys(topics, shift_ns)
    return shifts


def _clocks(offsets_ns: Mapping[str, int]) -> list[list[str]]:
    """Topics whose own stamps are equally far from the log time, to half a minute."""
    clocks: list[list[str]] = []
    last_ns = 0
    for topic, offset_ns in sorted(offsets_ns.items(), key=lambda item: item[1]):
        if not clocks or offset_ns - last_ns > _SAME_CLOCK_NS:
            clocks.append([])
        clocks[-1].append(topic)
        last_ns = offset_ns
    return clocks

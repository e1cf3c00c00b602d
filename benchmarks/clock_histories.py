"""Clock histories with known truth: what stamps look like that a log really holds, with a tone in noise."""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from chladni.signals.arrays import Real, Whole

START_NS = 1_700_000_000_000_000_000
OWN_STAMPS = b"""std_msgs/Header header
float64 x
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
# Tone at a fifth of the rate: many lines from 0 Hz even in short segments, and not on a line of a power of two.
TONE = 0.2
NOISE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class History:
    """Messages as they're stored, and the truth about them.

    Attributes
    ----------
    name
        Kind and numbers.
    rate_hz, breaks, longest_s
        Sampling rate, how often the clock was set, longest stretch without break or gap; None where it isn't asked.
    values
        ``[message]`` samples.
    log_ns
        ``[message]`` log times.
    own_ns
        ``[message]`` the messages' own stamps; None for messages without.
    channels
        ``[message]`` MCAP channel of each.
    sequence
        ``[message]``
    """

    name: str
    rate_hz: float
    breaks: int
    longest_s: float | None
    values: Real
    log_ns: Whole
    own_ns: Whole | None = None
    channels: Whole | None = None
    sequence: Whole | None = None
    tone_hz: float = field(default=0.0)

    def write(self, path: Path) -> None:
        """Write the log, one topic ``/s``."""
        with path.open("wb") as stream:
            writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=1 << 16)
            writer.start(profile="ros2")
            definition = b"float64 x\n" if self.own_ns is None else OWN_STAMPS
            schema = writer.register_schema("made/msg/Sample", "ros2msg", definition)
            numbers = np.zeros(self.values.size, np.int64) if self.channels is None else self.channels
            ids = [writer.register_channel("/s", "cdr", schema) for _ in range(int(numbers.max()) + 1)]
            for place, (value, log_ns) in enumerate(zip(self.values.tolist(), self.log_ns.tolist(), strict=True)):
                own_ns = None if self.own_ns is None else int(self.own_ns[place])
                sequence = place if self.sequence is None else int(self.sequence[place])
                writer.add_message(ids[numbers[place]], log_ns, encoded(value, own_ns), log_ns, sequence)
            writer.finish()


def encoded(value: float, own_ns: int | None) -> bytes:
    """CDR of a message."""
    if own_ns is None:
        return b"\0\1\0\0" + struct.pack("<d", value)
    seconds, nanoseconds = divmod(own_ns, 10**9)
    return b"\0\1\0\0" + struct.pack("<iII4s", seconds, nanoseconds, 2, b"f\0\0\0") + struct.pack("<d", value)


def sampled(times_s: Real, rate_hz: float, rng: np.random.Generator) -> Real:
    """A tone in noise at the true times of the samples."""
    tone = np.sin(2 * np.pi * TONE * rate_hz * times_s + rng.uniform(0, 2 * np.pi))
    return tone + NOISE * rng.standard_normal(times_s.size)


def ns(times_s: Real) -> Whole:
    """Whole nanoseconds of seconds, to the microsecond, as most clocks tell them."""
    return np.rint(times_s * 1e6).astype(np.int64) * 1000


@dataclass
class Made:
    """True times in stretches, and what happens to their stamps on the way."""

    rate_hz: float
    lengths: Sequence[int]
    seed: int

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.times = np.arange(sum(self.lengths)) / self.rate_hz
        self.stretch = np.repeat(np.arange(len(self.lengths)), self.lengths)
        self.first = np.cumsum([0, *self.lengths[:-1]])
        self.kept = np.ones(self.times.size, bool)
        self.values = sampled(self.times, self.rate_hz, self.rng)

    @property
    def name(self) -> str:
        """Numbers in words."""
        low, high = min(self.lengths), max(self.lengths)
        span = f"{low}" if low == high else f"{low} to {high}"
        return f"{self.rate_hz:g} Hz, {len(self.lengths)} x {span}"

    def longest(self) -> float:
        """Longest run of samples that weren't lost, in seconds."""
        best = 0
        for number in range(len(self.lengths)):
            kept = self.kept[self.stretch == number].astype(int)
            edges = np.flatnonzero(np.diff(np.concatenate(([0], kept, [0]))))
            best = max(best, int((edges[1::2] - edges[::2]).max(initial=0)))
        return best / self.rate_hz


def restarted(made: Made, start_s: float = 0.0) -> Real:
    """Stamps of a clock that starts anew with every stretch."""
    return start_s + made.times - made.times[made.first][made.stretch]


def stepped(made: Made, steps_s: Real) -> Real:
    """Stamps of a clock that is set by so much before each stretch, the first one too."""
    return made.times + np.cumsum(steps_s)[made.stretch]


def lengths(seed: int, count: int, low: int, high: int) -> list[int]:
    """Random lengths of stretches."""
    return np.random.default_rng(seed).integers(low, high + 1, count).tolist()


# --- histories ---------------------------------------------------------------------------------------------------


def histories() -> Iterator[History]:
    """Give all of them."""
    for kind in (sound, set_back, own_restarts, set_both_ways, coarse, coarse_and_more, untidy, shared_topics):
        yield from kind()


def history(
    what: str,
    made: Made,
    *,
    log_s: Real,
    own_s: Real | None = None,
    breaks: int = 0,
    longest_s: float | None = None,
    order: Whole | None = None,
    **rest: object,
) -> History:
    """Put a made signal and its stamps together, without what was lost and in the order of arrival."""
    chosen = np.flatnonzero(made.kept)
    chosen = chosen if order is None else chosen[order]
    return History(
        name=f"{what}, {made.name}",
        rate_hz=made.rate_hz,
        breaks=breaks,
        longest_s=made.longest() if longest_s is None else longest_s,
        values=made.values[chosen],
        log_ns=START_NS + ns(log_s)[chosen],
        own_ns=None if own_s is None else START_NS + ns(own_s)[chosen],
        tone_hz=TONE * made.rate_hz,
        **rest,
    )


def sound() -> Iterator[History]:
    """Nothing wrong: what must stay right."""
    for rate_hz, samples in ((1.0, 3000), (250.0, 10_000), (2000.0, 10_000)):
        made = Made(rate_hz, [samples], 1)
        yield history("sound", made, log_s=made.times)


def set_back() -> Iterator[History]:
    """The recorder's own clock is set back; nothing else tells the time."""
    cases = [
        (10.0, [12] * 60), (1.0, lengths(2, 60, 8, 60)), (100.0, lengths(3, 60, 8, 60)), (400.0, [10] * 100),
        (2000.0, lengths(4, 80, 20, 200)), (1000.0, lengths(5, 10, 500, 5000)), (50.0, [10_000, 10_000]),
    ]  # fmt: skip
    for number, (rate_hz, stretches) in enumerate(cases):
        made = Made(rate_hz, stretches, 10 + number)
        yield history("restarts", made, log_s=restarted(made, 0.1), breaks=len(stretches) - 1)
    for number, (rate_hz, stretches, back_s) in enumerate(
        ((100.0, [3000, 3000], 3600.0), (200.0, [2000] * 5, 1.0), (500.0, lengths(6, 20, 30, 300), 0.02))
    ):
        made = Made(rate_hz, stretches, 20 + number)
        log_s = stepped(made, np.array([5000.0] + [-back_s] * (len(stretches) - 1)))
        yield history(f"set back by {back_s:g} s", made, log_s=log_s, breaks=len(stretches) - 1)


def own_restarts() -> Iterator[History]:
    """Simulated time restarts each episode, the recorder's clock runs on."""
    cases = [
        (10.0, [12] * 60), (50.0, lengths(7, 40, 8, 60)), (100.0, lengths(8, 60, 10, 400)), (1000.0, [250] * 40),
        (2.0, lengths(9, 30, 20, 90)), (240.0, [10_000] * 2),
    ]  # fmt: skip
    for number, (rate_hz, stretches) in enumerate(cases):
        made = Made(rate_hz, stretches, 30 + number)
        delay = 0.002 + np.abs(made.rng.normal(0, 0.001, made.times.size))
        # Between episodes the simulator takes a while, and it runs twice as fast as the world.
        log_s = np.maximum.accumulate(100 + made.times / 2 + made.stretch * 0.3 + delay)
        own_s = restarted(made, 1 / rate_hz)
        yield history("simulated time restarts", made, log_s=log_s, own_s=own_s, breaks=len(stretches) - 1)


def set_both_ways() -> Iterator[History]:
    """A sensor's clock is set ahead, or both ways; the recorder's clock runs on."""
    cases = [
        ("set ahead", 100.0, [2000, 2000], [0.0, 3600.0]), ("set ahead", 200.0, [1000] * 4, [0.0, 2.0, 30.0, 0.5]),
        ("set both ways", 100.0, [500] * 6, [50.0, -7.0, 20.0, -3.0, 40.0, -30.0]),
        ("set both ways", 1000.0, lengths(10, 30, 40, 400), None),
    ]  # fmt: skip
    for number, (what, rate_hz, stretches, steps_s) in enumerate(cases):
        made = Made(rate_hz, stretches, 40 + number)
        if steps_s is None:
            steps_s = [20.0, *np.tile([0.7, -1.3], len(stretches))[: len(stretches) - 1]]
        delay = 0.002 + np.abs(made.rng.normal(0, 0.0005, made.times.size))
        log_s = np.maximum.accumulate(100 + made.times + delay)
        own_s = 90 + stepped(made, np.array(steps_s))
        yield history(what, made, log_s=log_s, own_s=own_s, breaks=len(stretches) - 1)


def ticked(times_s: Real, tick_s: float) -> Real:
    """What a clock tells that ticks."""
    return np.floor(times_s / tick_s + 1e-6) * tick_s


def coarse() -> Iterator[History]:
    """Stamps coarser than the sampling."""
    cases = [
        (104.0, 0.01, 6240), (1344.0, 0.001, 4032), (1660.0, 0.001, 4980), (96.0, 0.01, 6000), (833.0, 0.001, 5000),
        (208.0, 0.01, 4000), (1000.0, 0.01, 10_000), (1999.0, 0.015625, 8000), (26.0, 0.05, 2000), (1.6, 1.0, 1000),
    ]  # fmt: skip
    for number, (rate_hz, tick_s, samples) in enumerate(cases):
        made = Made(rate_hz, [samples], 50 + number)
        told = ticked(made.times + made.rng.uniform() / rate_hz, tick_s)
        own = number % 2 == 1
        log_s = 10 + made.times + 0.001 if own else told
        yield history(f"ticks of {tick_s * 1e3:g} ms", made, log_s=log_s, own_s=told if own else None)


def coarse_and_more() -> Iterator[History]:
    """Coarse stamps of clocks that are set, with gaps, lost samples and jitter."""
    for number, (rate_hz, tick_s, stretches) in enumerate(
        ((104.0, 0.01, [500] * 8), (1344.0, 0.001, lengths(11, 20, 100, 900)), (1660.0, 0.001, [1200] * 5))
    ):
        made = Made(rate_hz, stretches, 60 + number)
        told = ticked(restarted(made, 0.1), tick_s)
        yield history(f"ticks of {tick_s * 1e3:g} ms, restarts", made, log_s=told, breaks=len(stretches) - 1)
    for number, (rate_hz, tick_s) in enumerate(((104.0, 0.01), (1344.0, 0.001), (1660.0, 0.001))):
        made = Made(rate_hz, [6000], 70 + number)
        for start in (1500, 4000):
            made.kept[start : start + 700] = False
        yield history(f"ticks of {tick_s * 1e3:g} ms, two gaps", made, log_s=ticked(made.times, tick_s))
    for number, (rate_hz, tick_s, share) in enumerate(
        ((104.0, 0.01, 0.002), (1344.0, 0.001, 0.001), (1660.0, 0.001, 0.03), (1344.0, 0.001, 0.05))
    ):
        made = Made(rate_hz, [6000], 80 + number)
        made.kept &= made.rng.random(6000) > share
        made.kept[[0, -1]] = True
        what = f"ticks of {tick_s * 1e3:g} ms, {share:.1%} lost"
        yield history(what, made, log_s=ticked(made.times, tick_s), longest_s=-1.0)
    for number, (rate_hz, tick_s, share) in enumerate(((104.0, 0.01, 0.1), (1344.0, 0.001, 0.15))):
        made = Made(rate_hz, [6000], 90 + number)
        jitter = made.rng.normal(0, share / rate_hz, 6000)
        told = ticked(np.sort(made.times + 10 + jitter), tick_s)
        yield history(f"ticks of {tick_s * 1e3:g} ms, jitter {share:.0%}", made, log_s=told)


def untidy() -> Iterator[History]:
    """Jitter, gaps and late messages, alone and with a clock that is set."""
    for number, (rate_hz, share) in enumerate(((100.0, 0.05), (1000.0, 0.2), (20.0, 0.1))):
        made = Made(rate_hz, [5000], 100 + number)
        own_s = made.times + 5 + made.rng.normal(0, share / rate_hz, 5000)
        yield history(f"jitter {share:.0%}", made, log_s=made.times + 6, own_s=own_s)
    for number, (rate_hz, stretches) in enumerate(((100.0, [300] * 12), (500.0, lengths(12, 30, 20, 200)))):
        made = Made(rate_hz, stretches, 110 + number)
        own_s = restarted(made, 1.0) + made.rng.normal(0, 0.05 / rate_hz, made.times.size)
        log_s = 100 + made.times
        yield history("jitter 5%, restarts", made, log_s=log_s, own_s=own_s, breaks=len(stretches) - 1)
    for number, (rate_hz, stretches) in enumerate(((100.0, [6000]), (400.0, [1500] * 4), (50.0, [200] * 15))):
        made = Made(rate_hz, stretches, 120 + number)
        for start in made.rng.integers(20, made.times.size - 60, 5):
            made.kept[start : start + int(made.rng.integers(1, 30))] = False
        made.kept[[*made.first, *(made.first + np.array(stretches) - 1)]] = True
        yield history("gaps", made, log_s=restarted(made, 3.0), breaks=len(stretches) - 1)
    for number, (rate_hz, stretches) in enumerate(
        ((100.0, [5000]), (1000.0, [5000]), (200.0, [400] * 10), (20.0, lengths(13, 30, 30, 60)))
    ):
        made = Made(rate_hz, stretches, 130 + number)
        # A few are held up on their way, and logged behind up to five later ones.
        delay = 0.1 / rate_hz + np.zeros(made.times.size)
        for place in made.rng.choice(np.arange(10, made.times.size - 20), 12, replace=False):
            if np.all(made.stretch[place - 8 : place + 9] == made.stretch[place]):
                delay[place : place + int(made.rng.integers(1, 3))] += made.rng.integers(1, 5) / rate_hz
        log_s = 100 + made.times + delay
        order = np.argsort(log_s, kind="stable")
        own_s = restarted(made, 2.0)
        yield history("late messages", made, log_s=log_s, own_s=own_s, order=order, breaks=len(stretches) - 1)


def shared_topics() -> Iterator[History]:
    """Several MCAP channels on a topic, and messages stored out of the order of their log times."""
    made = Made(100.0, [2000], 140)
    turns = (np.arange(2000) // 50 % 2).astype(np.int64)
    yield history("two channels take turns", made, log_s=made.times, channels=turns)
    made = Made(250.0, [3000], 141)
    yield history("two channels, each second one", made, log_s=made.times, channels=np.arange(3000) % 2)
    for number, parts in enumerate((2, 5)):
        made = Made(200.0, [4000], 142 + number)
        order = np.concatenate(np.array_split(np.arange(4000), parts)[::-1])
        yield history(f"stored in {parts} parts, the last first", made, log_s=made.times, order=order, sequence=order)
    made = Made(500.0, [4000], 145)
    order = np.arange(4000).reshape(-1, 40)[:, np.random.default_rng(1).permutation(40)].ravel()
    yield history("stored shuffled by 40", made, log_s=made.times, order=order, sequence=order)
    made = Made(1000.0, [3000], 146)
    order = np.arange(3000)
    order[:-1:7], order[1::7] = order[1::7].copy(), order[:-1:7].copy()
    yield history("stored with neighbours swapped", made, log_s=made.times, order=order, sequence=order)

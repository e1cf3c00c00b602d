"""Places of a stream's messages on its grid, one after another as they come."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.grid_index import NOWHERE
from chladni.io.clock.stamp_order import ClockSteps
from chladni.io.live.reception import Told
from chladni.io.live.running_rate import RunningRate
from chladni.io.placement import Placement, StatedRate, place_stream
from chladni.io.stream import Piece
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S
from chladni.signals.wording import counted

#: Messages that are placed at a time; the clock is followed from one part to the next.
PART: Final = 512
#: Messages behind one that contradicts which tell whether it's a gap, a clock that was set, or one that is wrong.
AHEAD: Final = 16
#: ... of messages with many samples each, which come seldom.
BATCHES_AHEAD: Final = 3
#: Messages placed before that the fit of a stretch takes in, and those that may wait for it.
BEHIND: Final = 256
#: A step of the stamps without one of the log's time beside it is a clock that was set, from so much on.
SET_NS: Final = NS_PER_S
#: ... and where there's no other time beside it: nobody waits so long.
LEAP_NS: Final = 3600 * NS_PER_S
#: Share of what messages are off that the clock follows within a part.
FOLLOWED: Final = 0.25


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedMessages:
    """Messages with their places.

    Attributes
    ----------
    index
        ``[sample]``, grid index; `NOWHERE` for samples that have none.
    values
        ``[channel, sample]``.
    """

    index: Whole
    values: NDArray[np.floating]


class StreamPlaces:
    """Gives each message of one stream its place.

    Parameters
    ----------
    placement
        Of the messages of the beginning, by the ordinary fit; its time base is uniform.
    lead
        These messages.
    stated
        Rate that the user states.

    Attributes
    ----------
    next_index
        Grid index behind the last sample.
    told
        What happened since it was last asked.
    lost
        Messages that were left out so far.
    """

    def __init__(self, placement: Placement, lead: Piece, *, stated: StatedRate | None = None) -> None:
        base = placement.time_base
        self.stream = placement.stream
        self.rate = RunningRate(placement.stream, NS_PER_S / base.rate_hz, stated=stated)
        self.told: list[Told] = []
        self.lost = 0
        self.next_index = placement.last
        sizes = np.ones(lead.stamps_ns.size) if lead.counts is None else lead.counts
        jitter = 6 * base.jitter_s * base.rate_hz
        # Where stamps tell the place, half a period; where samples are counted, what scatter may move a message by.
        counted_in_order = base.smoothing > 1 or base.resumed.size > 0
        loose = jitter + base.quantum_s * base.rate_hz + base.burst_size + 0.5 if counted_in_order else 0.5
        self._tolerance = max(loose, 0.5 * float(np.median(sizes)) if lead.counts is not None else 0.5)
        self._own_clock = placement.stream.choice.kind != "log"
        self._shift_ns = int(base.clock.shift_ns[-1]) if base.clock.count else 0
        self._ahead = AHEAD if lead.counts is None else BATCHES_AHEAD
        self._waiting: Piece | None = None
        self._begin(placement, lead)

    @property
    def waits(self) -> bool:
        """Whether there are messages whose place isn't certain yet."""
        return self._waiting is not None

    @property
    def rate_hz(self) -> float:
        """Rate of the stamps so far."""
        return NS_PER_S / self.rate.period_ns

    def lead(self, placement: Placement, lead: Piece) -> PlacedMessages:
        """Give the messages of the beginning with the places that the ordinary fit gave them."""
        return PlacedMessages(index=placement.samples_index(slice(None)), values=lead.values)

    def add(self, piece: Piece, *, last: bool = False) -> PlacedMessages:
        """Take the next messages and give those whose place is certain; with `last`, all."""
        self.rate.keep(piece)
        waiting = piece if self._waiting is None else _joined(self._waiting, piece)
        done: list[PlacedMessages] = []
        while waiting.stamps_ns.size:
            used, placed = self._some(waiting, last=last)
            if not used:
                break
            done.append(placed)
            waiting = _behind(waiting, used)
        self._waiting = waiting if waiting.stamps_ns.size else None
        return PlacedMessages(
            index=np.concatenate([one.index for one in done]) if done else np.zeros(0, np.int64),
            values=np.concatenate([one.values for one in done], axis=1) if done else piece.values[:, :0],
        )

    def rest(self) -> PlacedMessages:
        """Give the messages that wait, with nothing behind them."""
        waiting, self._waiting = self._waiting, None
        return self._nothing() if waiting is None else self.add(_behind(waiting, 0), last=True)

    def tell(self) -> tuple[Told, ...]:
        """Give what happened since the last time."""
        told, self.told = tuple(self.told), []
        return told

    # --- the beginning ---

    def _begin(self, placement: Placement, lead: Piece) -> None:
        time_ns = placement.time_base.clock.run_on(lead.stamps_ns)
        there = placement.index > NOWHERE // 2
        order = np.argsort(placement.index[there], kind="stable")
        index, time_ns = placement.index[there][order], time_ns[there][order]
        self.rate.keep(lead)
        self.rate.add(time_ns, index)
        self._behind_index, self._behind_ns = index[-BEHIND:], time_ns[-BEHIND:]
        sizes = np.ones(time_ns.size, np.int64) if lead.counts is None else lead.counts[there][order]
        self._behind_sizes = sizes[-BEHIND:]
        self._last_log_ns = int(lead.arrivals.log_ns[-1])
        # Where the clock is: the time of the next sample, about the last message so that digits are enough.
        self._reference_ns = int(time_ns[-1])
        off_ns = (self._behind_ns - self._reference_ns) + (self.next_index - self._behind_index) * self.rate.period_ns
        self._ahead_ns = float(np.median(off_ns))

    # --- some messages ---

    def _some(self, waiting: Piece, *, last: bool) -> tuple[int, PlacedMessages]:
        """Place some of the messages that wait; how many, and where."""
        part = waiting.kept_slice(slice(0, PART))
        time_ns = part.stamps_ns + self._shift_ns
        sizes = np.ones(time_ns.size, np.int64) if part.counts is None else part.counts
        before = np.cumsum(sizes) - sizes
        off = self._off(time_ns, before)
        agree = np.abs(off) <= self._tolerance
        count = time_ns.size if agree.all() else int(agree.argmin())
        if count:
            chosen = part if count == time_ns.size else part.kept_slice(slice(0, count))
            return count, self._in_line(chosen, time_ns[:count], sizes[:count], off[:count])
        return self._contradiction(waiting, last=last)

    def _off(self, time_ns: Whole, before: Whole) -> Real:
        """Samples by which messages are later than the next places."""
        elapsed_ns = (time_ns - self._reference_ns) - self._ahead_ns
        return np.asarray(elapsed_ns / self.rate.period_ns - before, dtype=np.float64)

    def _in_line(self, piece: Piece, time_ns: Whole, sizes: Whole, off: Real) -> PlacedMessages:
        first = self.next_index + np.cumsum(sizes) - sizes
        self._note(time_ns, first, sizes, piece, float(off.mean()) * FOLLOWED * min(1.0, off.size / 64))
        index = np.arange(first[0], self.next_index)
        return PlacedMessages(index=index, values=piece.values)

    def _note(self, time_ns: Whole, first: Whole, sizes: Whole, piece: Piece, late: float) -> None:
        """Note messages whose places are `first`, and where the clock is behind them."""
        end = int(first[-1] + sizes[-1])
        self._ahead_ns += (end - self.next_index + late) * self.rate.period_ns
        self._ahead_ns -= int(time_ns[-1]) - self._reference_ns
        self._reference_ns, self.next_index = int(time_ns[-1]), end
        self.rate.add(time_ns, first)
        self._behind_index = np.concatenate((self._behind_index, first))[-BEHIND:]
        self._behind_ns = np.concatenate((self._behind_ns, time_ns))[-BEHIND:]
        self._behind_sizes = np.concatenate((self._behind_sizes, sizes))[-BEHIND:]
        self._last_log_ns = int(piece.arrivals.log_ns[-1])

    # --- what contradicts ---

    def _contradiction(self, waiting: Piece, *, last: bool) -> tuple[int, PlacedMessages]:
        """Judge the first message by those behind it: a gap, a clock that was set, or disorder."""
        part = waiting.kept_slice(slice(0, self._ahead))
        if part.stamps_ns.size < self._ahead and not last:
            return 0, self._nothing()
        sizes = np.ones(part.stamps_ns.size, np.int64) if part.counts is None else part.counts
        off = self._off(part.stamps_ns + self._shift_ns, np.cumsum(sizes) - sizes)
        middle = float(np.median(off))
        together = np.abs(off - middle) <= self._tolerance
        if not together.all() or abs(middle) <= self._tolerance:
            return self._by_fit(waiting, last=last)
        jump_ns = middle * self.rate.period_ns
        if self._was_set(jump_ns, int(part.arrivals.log_ns[0]) - self._last_log_ns):
            self._set(jump_ns, part)
            return self._some(waiting, last=last)
        if middle < 0:
            return self._by_fit(waiting, last=last)
        self._gap(round(middle), jump_ns, part)
        return self._some(waiting, last=last)

    def _was_set(self, jump_ns: float, waited_ns: int) -> bool:
        if not self._own_clock:
            # A clock that logs goes back only where it's set.
            return jump_ns < -SET_NS or jump_ns > LEAP_NS
        # Messages that come as ever, while their stamps leap.
        return abs(jump_ns) > SET_NS and abs(waited_ns - jump_ns) > abs(jump_ns) / 2

    def _set(self, jump_ns: float, part: Piece) -> None:
        way = "ahead" if jump_ns > 0 else "back"
        at_s = int(part.stamps_ns[0]) / NS_PER_S
        self.told.append(
            Told(
                kind="clock",
                time_ns=int(part.stamps_ns[0]),
                text=f"the clock of {self.stream.label} was set {way} by {abs(jump_ns) / NS_PER_S:.6g} s to "
                f"{at_s:.3f} s; time runs on, and one sample is left out there",
            )
        )
        # One place stays free: nothing is averaged across.
        self._shift_ns -= round(jump_ns - self.rate.period_ns)
        self._gap(1, 0.0, None)

    def _gap(self, samples: int, jump_ns: float, part: Piece | None) -> None:
        self._ahead_ns += samples * self.rate.period_ns
        self.next_index += samples
        if part is not None:
            self.told.append(
                Told(
                    kind="gap",
                    time_ns=int(part.stamps_ns[0]),
                    text=f"{counted(samples, 'sample')} of {self.stream.label} missing ({jump_ns / NS_PER_S:.4g} s)",
                    samples=samples,
                )
            )
            # A source that paused rarely resumes on the old grid.
            sizes = np.ones(part.stamps_ns.size, np.int64) if part.counts is None else part.counts
            off = self._off(part.stamps_ns + self._shift_ns, np.cumsum(sizes) - sizes)
            self._ahead_ns += float(np.median(off)) * self.rate.period_ns

    def _by_fit(self, waiting: Piece, *, last: bool) -> tuple[int, PlacedMessages]:
        """Let the ordinary fit of the stretch around decide: late messages, repeats, wrong stamps."""
        if waiting.stamps_ns.size < 2 * self._ahead and not last:
            return 0, self._nothing()
        part = waiting.kept_slice(slice(0, 4 * self._ahead))
        known = self._behind_ns.size
        time_ns = np.concatenate((self._behind_ns, part.stamps_ns + self._shift_ns))
        sizes = None if part.counts is None else np.concatenate((self._behind_sizes, part.counts))
        index, taken, clock = self._fitted(time_ns, sizes)
        if clock.count:
            # A step too small to be judged by itself, such as messages that are sent again.
            self._tell_steps(clock)
            time_ns = clock.run_on(time_ns)
            self._shift_ns += int(clock.shift_ns[-1])
        there = index[:known] > NOWHERE // 2
        if index.size and there.any():
            index = np.where(
                index > NOWHERE // 2,
                index + round(float(np.median((self._behind_index - index[:known])[there]))),
                index,
            )
        else:
            # Nothing can be made of them: they are left out, and told.
            index = np.full(time_ns.size, NOWHERE)
        return part.stamps_ns.size, self._spread(part, time_ns[known:], index[known:], taken[known:])

    def _tell_steps(self, clock: ClockSteps) -> None:
        for before_ns, after_ns in zip(clock.before_ns.tolist(), clock.after_ns.tolist(), strict=True):
            way = "ahead" if after_ns > before_ns else "back"
            size_s = abs(after_ns - before_ns) / NS_PER_S
            text = f"the clock of {self.stream.label} was set {way} by {size_s:.4g} s; time runs on"
            self.told.append(Told(kind="clock", time_ns=after_ns - self._shift_ns, text=text))

    def _fitted(self, time_ns: Whole, sizes: Whole | None) -> tuple[Whole, Whole, ClockSteps]:
        stated = StatedRate(hz=self.rate_hz, named=True)
        nothing = np.zeros(time_ns.size, np.int64)
        try:
            found = place_stream(
                self.stream,
                time_ns,
                sizes,
                self.rate.period_ns / NS_PER_S if sizes is not None else 0.0,
                stated=stated,
            )
        except EstimateError:
            return nothing[:0], nothing, ClockSteps()
        if not found.index.size:
            return nothing[:0], nothing, ClockSteps()
        return found.index, nothing if found.taken is None else found.taken, found.time_base.clock

    def _spread(self, part: Piece, time_ns: Whole, index: Whole, taken: Whole) -> PlacedMessages:
        sizes = np.ones(index.size, np.int64) if part.counts is None else part.counts
        placed = (index > NOWHERE // 2) & (taken < sizes)
        within = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        samples = np.where(np.repeat(placed, sizes), np.repeat(index, sizes) + within, NOWHERE)
        samples = np.where(within < np.repeat(taken, sizes), NOWHERE, samples)
        lost = int(np.count_nonzero(~placed))
        self.lost += lost
        if lost:
            self.told.append(
                Told(
                    kind="late",
                    time_ns=int(part.stamps_ns[0]),
                    text=f"{counted(lost, 'message')} of {self.stream.label} left out: repeats, or stamps that "
                    "contradict those around",
                )
            )
        ahead = placed & (index >= self.next_index)
        if ahead.any():
            order = np.argsort(index[ahead], kind="stable")
            self._advance(part, time_ns[ahead][order], index[ahead][order], sizes[ahead][order])
        return PlacedMessages(index=samples, values=part.values)

    def _advance(self, part: Piece, time_ns: Whole, first: Whole, sizes: Whole) -> None:
        skipped = int(first[-1] + sizes[-1]) - self.next_index - int(sizes.sum())
        if skipped > 0:
            self.told.append(
                Told(
                    kind="gap",
                    time_ns=int(time_ns[0]) - self._shift_ns,
                    text=f"{counted(skipped, 'sample')} of {self.stream.label} missing among late messages",
                    samples=skipped,
                )
            )
        late = (time_ns - self._reference_ns - self._ahead_ns) / self.rate.period_ns - (first - self.next_index)
        self._note(time_ns, first, sizes, part, float(np.median(late)) * FOLLOWED)

    def _nothing(self) -> PlacedMessages:
        rows = len(self.stream.sources)
        return PlacedMessages(index=np.zeros(0, np.int64), values=np.zeros((rows, 0), np.float32))


def _joined(first: Piece, second: Piece) -> Piece:
    counts = None
    if first.counts is not None and second.counts is not None:
        counts = np.concatenate((first.counts, second.counts))
    return replace(
        second,
        stamps_ns=np.concatenate((first.stamps_ns, second.stamps_ns)),
        counts=counts,
        values=np.concatenate((first.values, second.values), axis=1),
        arrivals=type(first.arrivals).joined([first.arrivals, second.arrivals]),
    )


def _behind(piece: Piece, used: int) -> Piece:
    return piece.kept_slice(slice(used, None))


def joined_pieces(pieces: list[Piece]) -> Piece:
    """Give several pieces of one stream as one."""
    whole = pieces[0]
    for one in pieces[1:]:
        whole = _joined(whole, one)
    return whole

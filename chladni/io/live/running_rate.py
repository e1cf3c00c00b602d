"""Rate of a clock whose stamps keep coming: the slope of time over index, without keeping all of them."""

from itertools import pairwise

import numpy as np

from chladni.io.clock.clock_verdict import round_rate
from chladni.io.clock.stamp_order import ClockSteps
from chladni.io.gathering import Gathering
from chladni.io.placement import StatedRate
from chladni.io.stream import Piece, Stream
from chladni.signals.arrays import Whole
from chladni.signals.time_series import NS_PER_S

#: Messages whose stamps are kept, so that the very fit of a finished log can be made of them: some MB.
MOST_KEPT = 1 << 19
#: A step of so many periods begins a stretch with a start of its own, as in the fit of a finished log.
NEW_STRETCH = 3.5


class RunningRate:
    """Fits the rate of one stream.

    Parameters
    ----------
    stream
        Whose stamps they are.
    period_ns
        First guess, of the messages of the beginning.
    stated
        Rate that the user states.

    Notes
    -----
    Least squares of time over index with a start for each stretch between gaps: sums of products about the means are
    merged (Chan, Golub & LeVeque 1983, eq. 2.1), so that the slope is that of all stamps together.
    """

    def __init__(self, stream: Stream, period_ns: float, *, stated: StatedRate | None = None) -> None:
        self._kept: Gathering | None = Gathering(stream=stream)
        self._kept_messages = 0
        self._stated = stated
        self._rounded_hz: float | None = None
        self._period_ns = period_ns
        self._origin_ns: int | None = None
        # Of the stretch that is open: count, means of index and of time, sums of products about them.
        self._open = (0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._last: tuple[int, int] | None = None
        self._closed = np.zeros(3)
        self._messages = self._stretches = 0

    @property
    def period_ns(self) -> float:
        """Time between samples, as far as it's known."""
        index_squares, products, _ = self._sums()
        if self._messages - self._stretches < 3 or not index_squares > 0:
            return self._period_ns
        return self._period_ns + products / index_squares

    def keep(self, piece: Piece) -> None:
        """Keep the stamps of a piece while they are few."""
        if self._kept is None:
            return
        self._kept.add(piece, with_values=False)
        self._kept.join_last()
        self._kept_messages += piece.stamps_ns.size
        if self._kept_messages > MOST_KEPT:
            base = self._kept.place(stated=self._stated).time_base
            self._rounded_hz = base.rate_hz if base.uniform and base.snapped else None
            self._kept = None

    def add(self, time_ns: Whole, index: Whole) -> None:
        """Take in messages with their places, both rising; time runs on where the clock was set."""
        if not time_ns.size:
            return
        if self._origin_ns is None:
            self._origin_ns = int(time_ns[0])
        steps = np.diff(index, prepend=index[0] if self._last is None else self._last[0])
        per_message = max(1.0, float(np.median(steps)))
        starts = np.flatnonzero(steps > NEW_STRETCH * per_message)
        edges = [0, *starts.tolist(), time_ns.size]
        for number, (first, end) in enumerate(pairwise(edges)):
            if number:
                self._close()
            if end > first:
                self._merge(time_ns[first:end], index[first:end])
        self._last = int(index[-1]), int(time_ns[-1])

    def rate_hz(self, *, clock: ClockSteps | None = None) -> float:
        """Give the rate that the finished log will have, as well as it is known."""
        if self._kept is not None and self._kept.stamps_ns:
            base = self._kept.place(stated=self._stated, clock=clock).time_base
            if base.uniform:
                return base.rate_hz
        return self.quick_rate_hz()

    def quick_rate_hz(self) -> float:
        """Give the rate by the sums alone."""
        return self._nearest(NS_PER_S / self.period_ns)

    def _nearest(self, rate_hz: float) -> float:
        """The stated or a round rate, where the stamps agree with it."""
        std_hz = self._std_ns() / NS_PER_S * rate_hz**2
        for known in (None if self._stated is None else self._stated.hz, self._rounded_hz):
            if known is not None and abs(known - rate_hz) <= max(3 * std_hz, 1e-9 * rate_hz):
                return known
        return round_rate(rate_hz, std_hz) or rate_hz

    def _std_ns(self) -> float:
        index_squares, products, time_squares = self._sums()
        freedom = self._messages - self._stretches - 1
        if freedom < 1 or not index_squares > 0:
            return float("inf")
        left = max(0.0, time_squares - products**2 / index_squares)
        return float(np.sqrt(left / freedom / index_squares))

    def _sums(self) -> tuple[float, float, float]:
        total = self._closed + np.array(self._open[3:])
        return float(total[0]), float(total[1]), float(total[2])

    def _close(self) -> None:
        self._closed += self._open[3:]
        self._open = (0, 0.0, 0.0, 0.0, 0.0, 0.0)

    def _merge(self, time_ns: Whole, index: Whole) -> None:
        count, mean_index, mean_time, *sums = self._open
        self._stretches += not count
        self._messages += index.size
        run = index.astype(np.float64)
        # What is left of the time over the first guess: large numbers cost digits.
        rise = (time_ns - (self._origin_ns or 0)).astype(np.float64) - self._period_ns * run
        own_index, own_time = float(run.mean()), float(rise.mean())
        run -= own_index
        rise -= own_time
        total = count + index.size
        apart = np.array([own_index - mean_index, own_time - mean_time])
        weight = count * index.size / total
        self._open = (
            total,
            mean_index + apart[0] * index.size / total,
            mean_time + apart[1] * index.size / total,
            sums[0] + float(run @ run) + weight * float(apart[0]) ** 2,
            sums[1] + float(run @ rise) + weight * float(apart[0] * apart[1]),
            sums[2] + float(rise @ rise) + weight * float(apart[1]) ** 2,
        )

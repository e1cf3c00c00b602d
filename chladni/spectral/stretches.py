"""Where a stream of blocks breaks, and what the breaks cost."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Self

import numpy as np

from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.spectral.segmentation import SHORTEST_SEGMENT, Segmentation

Run = tuple[int, int]


def valid_runs(block: TimeSeries) -> list[Run]:
    """Give ``(first, last + 1)`` of each run of samples that are valid in all channels, in order."""
    if block.samples == 0:
        return []
    if block.valid is None:
        return [(0, block.samples)]
    # Cross-spectra need all channels at once, so a sample counts only where all are valid.
    good = np.concatenate([[False], block.valid.all(axis=0), [False]])
    edges = np.flatnonzero(good[1:] != good[:-1])
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def run_lengths(blocks: Sequence[TimeSeries]) -> list[int]:
    """Lengths of the runs of samples that are valid in all channels, over the seams of consecutive blocks."""
    lengths: list[int] = []
    end_ns, open_end = None, False
    for block in blocks:
        runs = valid_runs(block)
        late_s = 0.0 if end_ns is None else abs(block.start_time_ns - end_ns) / NS_PER_S
        goes_on = open_end and late_s <= 0.5 / block.sample_rate_hz
        for first, last in runs:
            if first == 0 and goes_on:
                lengths[-1] += last
            else:
                lengths.append(last - first)
        end_ns = block.start_time_ns + round(block.samples / block.sample_rate_hz * NS_PER_S)
        open_end = bool(runs) and runs[-1][1] == block.samples
    return lengths


class Runs:
    """Finds the runs of samples that are valid in all channels, over the seams of a stream's blocks."""

    def __init__(self) -> None:
        self._stretch = Stretch(Segmentation(samples=SHORTEST_SEGMENT, hop=1))
        self._open = False

    @property
    def longest(self) -> int:
        """Samples of the longest run so far."""
        return self._stretch.longest_run

    def pieces(self, block: TimeSeries) -> list[tuple[bool, TimeSeries]]:
        """Give the valid parts of the next block, each with whether a run begins with it.

        Raises
        ------
        EstimateError
            When the block starts before the last one ended.
        """
        runs = valid_runs(block)
        goes_on = self._open and not self._stretch.breaks_at(block.start_time_ns, block.sample_rate_hz)
        self._stretch.extend(block, runs)
        self._open = bool(runs) and runs[-1][1] == block.samples
        return [(not (goes_on and first == 0), _part(block, first, last)) for first, last in runs]


def _part(block: TimeSeries, first: int, last: int) -> TimeSeries:
    start_ns = block.start_time_ns + round(first / block.sample_rate_hz * NS_PER_S)
    return replace(block, values=block.values[:, first:last], valid=None, start_time_ns=start_ns)


class Stretch:
    """Book of the samples seen: continuity of time, and segments lost to invalid samples.

    A stretch is what lies between two breaks in time; in it are runs of valid samples. Skipped segments are those
    that the stretch would have had more without invalid samples.
    """

    def __init__(self, segmentation: Segmentation) -> None:
        self.segmentation = segmentation
        self.start_ns: int | None = None
        self.end_ns: int | None = None
        self.longest_run = 0
        self._measured: set[str] = set()
        self._samples = 0
        self._run = 0
        self._segments_of_runs = 0
        self._skipped_before = 0

    @property
    def skipped(self) -> int:
        """Segments left out so far because samples in them are invalid."""
        possible = self.segmentation.count(self._samples)
        return self._skipped_before + possible - self._segments_of_runs - self.segmentation.count(self._run)

    def never_measured(self, channels: Sequence[Channel]) -> list[str]:
        """Names of those of these channels that had no valid sample yet."""
        return [channel.name for channel in channels if channel.name not in self._measured]

    def breaks_at(self, start_ns: int, sample_rate_hz: float) -> bool:
        """Whether a block that starts then doesn't continue the last one; half a sample is forgiven.

        Raises
        ------
        EstimateError
            When the block starts before the last one ended.
        """
        if self.end_ns is None:
            return False
        # Stamps are rounded to nanoseconds and clocks are fitted: half a sample decides which sample comes next.
        late_s = (start_ns - self.end_ns) / NS_PER_S
        if late_s < -0.5 / sample_rate_hz:
            raise EstimateError(
                f"a block starts {-late_s:g} s before the last one ended; give blocks in time order, none twice "
                "(TimeSeries.window keeps the time of a part)"
            )
        return late_s > 0.5 / sample_rate_hz

    def extend(self, block: TimeSeries, runs: Sequence[Run]) -> None:
        """Take note of a block and its runs."""
        if self.breaks_at(block.start_time_ns, block.sample_rate_hz):
            # What wasn't recorded isn't skipped: only segments within a stretch are counted.
            self._skipped_before = self.skipped
            self._samples = self._run = self._segments_of_runs = 0
        there = None if block.valid is None else np.asarray(block.valid.any(axis=1))
        self._measured.update(one.name for row, one in enumerate(block.channels) if there is None or there[row])
        self.extend_by(block.samples, runs)
        self.start_ns = block.start_time_ns if self.start_ns is None else self.start_ns
        # From this block's own start, so that rounding doesn't add up over blocks.
        self.end_ns = block.start_time_ns + round(block.samples / block.sample_rate_hz * NS_PER_S)

    def extend_by(self, samples: int, runs: Sequence[Run]) -> None:
        """Take note of so many samples that follow, and the runs in them."""
        cursor = 0
        for first, last in runs:
            # The run before the gap may have begun in an earlier block.
            if first > cursor:
                self._close_run()
            self._run += last - first
            self.longest_run = max(self.longest_run, self._run)
            cursor = last
        if cursor < samples:
            self._close_run()
        self._samples += samples

    def merge(self, other: Self) -> None:
        """Add what another book has lost; the stretch that is open here goes on."""
        self._skipped_before += other.skipped
        self.longest_run = max(self.longest_run, other.longest_run)

    def require_before(self, other: Self) -> None:
        """Raise `EstimateError` unless all that was seen here was before all that was seen there."""
        if self.end_ns is not None and other.start_ns is not None and other.start_ns < self.end_ns:
            raise EstimateError(
                f"exponential averages merge in time order only: the other starts "
                f"{(self.end_ns - other.start_ns) / NS_PER_S:g} s before this one ends"
            )

    def copy(self) -> Self:
        """Give an independent copy."""
        return copy(self)

    def _close_run(self) -> None:
        self._segments_of_runs += self.segmentation.count(self._run)
        self._run = 0

"""The part of a log in which nothing is missing."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from chladni.gap.calibration import FEWEST_SAMPLES, MOST, SLIGHT
from chladni.signals.arrays import Mask
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted
from chladni.spectral.filters import channel_runs

# Times to cut at are told to a tenth of a millisecond.
_TOLD_HZ = 1e4


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """What was read of which log, when it begins there, and what of the file couldn't be read, for messages."""

    log: str
    begins_s: float = 0.0
    damage: Sequence[str] = ()


def good_samples(recording: TimeSeries, rows: Sequence[int]) -> Mask:
    """Samples that every one of these rows has."""
    chosen = list(rows)
    good = np.isfinite(recording.values[chosen]).all(axis=0)
    if recording.valid is not None:
        good &= recording.valid[chosen].all(axis=0)
    return np.asarray(good)


def whole_stretch(
    recording: TimeSeries, rows: Sequence[int], needed: Collection[int], read: Read
) -> tuple[slice, tuple[str, ...]]:
    """Give the longest stretch without a missing sample, and a sentence when it isn't all of the log.

    Parameters
    ----------
    needed
        Those of them that a model can't do without: its inputs.

    Raises
    ------
    LogError
        When it's less than half of the log, or too short.
    """
    good = good_samples(recording, rows)
    stretch, samples, rate_hz = _longest(good), good.size, recording.sample_rate_hz
    length = stretch.stop - stretch.start
    if samples < FEWEST_SAMPLES:
        raise LogError(
            f"{read.log}: {samples / rate_hz:g} s at {rate_hz:g} Hz are {counted(samples, 'sample')}; at least "
            f"{FEWEST_SAMPLES} samples are needed; take a longer part, or record longer"
        )
    if length < MOST * samples or length < FEWEST_SAMPLES:
        raise LogError(_too_little(recording, rows, needed, stretch, read))
    if length == samples:
        return stretch, ()
    told = (
        f"{read.log} lacks {counted(int((~good).sum()), 'sample')}; used is its longest stretch without gaps, "
        f"{stretch.start / rate_hz:g} s to {stretch.stop / rate_hz:g} s of {samples / rate_hz:g} s"
    )
    return stretch, (told,)


def _longest(good: Mask) -> slice:
    return slice(*max(channel_runs(good), key=lambda run: run[1] - run[0], default=(0, 0)))


def _too_little(
    recording: TimeSeries, rows: Sequence[int], needed: Collection[int], stretch: slice, read: Read
) -> str:
    """Say how much is whole, what is missing and why, and what may be done."""
    rate_hz, length = recording.sample_rate_hz, stretch.stop - stretch.start
    missing = [int((~good_samples(recording, [row])).sum()) for row in rows]
    worst = rows[int(np.argmax(missing))]
    todo = []
    if length >= FEWEST_SAMPLES:
        todo.append(f"take that stretch alone ({_options(stretch, rate_hz, read.begins_s)})")
    others = _longest(good_samples(recording, [row for row in rows if row != worst]))
    # Only where it's the one channel that has the gaps, and one of several that are compared.
    if worst not in needed and others.stop - others.start >= MOST * recording.samples:
        todo.append("leave that output out of the model")
    if not todo:
        todo.append("record it without gaps")
    told = "; ".join(one.removeprefix("Damage ").rstrip(".") for one in read.damage)
    damage = f"the file is damaged ({told}); " if told else ""
    return (
        f"{read.log}: {damage}the longest stretch without missing samples is {length / rate_hz:g} s "
        f"({counted(length, 'sample')}) of {recording.samples / rate_hz:g} s; at least half of the log and "
        f"{FEWEST_SAMPLES} samples are needed; {recording.channels[worst].name!r} lacks "
        f"{counted(max(missing), 'sample')}; {', or '.join(todo)}"
    )


def _options(stretch: slice, rate_hz: float, begins_s: float) -> str:
    """Options of the command line that give a stretch, and no sample beyond."""
    # Rounding of the sum must not cost a sample, nor take one in.
    start_s = ceil((begins_s + stretch.start / rate_hz) * _TOLD_HZ - SLIGHT) / _TOLD_HZ
    end_s = floor((begins_s + stretch.stop / rate_hz) * _TOLD_HZ + SLIGHT) / _TOLD_HZ
    start = f"--start {start_s:.10g} " if start_s > 0 else ""
    return f"{start}--end {end_s:.10g}"

"""Samples of one sensor, with what rules on its faults ask of them: steps, stillness, leaps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Whole
from chladni.signals.channel import Channel

# A leap is this many medians of the local step; Gaussian noise of 10^7 samples reaches 8.
LEAP = 30.0
_LEAP_BLOCK = 4096


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorRecord:
    """Good samples of a channel, with what several rules need of them."""

    channel: Channel
    samples: NDArray[np.floating]
    still: Whole
    leaps: Whole
    typical_step: float
    smallest_step: float
    low: float
    high: float

    def step(self, places: Whole) -> NDArray[np.floating]:
        """Magnitude of the steps from these samples to the next ones; 0 outside."""
        inside = np.clip(places, 0, self.samples.size - 2)
        steps = np.abs(self.samples[inside + 1] - self.samples[inside])
        return np.where(inside == places, steps, 0)


def sensor_record(channel: Channel, samples: NDArray[np.floating]) -> SensorRecord:
    """Look once through a channel's good samples."""
    starts = np.unique(np.linspace(0, max(0, samples.size - _LEAP_BLOCK), 64).astype(np.int64))
    some = np.concatenate([np.abs(np.diff(samples[start : start + _LEAP_BLOCK])) for start in starts])
    moving = some[some > 0]
    typical = float(np.median(moving)) if moving.size else 0.0
    smallest = float(moving.min()) if moving.size else 0.0
    still, leaps = _scan(samples, floor=max(0.25 * LEAP * typical, 4 * smallest))
    return SensorRecord(
        channel=channel,
        samples=samples,
        still=still,
        leaps=leaps,
        typical_step=typical,
        smallest_step=smallest,
        low=float(samples.min()),
        high=float(samples.max()),
    )


def _scan(samples: NDArray[np.floating], *, floor: float) -> tuple[Whole, Whole]:
    """Find steps of zero, and leaps: steps above `floor` and far above the median of their block of 4096."""
    still, leaps = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for start in range(0, samples.size - 1, _LEAP_BLOCK):
        # A block at a time stays in the cache.
        steps = np.abs(np.diff(samples[start : start + _LEAP_BLOCK + 1]))
        if steps.min() == 0:
            still.append(np.flatnonzero(steps == 0) + start)
        if steps.max() > floor:
            limit = max(LEAP * float(np.median(steps[::8])), floor)
            leaps.append(np.flatnonzero(steps > limit) + start)
    return np.concatenate(still), np.concatenate(leaps)


def runs(places: Whole) -> tuple[Whole, Whole]:
    """First of each run of consecutive whole numbers, and its length."""
    breaks = np.flatnonzero(np.diff(places, prepend=-2) != 1)
    return places[breaks], np.diff(breaks, append=places.size)

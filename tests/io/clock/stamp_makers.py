"""Stamps with known flaws, for tests of the clock."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Whole

START_NS = 1_700_000_000_000_000_000


def stamps(seconds: NDArray[Any]) -> Whole:
    """Seconds to whole nanoseconds since the epoch."""
    return START_NS + np.rint(np.asarray(seconds, dtype=np.float64) * 1e9).astype(np.int64)


def grid(rate_hz: float, samples: int) -> Whole:
    """An ideal clock, rounded to nanoseconds."""
    return stamps(np.arange(samples) / rate_hz)


def in_bursts(samples: int, *, size: int, rate_hz: float, spread_s: float = 0.0) -> Whole:
    """Messages of one sample each that are delivered `size` at a time, when the last of them is there."""
    number = np.arange(samples)
    return stamps((number // size + 1) * size / rate_hz + (number % size) * spread_s)

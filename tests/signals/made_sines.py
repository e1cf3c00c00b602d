"""Series of sines whose values are known at any time."""

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

START_NS = 1_700_000_000_000_000_000


def one(values: NDArray[np.floating], rate_hz: float, *, start_ns: int = START_NS, name: str = "a") -> TimeSeries:
    return TimeSeries(
        values=np.atleast_2d(values), sample_rate_hz=rate_hz, start_time_ns=start_ns, channels=(Channel(name=name),)
    )


def sine(
    frequency_hz: float, rate_hz: float, samples: int, *, start_ns: int = START_NS, name: str = "a"
) -> TimeSeries:
    times = np.arange(samples) / rate_hz + (start_ns - START_NS) * 1e-9
    return one(np.cos(2 * np.pi * frequency_hz * times + 0.3), rate_hz, start_ns=start_ns, name=name)


def truth(frequency_hz: float, series: TimeSeries) -> Real:
    times = series.times_s() + (series.start_time_ns - START_NS) * 1e-9
    return np.cos(2 * np.pi * frequency_hz * times + 0.3)

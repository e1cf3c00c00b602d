"""Logs of a few seconds for studies: lines, and two modes that drift from log to log."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from chladni import Channel, TimeSeries, write_mcap

RATE_HZ = 400.0
DAY_NS = 86_400 * 10**9
START_NS = 1_700_000_000 * 10**9


def resonance(drive: NDArray[np.float64], frequency_hz: float, damping_ratio: float) -> NDArray[np.float64]:
    """Give the response of one mode to a drive, by its poles (impulse invariance)."""
    pole = np.exp((-damping_ratio + 1j * np.sqrt(1 - damping_ratio**2)) * 2 * np.pi * frequency_hz / RATE_HZ)
    return np.asarray(lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], drive))


def write_log(path: Path, *, seed: int = 0, seconds: float = 4.0, start_ns: int = START_NS, line_hz: float = 50.0,
              mode_hz: float = 90.0, gain: float = 1.0, temperature: float = 20.0) -> Path:  # fmt: skip
    """Write a log of two accelerations, with a line and a mode in both, and a temperature."""
    rng = np.random.default_rng(seed)
    samples = round(seconds * RATE_HZ)
    t = np.arange(samples) / RATE_HZ
    mode = resonance(rng.standard_normal(samples), mode_hz, 0.01)
    line = np.sin(2 * np.pi * line_hz * t)
    values = np.stack(
        [
            gain * (mode + line) + 0.1 * rng.standard_normal(samples),
            gain * (line - 0.5 * mode) + 0.1 * rng.standard_normal(samples),
            temperature + 0.01 * rng.standard_normal(samples),
        ]
    )
    channels = (
        Channel(name="/tip.x", unit="m/s^2"), Channel(name="/root.x", unit="m/s^2"), Channel(name="/air.t", unit="K")
    )  # fmt: skip
    series = TimeSeries(values=values, sample_rate_hz=RATE_HZ, start_time_ns=start_ns, channels=channels)
    write_mcap(series, path, layout="batches")
    return path

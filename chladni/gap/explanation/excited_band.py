"""The band in which a machine moved."""

import numpy as np

from chladni.gap.calibration import TAIL, ZERO
from chladni.gap.records.measurement import Measurement


def excited_band_hz(measurement: Measurement) -> tuple[float, float]:
    """Give the lowest and highest frequency of the band that holds 99 % of the outputs' power."""
    signals = measurement.outputs / np.maximum(np.std(measurement.outputs, axis=1, keepdims=True), ZERO)
    power = np.sum(np.abs(np.fft.rfft(signals - signals.mean(axis=1, keepdims=True), axis=1)) ** 2, axis=0)
    total = np.cumsum(power) / max(float(power.sum()), ZERO)
    low, high = np.searchsorted(total, (TAIL, 1 - TAIL))
    step = measurement.sample_rate_hz / measurement.samples
    return float(max(low, 1) * step), float(max(high, 2) * step)

"""The level that an output's spectrum doesn't fall below: what is left of noise when distortion hides it."""

import numpy as np

from chladni.gap.calibration import FEWEST_SAMPLES, GRANTED, GRID, SOME
from chladni.gap.comparison.autoregressive import noise_floor_of
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor


def quiet_floor(measurement: Measurement) -> NoiseFloor:
    """Take the quiet lines of each output for its noise, as if that were white.

    A bound from below where noise has more power where the machine responds. It's for a single sensor beside strong
    distortion, where every other estimate holds the distortion, and hypotheses are compared with each other more
    than with the noise.
    """
    outputs = measurement.outputs - measurement.outputs.mean(axis=1, keepdims=True)
    length = min(GRID, max(FEWEST_SAMPLES // 2, measurement.samples // 8))
    window = np.hanning(length)
    count = measurement.samples // length
    segments = outputs[:, : count * length].reshape(len(outputs), count, length) * window
    density = np.mean(np.abs(np.fft.rfft(segments, axis=2)) ** 2, axis=1) / np.sum(window**2)
    level = np.quantile(density, SOME, axis=1) + GRANTED * np.mean(outputs**2, axis=1)
    return noise_floor_of(
        np.broadcast_to(level[:, None], density.shape),
        samples=measurement.samples,
        freedom=np.full(len(outputs), 2.0 * count),
        method=("quiet band",) * len(outputs),
        upper_bound=np.zeros(len(outputs), dtype=np.bool_),
        scale=np.std(outputs, axis=1),
    )

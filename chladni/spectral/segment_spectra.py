"""Windowed Fourier transforms of many segments at once, laid out for matrix products line by line."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import fft

from chladni.signals.arrays import Complex, Real
from chladni.spectral.segmentation import Detrend, Segmentation

# Segments are transformed in groups of about this many samples, so that a group stays in the second-level cache
# from detrending to the transform.
GROUP_SAMPLES = 1 << 18


def segment_spectra(
    values: NDArray[np.floating],
    segmentation: Segmentation,
    window: Real,
    executor: Executor | None = None,
) -> Complex:
    """Transform all whole segments of a stretch of samples.

    Parameters
    ----------
    values
        ``[channel, sample]``, finite, at least one segment long.
    segmentation
        Segments, and what is removed from each.
    window
        ``[segmentation.samples]``, the window.
    executor
        Threads to share the work, or None.

    Returns
    -------
    ndarray
        ``[frequency, segment, channel]``, unscaled: X(k) = sum of w(n) x(n) e^{-j 2 pi k n / N}.
    """
    # Segment before channel, as in the result: a group's lines then go to their places in long strides.
    segments = sliding_window_view(values, segmentation.samples, axis=1)[:, :: segmentation.hop].transpose(1, 0, 2)
    count, channels = segments.shape[:2]
    spectra = np.empty((segmentation.samples // 2 + 1, count, channels), dtype=np.complex128)
    size = max(1, GROUP_SAMPLES // (channels * segmentation.samples))

    def transform(first: int) -> None:
        group = segments[first : first + size]
        lines = fft.rfft(_prepare(group, segmentation.detrend, window), axis=-1, overwrite_x=True)
        spectra[:, first : first + size] = lines.transpose(2, 0, 1)

    run_all(transform, range(0, count, size), executor)
    return spectra


def run_all(work: Callable[[int], None], starts: Sequence[int], executor: Executor | None) -> None:
    """Call `work` for each start, on the executor's threads when it pays; errors are raised here."""
    for _ in (map if executor is None or len(starts) < 2 else executor.map)(work, starts):
        pass


def _prepare(segments: NDArray[np.floating], detrend: Detrend, window: Real) -> Real:
    # Made here in C order: NumPy would keep the order of the samples in memory, channel before segment.
    residual = np.empty(segments.shape)
    if detrend == "none":
        np.multiply(segments, window, out=residual)
        return residual
    mean = segments.mean(axis=-1, keepdims=True, dtype=np.float64)
    np.subtract(segments, mean, out=residual)
    if detrend == "linear":
        # With the time counted from the middle, slope and mean are independent.
        ramp = np.arange(window.size) - (window.size - 1) / 2
        slope = residual @ ramp / (ramp @ ramp)
        residual -= slope[..., np.newaxis] * ramp
    residual *= window
    return residual

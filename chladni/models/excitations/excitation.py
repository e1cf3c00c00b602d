"""What every excitation can do, and the checks that all share."""

from math import isfinite
from typing import Protocol

import numpy as np

from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ModelError


class Excitation(Protocol):
    """A signal that drives one input of a simulation."""

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:
        """Give ``[sample]`` in the input's unit.

        Parameters
        ----------
        count
            Number of samples.
        sample_rate_hz
            Samples a second.
        rng
            Source of everything random.
        """


def require_number(excitation: object, name: str, value: float, *, positive: bool = False) -> None:
    """Raise `ModelError` unless the field `name` is finite, and above zero when `positive`."""
    if not isfinite(value) or (positive and value <= 0):
        rule = "finite and positive" if positive else "finite"
        raise ModelError(f"{type(excitation).__name__}: {name} = {value} must be {rule}")


def band_lines(excitation: object, band_hz: tuple[float, float] | None, frequency_hz: Real) -> Mask:
    """Find the lines inside a band, both ends included; everything but zero and the highest without a band.

    Raises
    ------
    ModelError
        When the band is turned round, goes beyond half the sample rate, or holds no line.
    """
    # The line at half the sample rate has no phase of its own, the one at zero is a mean.
    usable = (frequency_hz > 0) & (np.arange(frequency_hz.size) < frequency_hz.size - 1)
    if band_hz is None:
        return usable
    low, high = band_hz
    name, nyquist = type(excitation).__name__, float(frequency_hz[-1])
    if not 0 <= low < high:
        raise ModelError(f"{name}: band {low:g} to {high:g} Hz must rise from 0 Hz or more")
    if high >= nyquist:
        raise ModelError(f"{name}: band to {high:g} Hz needs a sample rate above {2 * high:g} Hz")
    slack = 1e-9 * nyquist
    inside = usable & (frequency_hz >= low - slack) & (frequency_hz <= high + slack)
    if not inside.any():
        step = float(frequency_hz[1]) if frequency_hz.size > 1 else nyquist
        raise ModelError(f"{name}: no line between {low:g} and {high:g} Hz; lines are {step:g} Hz apart")
    return inside

"""Which numbers estimators can work with: those whose squares can be squared again."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.wording import counted

#: Estimators square values, and what they square again is as small as the last bit of a value, or as large as a sum
#: over a log. With both, fourth powers of numbers between these two are numbers of double precision still: at the
#: lower end (2^-200 2^-52)^4 = 2^-1008, at the upper one (2^200 2^40)^4 = 2^960, of 2^-1022 to 2^1024.
SMALLEST, LARGEST = 2.0**-200, 2.0**200
#: Of a model's numbers products of three are formed (a slope of a resolvent is one), and seldom more.
SMALLEST_OF_MODEL, LARGEST_OF_MODEL = 2.0**-340, 2.0**340

Runs = Sequence[tuple[int, int]]
# Samples of each channel looked at twice in a row: so many stay in the cache between.
SAMPLES_AT_ONCE = 1 << 14


def largest_magnitudes(values: NDArray[np.floating], runs: Runs | None = None) -> Real:
    """Give ``[channel]`` the largest magnitude of ``values[channel, sample]``; NaN and inf where one isn't finite.

    Parameters
    ----------
    values
        Samples of each channel.
    runs
        First sample and end of the stretches that are looked at; all samples if None.
    """
    found = np.zeros(len(values))
    for first, last in [(0, values.shape[1])] if runs is None else runs:
        for start in range(first, last, SAMPLES_AT_ONCE):
            part = values[:, start : min(start + SAMPLES_AT_ONCE, last)]
            # Two passes without a copy: the magnitudes of a gigabyte would be another one.
            np.maximum(found, np.maximum(part.max(axis=1), -part.min(axis=1)), out=found)
    return found


def rms(values: NDArray[np.floating]) -> Real:
    """Give the root mean square of any finite numbers along the last axis, however large or small they are.

    They are divided by a power of two before they are squared, which costs no digit.
    """
    largest = np.abs(values).max(axis=-1, keepdims=True, initial=0.0)
    # Beside the largest, what that makes vanish counts for nothing.
    exponent = np.where(largest > 0, np.frexp(largest)[1], 0)
    scaled = np.ldexp(np.asarray(values, dtype=np.float64), -exponent)
    return np.asarray(np.ldexp(np.sqrt(np.mean(np.square(scaled), axis=-1)), exponent[..., 0]), dtype=np.float64)


def out_of_range(largest: float) -> str | None:
    """Say what is wrong with a channel of this largest magnitude, None if nothing is; a channel of zeros is fine."""
    if largest > LARGEST:
        return f"holds values up to {largest:.3g}, and {LARGEST:.2g} is the most that can be worked with; {_REMEDY}"
    if 0 < largest < SMALLEST:
        return f"holds {largest:.3g} at most, and {SMALLEST:.2g} is the least that can be worked with; {_REMEDY}"
    return None


#: A sensitivity divides the numbers, whatever they stand for.
_REMEDY = 'leave the channel out, or scale it in a setup file, by `unit = "V"` and its sensitivity'


def require_in_range(channels: Sequence[Channel], largest: Real) -> None:
    """Raise `EstimateError` naming the channels whose ``largest[channel]`` magnitude no estimator can square."""
    faults = [
        f"channel {channel.name!r} {fault}"
        for channel, one in zip(channels, largest.tolist(), strict=True)
        if (fault := out_of_range(one)) is not None
    ]
    if faults:
        more = f" (and {counted(len(faults) - 1, 'more channel')} like it)" if len(faults) > 1 else ""
        raise EstimateError(faults[0] + more)

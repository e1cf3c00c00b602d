"""How much each line of each response counts in a fit of frequency responses."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import Value

Weighting = Literal["std", "uniform", "relative"]

# An estimated sigma may come out far too small by chance; below this part of the typical one it counts no more.
FLOOR = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeightedLines(Value):
    """Frequency responses made comparable: free of units, each line with its weight.

    Attributes
    ----------
    frequency_hz
        ``[line]`` those that are used.
    values
        ``[response, reference, line]``, each reference divided by its `reference_scale`; zero where unusable.
    weight
        ``[response, line]``, zero where a line of a response is unusable.
    reference_scale
        ``[reference]``.
    noise_power
        ``[reference, line]`` variance expected of the weighted values, summed over the responses; zero where unknown.
    notes
        What was left out, and why.
    """

    frequency_hz: Real
    values: NDArray[np.complexfloating]
    weight: Real
    reference_scale: Real
    noise_power: Real
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()


def weighted_lines(
    response: FrequencyResponse, *, band_hz: tuple[float, float] | None, weighting: Weighting
) -> WeightedLines:
    """Choose the excited lines within a band and weigh them.

    Parameters
    ----------
    response
        Any form; a line that isn't finite counts for nothing in its response.
    band_hz
        Lowest and highest line, inclusive; None for all. The line at 0 Hz is never used: few sensors measure it.
    weighting
        ``std``: inverse of one sigma, root mean square over the references, times the root of the magnitude that the
        responses have together on a line; where no response knows its sigma, as ``uniform``. ``uniform``: inverse of
        the rms of each response. ``relative``: inverse of the magnitude.

    Raises
    ------
    EstimateError
        When fewer than four lines are left, the band is empty, or the weighting unknown.

    Notes
    -----
    The error B - H A of a linear fit has the sigma of H times abs(A), and A is small where H peaks: its best weight
    goes towards abs(H)/sigma. The geometric mean of that and 1/sigma serves weak modes as well.
    """
    if weighting not in get_args(Weighting):
        raise EstimateError(f"weighting {weighting!r} is none of {', '.join(get_args(Weighting))}")
    finite = np.isfinite(response.values).all(axis=1)
    chosen = _lines(response, finite.any(axis=0), band_hz)
    usable = finite[:, chosen]
    # A weight is one for all references of a response, so that a line counts with all of them or not at all.
    values = np.asarray(np.where(usable[:, None], response.values[..., chosen], 0), dtype=np.complex128)
    if not np.any(values):
        raise EstimateError("the frequency responses are zero or not finite on every line used: nothing to fit")
    std = response.std[..., chosen]
    known = np.isfinite(std) & usable[:, None]
    frequency_hz = response.frequency_hz[chosen]
    if weighting == "std" and np.any(std[known] > 0):
        return _by_std(response, frequency_hz, values, np.where(known, std, np.nan))
    return _by_magnitude(frequency_hz, values, usable, relative=weighting == "relative")


def _lines(response: FrequencyResponse, finite: Mask, band_hz: tuple[float, float] | None) -> Index:
    frequency_hz = response.frequency_hz
    low, high = band_hz if band_hz is not None else (float(frequency_hz[0]), float(frequency_hz[-1]))
    if not 0 <= low < high:
        raise EstimateError(f"band {low:g} to {high:g} Hz: the first must be 0 or more and less than the second")
    inside = (frequency_hz >= low) & (frequency_hz <= high) & (frequency_hz > 0) & response.excited
    chosen = np.flatnonzero(inside & finite)
    if chosen.size < 4:
        raise EstimateError(
            f"{chosen.size} excited lines with values between {low:g} and {high:g} Hz; poles need at least 4: "
            f"widen the band or measure with a finer resolution"
        )
    return chosen


def _by_magnitude(frequency_hz: Real, values: Complex, usable: Mask, *, relative: bool) -> WeightedLines:
    scale = _typical(_rms(values, (2,)), axis=0)
    scaled = values / scale[:, None]
    # A function that is zero has no scale of its own.
    level = _rms(scaled, (1,))
    typical = _or_one(_rms(level, (1,)))[:, None]
    return WeightedLines(
        frequency_hz=frequency_hz,
        values=scaled,
        weight=usable / (np.hypot(level, FLOOR * typical) if relative else typical),
        reference_scale=scale,
        noise_power=np.zeros(values.shape[1:]),
    )


def _by_std(
    response: FrequencyResponse,
    frequency_hz: Real,
    values: Complex,
    std: Real,
) -> WeightedLines:
    # Any units of the references give the same numbers from here on.
    scale = _typical(std, axis=(0, 2))
    scaled, sigma = values / scale[:, None], std / scale[:, None]
    usable: Mask = np.all(np.isfinite(sigma), axis=1)
    level = np.where(usable, _rms(sigma, (1,)), 1.0)
    floor = _typical(np.where(usable, level, np.nan), axis=1)
    steady = usable / np.hypot(level, FLOOR * floor[:, None])
    # Responses count alike in the magnitude, or the unit of the largest would choose the lines.
    magnitude = _rms(scaled, (1,))
    weight = steady * np.sqrt(_rms(magnitude / _or_one(_rms(magnitude, (1,)))[:, None], (0,)))
    without = [channel.name for channel, lines in zip(response.responses, usable, strict=True) if not lines.any()]
    notes = (
        (f"not used for the poles, as no line has a finite value and std: {', '.join(without)}",) if without else ()
    )
    return WeightedLines(
        frequency_hz=frequency_hz,
        values=scaled,
        weight=weight,
        reference_scale=scale,
        noise_power=np.einsum("ok,oik->ik", weight**2, np.where(usable[:, None], sigma, 0) ** 2),
        notes=notes,
    )


def _typical(numbers: Real, axis: int | tuple[int, ...]) -> Real:
    """Geometric mean of the positive numbers, 1 where there are none; NaN counts for nothing.

    Unlike other means it only takes over the factor when a channel's unit changes.
    """
    positive = numbers > 0
    logs = np.log(numbers, where=positive, out=np.zeros_like(numbers))
    return np.asarray(np.exp(logs.sum(axis=axis) / np.maximum(positive.sum(axis=axis), 1)))


def _rms(values: NDArray[Any], axis: tuple[int, ...]) -> Real:
    power = values.real**2
    if np.iscomplexobj(values):
        power += values.imag**2
    return np.asarray(np.sqrt(power.mean(axis=axis)), dtype=np.float64)


def _or_one(numbers: Real) -> Real:
    return np.where(numbers > 0, numbers, 1.0)

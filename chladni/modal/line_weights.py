"""How much each line of each response counts in a fit of frequency responses."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

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
    notes
        What was left out, and why.
    """

    frequency_hz: NDArray[np.float64]
    values: NDArray[np.complexfloating[Any, Any]]
    weight: NDArray[np.float64]
    reference_scale: NDArray[np.float64]
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
        ``std``: inverse of one sigma, root mean square over the references; where no response knows its sigma, as
        ``uniform``: each response by the inverse of its rms; ``relative``: inverse of the magnitude.

    Raises
    ------
    EstimateError
        When fewer than four lines are left, the band is empty, or the weighting unknown.
    """
    if weighting not in get_args(Weighting):
        raise EstimateError(f"weighting {weighting!r} is none of {', '.join(get_args(Weighting))}")
    chosen = _lines(response, band_hz)
    usable = np.isfinite(response.values).all(axis=1)[:, chosen]
    values = np.asarray(np.where(usable[:, None], response.values[..., chosen], 0), dtype=np.complex128)
    if not np.any(values):
        raise EstimateError("the frequency responses are zero or not finite on every line used: nothing to fit")
    weight, scale, notes = _weights(response, values, usable, chosen, weighting)
    return WeightedLines(
        frequency_hz=response.frequency_hz[chosen],
        values=values / scale[:, None],
        weight=weight,
        reference_scale=scale,
        notes=notes,
    )


def _lines(response: FrequencyResponse, band_hz: tuple[float, float] | None) -> NDArray[np.intp]:
    frequency_hz = response.frequency_hz
    low, high = band_hz if band_hz is not None else (float(frequency_hz[0]), float(frequency_hz[-1]))
    if not 0 <= low < high:
        raise EstimateError(f"band {low:g} to {high:g} Hz: the first must be 0 or more and less than the second")
    inside = (frequency_hz >= low) & (frequency_hz <= high) & (frequency_hz > 0) & response.excited
    inside &= np.isfinite(response.values).all(axis=1).any(axis=0)
    chosen = np.flatnonzero(inside)
    if chosen.size < 4:
        raise EstimateError(
            f"{chosen.size} excited lines with values between {low:g} and {high:g} Hz; poles need at least 4: "
            f"widen the band or measure with a finer resolution"
        )
    return chosen


def _weights(
    response: FrequencyResponse,
    values: NDArray[Any],
    usable: NDArray[np.bool_],
    chosen: NDArray[np.intp],
    weighting: Weighting,
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[str, ...]]:
    std = response.std[..., chosen]
    known = np.isfinite(std) & usable[:, None]
    if weighting == "std" and np.any(std[known] > 0):
        return _by_std(response, std, known)
    scale = _or_one(_rms(values, (0, 2)))
    level = _rms(values / scale[:, None], (1,))
    typical = _or_one(_rms(level, (1,)))[:, None]
    if weighting == "relative":
        return usable / np.hypot(level, FLOOR * typical), scale, ()
    return usable / typical, scale, ()


def _by_std(
    response: FrequencyResponse, std: NDArray[np.float64], known: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[str, ...]]:
    positive = np.where(known & (std > 0), std, np.nan)
    scale = np.array([_median(positive[:, reference]) for reference in range(std.shape[1])])
    usable: NDArray[np.bool_] = np.all(known, axis=1)
    level = _rms(np.where(usable[:, None], std, 0) / scale[:, None], (1,))
    floor = np.array([_median(np.where(row > 0, row, np.nan)) for row in level])[:, None]
    without = [channel.name for channel, lines in zip(response.responses, usable, strict=True) if not lines.any()]
    notes = (f"not used for the poles, as no line has a finite std: {', '.join(without)}",) if without else ()
    return usable / np.hypot(level, FLOOR * floor), scale, notes


def _median(numbers: NDArray[np.float64]) -> float:
    """Median without the NaN, 1 where nothing is left."""
    left = numbers[np.isfinite(numbers)]
    return float(np.median(left)) if left.size else 1.0


def _rms(values: NDArray[Any], axis: tuple[int, ...]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(np.mean(np.abs(values) ** 2, axis=axis)), dtype=np.float64)


def _or_one(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(numbers > 0, numbers, 1.0)

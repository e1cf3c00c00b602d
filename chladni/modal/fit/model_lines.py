"""The lines that a modal model is fitted to, with their weights."""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from chladni.modal.fit.lag_window import LagWindow, lag_window
from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import Value
from chladni.spectral.forms import ORDER, form

# Below this share of a function's largest magnitude a standard deviation is rounding, not noise.
ROUNDING = 1e-8
EXACT = 1e-13
# Steps until level and share of the variance stand still.
ROUNDS = 60
UNKNOWN_STD = "the functions carry no standard deviation: error bars rest on what the fit leaves of each function"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModelLines(Value):
    """Excited and finite lines within a band.

    Attributes
    ----------
    frequency_hz
        ``[line]``, above 0.
    values
        ``[response, reference, line]`` complex; 0 where a function has no value.
    weights
        ``[response, reference, line]`` 1/variance, 0 where a function has no value. The variance is that of Re H and
        of Im H: `FrequencyResponse.std` is the error along H, and that across H is as large.
    order
        2 for accelerance, 1 for mobility, 0 for receptance.
    window
        How averaging over segments shortens impulse responses; None where it doesn't.
    weighted
        Whether `weights` come from `std`; else they are the same over each function.
    notes
        Where the weights come from, when not from `std`.
    """

    frequency_hz: Real
    values: NDArray[np.complexfloating]
    weights: Real
    order: int
    window: LagWindow | None
    weighted: bool
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def s(self) -> Complex:
        """``[line]`` j omega in rad/s."""
        return np.asarray(2j * pi * self.frequency_hz, dtype=np.complex128)


def model_lines(response: FrequencyResponse, band_hz: tuple[float, float] | None) -> ModelLines:
    """Choose the lines of a band that can be fitted.

    Raises
    ------
    EstimateError
        When the band is no band, or holds no excited line with a value.
    """
    low, high = band_hz or (0.0, np.inf)
    if not low < high:
        raise EstimateError(f"band {low:g} to {high:g} Hz is empty; give the lower end first")
    inside = (response.frequency_hz >= low) & (response.frequency_hz <= high) & (response.frequency_hz > 0)
    usable = np.isfinite(response.values)
    lines = np.flatnonzero(inside & response.excited & usable.any(axis=(0, 1)))
    if not lines.size:
        raise EstimateError(
            f"no excited line with a value between {low:g} and {high:g} Hz; the lines reach from "
            f"{response.frequency_hz[0]:g} to {response.frequency_hz[-1]:g} Hz"
        )
    usable = usable[..., lines]
    values = np.where(usable, response.values[..., lines], 0)
    weights, weighted = _weights(values, response.std[..., lines], usable)
    return ModelLines(
        frequency_hz=response.frequency_hz[lines],
        values=values,
        weights=weights,
        order=ORDER[form(response)],
        # H2 and Hv see the window in another way, which is not modelled.
        window=lag_window(response.provenance) if response.provenance.estimator == "H1" else None,
        weighted=weighted,
        notes=() if weighted else (UNKNOWN_STD,),
    )


def reweighted(lines: ModelLines, residual: Complex, *, parameters: int) -> ModelLines:
    """Weigh each line by what a fit with `parameters` real coefficients a response leaves of its function.

    The variance is taken for a level and a share of the function's square: noise of a sensor is the same on all
    lines, while that of a force or of a calibration follows the function over its peaks.
    """
    used = lines.weights > 0
    count = used.sum(axis=-1, keepdims=True)
    freedom = np.maximum(2 * count - parameters / lines.values.shape[1], 1.0)
    squares = np.where(used, np.abs(residual) ** 2, 0.0) * count / freedom
    # A function that is fitted to the last digit must not drive all others out.
    floor = (EXACT * np.abs(lines.values).max(axis=-1, keepdims=True)) ** 2
    floor = np.where(floor > 0, floor, floor.max())
    variance = _level_and_share(np.maximum(squares, floor), np.abs(lines.values - residual) ** 2, used)
    return replace(lines, weights=np.where(used, 1 / np.maximum(variance, floor), 0.0))


def _level_and_share(squares: Real, power: Real, used: Mask) -> Real:
    """``[response, reference, line]`` variances level + share x power of greatest likelihood for exponential squares.

    Multiplicative steps keep both positive and raise the likelihood each time (Fevotte & Idier 2011, Neural
    Computation 23, 2421, for the Itakura-Saito divergence).
    """
    ones = used.astype(np.float64)
    level, share = _ratio(squares * ones, ones), _ratio(squares * ones, power * ones)
    for _ in range(ROUNDS):
        trust = ones / np.where(used, level + share * power, 1.0)
        gain = trust**2 * squares
        level = level * np.sqrt(_ratio(gain, trust))
        gain, trust = gain * power, trust * power
        share = share * np.sqrt(_ratio(gain, trust))
    return np.asarray(level + share * power, dtype=np.float64)


def _ratio(above: Real, below: Real) -> Real:
    """Sums over the last axis, 0 of a function without lines or without power."""
    total = below.sum(axis=-1, keepdims=True)
    ratio = np.divide(above.sum(axis=-1, keepdims=True), total, out=np.zeros_like(total), where=total > 0)
    return np.asarray(ratio, dtype=np.float64)


def _weights(values: Complex, std: Real, usable: Mask) -> tuple[Real, bool]:
    # A standard deviation of nothing but rounding, on some lines, must not make them outweigh all others.
    floor = ROUNDING * np.abs(values).max(axis=-1, keepdims=True)
    known = usable & np.isfinite(std) & (std > floor)
    if not known.any():
        power = np.sum(np.abs(values) ** 2, axis=-1) / np.maximum(usable.sum(axis=-1), 1)
        # A function that is zero throughout says as much as the others do.
        power = np.where(power > 0, power, power.max() or 1.0)
        return np.where(usable, 1 / power[..., np.newaxis], 0.0), False
    bounded = usable & np.isfinite(std)
    least = np.maximum(std, np.where(floor > 0, floor, std[known].min()))
    return np.divide(1.0, least**2, out=np.zeros(std.shape), where=bounded), True

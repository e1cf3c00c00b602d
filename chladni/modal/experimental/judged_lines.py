"""The lines that modes are judged on: receptances with a steady weight."""

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.ndimage import uniform_filter1d

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import Value
from chladni.spectral.forms import ORDER, Form
from chladni.spectral.line_scatter import std_or_scatter

# Lines over which a sigma from few averages is steadied: with three averages each, nine lines know it to a fifth.
STEADY_LINES = 9
# Part of the steadied variance below which no line's own variance is believed.
BELIEVED = 0.5
# Share of the magnitude that the best linear model of a real structure may be off: what only improves on that is no
# reason for a further mode.
TOLERATED = 0.1
FEWEST_LINES = 8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedLines(Value):
    """Excited, finite lines inside the band, as receptance.

    Attributes
    ----------
    frequency_hz
        ``[line]``.
    values
        ``[response, reference, line]`` receptance, 0 where masked.
    weight
        ``[response, reference, line]`` one over one sigma of the real and of the imaginary part, 0 where masked: of
        the noise, and of what a linear model may be off.
    step_hz
        Distance of the lines.
    correlated_lines
        Lines that carry the information of one, because a window ties them together; 1 without.
    """

    frequency_hz: Real
    values: Complex
    weight: Real
    step_hz: float
    correlated_lines: float = 1.0

    def __post_init__(self) -> None:
        self._freeze()


def usable_lines(response: FrequencyResponse, *, band_hz: tuple[float, float] | None) -> Mask:
    """``[line]`` excited, above 0 Hz, inside the band, with at least one function that has a value.

    Raises
    ------
    EstimateError
        When nothing is left, or too little to find a mode in.
    """
    frequency_hz = response.frequency_hz
    finite = np.isfinite(response.values).all(axis=1).any(axis=0)
    if not finite.any():
        raise EstimateError("no line of any frequency response is finite: nothing to find modes in")
    usable = np.asarray(response.excited & finite & (frequency_hz > 0))
    if not usable.any():
        raise EstimateError("no line is excited by the references: nothing to find modes in")
    if band_hz is None:
        where = "all lines"
    else:
        where = f"{band_hz[0]:g} to {band_hz[1]:g} Hz"
        excited_hz = frequency_hz[usable]
        usable &= (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
        if not usable.any():
            raise EstimateError(
                f"band {where} holds no excited line; those are from {excited_hz[0]:g} to {excited_hz[-1]:g} Hz"
            )
    count = int(np.count_nonzero(usable))
    if count < FEWEST_LINES:
        raise EstimateError(
            f"{where}: {count} usable {'line is' if count == 1 else 'lines are'} too few for modes, at least "
            f"{FEWEST_LINES} are needed; widen the band or measure longer for a finer resolution"
        )
    return usable


def judged_lines(
    response: FrequencyResponse,
    form: Form,
    *,
    band_hz: tuple[float, float] | None,
    correlated_lines: float = 1.0,
) -> JudgedLines:
    """Take the lines that modes are judged on.

    Parameters
    ----------
    response
        Any form.
    form
        What it is.
    band_hz
        Lowest and highest line; None for all.
    correlated_lines
        See `JudgedLines`.

    Raises
    ------
    EstimateError
        See `usable_lines`.
    """
    usable = usable_lines(response, band_hz=band_hz)
    frequency_hz = response.frequency_hz[usable]
    finite = np.isfinite(response.values).all(axis=1)[:, None, usable]
    values = np.where(finite, response.values[..., usable], 0)
    factor = (2j * pi * frequency_hz) ** ORDER[form]
    std = std_or_scatter(values, np.where(finite, response.std[..., usable], np.inf))
    weight = np.where(finite, _weight(values, std), 0.0)
    return JudgedLines(
        frequency_hz=frequency_hz,
        values=values / factor,
        weight=weight * np.abs(factor),
        step_hz=float(np.min(np.diff(response.frequency_hz))),
        correlated_lines=correlated_lines,
    )


def _weight(values: Complex, std: Real) -> Real:
    known = np.isfinite(std)
    variance = np.where(known, std, 0.0) ** 2
    share = uniform_filter1d(known.astype(float), STEADY_LINES, axis=-1, mode="nearest")
    steady = uniform_filter1d(variance, STEADY_LINES, axis=-1, mode="nearest") / np.maximum(share, 1e-9)
    believed = np.where(known, np.maximum(variance, BELIEVED * steady), np.inf)
    # Exact responses have no sigma at all; rounding is what they scatter by.
    square = np.abs(values) ** 2
    believed = believed + (TOLERATED * np.abs(values)) ** 2 / 2 + 1e-24 * square.mean(axis=-1, keepdims=True)
    return np.where(believed > 0, 1 / np.sqrt(np.where(believed > 0, believed, 1.0)), 0.0)

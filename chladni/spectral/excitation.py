"""Which spectral lines a reference excites."""

from collections.abc import Sequence

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.spectral.psd import auto_densities

# Power below this share of the strongest lines is below what a 16-bit chain can tell from its own errors.
DYNAMIC_RANGE = 1e-6
# A hammer's spectrum falls off without a step; 30 dB down, filters and noise of the response make peaks of their own.
HAMMER_RANGE = 1e-3
# A step this high (10 dB) in the sorted powers parts a comb or a band from the floor; averaged noise has none.
FLOOR_STEP = 10.0
# The lines above the step are the excitation only if they are at least this share of all, else a hum over noise.
SMALLEST_SHARE = 0.02
FEWEST_LINES = 8


def excited_lines(spectra: CrossSpectra, references: Sequence[str], *, hammer_range: float = HAMMER_RANGE) -> Mask:
    """Tell which lines each reference excites.

    A line counts as excited when its power

    1. is above 1e-6 of the strongest (the 99th percentile of lines, so that one hum doesn't set the scale), for hits
       of a hammer above `hammer_range` of it,
    2. stands out of the scatter between periods, for periodic excitation: M |mean|^2 / scatter above the quantile of
       F(2, 2M - 2) that a tenth of a line in the whole spectrum would exceed by chance (Pintelon & Schoukens 2012,
       section 2.5), and
    3. lies above the highest step of the sorted powers, when there is one of 10 dB or more with a comb or a band of
       lines above it.

    Parameters
    ----------
    spectra
        Averaged cross-spectra that hold the references.
    references
        Names of the excitations.
    hammer_range
        Least power of a hammer's lines over that of its strongest.

    Returns
    -------
    ndarray
        ``[reference, frequency]`` boolean.
    """
    rows = [spectra.index(name) for name in references]
    powers = auto_densities(repeated_density(spectra))[rows]
    share = hammer_range if spectra.provenance.averaging == "impact" else DYNAMIC_RANGE
    mask = powers > share * np.percentile(powers, 99, axis=1, keepdims=True)
    if spectra.noise_density is not None:
        scatter = auto_densities(spectra.noise_density)[rows]
        mask &= _stands_out(powers, scatter, spectra.provenance.averages)
    fewest = (
        FEWEST_LINES if spectra.noise_density is not None else max(FEWEST_LINES, SMALLEST_SHARE * powers.shape[1])
    )
    return np.array([_above_step(power, line, fewest) for power, line in zip(powers, mask, strict=True)])


def repeated_density(spectra: CrossSpectra) -> Complex:
    """Give what repeats: for periodic excitation the products of the mean period, else the averaged density itself.

    The average of M periods holds (M - 1)/M of the scatter between them more than the mean period does.
    """
    if spectra.noise_density is None:
        return np.asarray(spectra.density, dtype=np.complex128)
    periods = spectra.provenance.averages
    return np.asarray(spectra.density - spectra.noise_density * ((periods - 1) / periods), dtype=np.complex128)


def excitation_notes(excited: Mask, references: Sequence[str]) -> tuple[str, ...]:
    """Say in words which references leave how many lines out; the line at 0 Hz alone isn't worth a word."""
    return tuple(
        f"{np.count_nonzero(~mask)} of {mask.size} lines are not excited by {name} and are masked"
        for name, mask in zip(references, excited, strict=True)
        if np.any(~mask[1:])
    )


def _stands_out(power: Real, scatter: Real, periods: int) -> Mask:
    # F(2, d) has the closed survival function (1 + 2 x / d)^(-d/2).
    freedom = 2 * (periods - 1)
    chance = 0.1 / power.shape[-1]
    quantile = freedom / 2 * (chance ** (-2 / freedom) - 1)
    return np.asarray(periods * power > quantile * scatter)


def _above_step(power: Real, mask: Mask, fewest: float) -> Mask:
    ranked = np.sort(power[mask])[::-1]
    first = int(np.ceil(fewest)) - 1
    if ranked.size < first + 2:
        return mask
    steps = ranked[first:-1] / ranked[first + 1 :]
    highest = int(np.argmax(steps))
    return mask & (power >= ranked[first + highest]) if steps[highest] >= FLOOR_STEP else mask

"""Random vibration tests: spectra against a profile with its tolerance."""

from collections.abc import Sequence

import numpy as np

from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.profile import rising
from chladni.signals.random_vibration import ProfileCheck, RandomProfile
from chladni.signals.units import si_factor


def random_profile(
    breakpoints: Sequence[tuple[float, float]],
    *,
    unit: str = "g",
    upper_db: float = 3.0,
    lower_db: float = 3.0,
) -> RandomProfile:
    """Give a profile by its breakpoints, as test standards print it.

    Parameters
    ----------
    breakpoints
        Frequency in Hz and density in ``unit^2/Hz`` of each.
    unit
        Unit that the densities are in; ``g`` is 9.80665 m/s^2.
    upper_db, lower_db
        Tolerance above and below, in dB of power.

    Returns
    -------
    RandomProfile
        In SI.

    Raises
    ------
    EstimateError
        When breakpoints don't rise, or aren't above 0.
    SetupError
        When the unit is none.

    Examples
    --------
    >>> navmat = random_profile([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)])  # NAVMAT P-9492: 6.06 g RMS
    >>> round(navmat.rms() / 9.80665, 2)
    6.06
    """
    factor, si_unit = si_factor(unit)
    frequency_hz, density = rising(breakpoints)
    return RandomProfile(
        frequency_hz=frequency_hz,
        density=density * factor**2,
        unit=si_unit,
        upper_db=upper_db,
        lower_db=lower_db,
    )


def check_profile(density: PowerSpectralDensity, profile: RandomProfile) -> ProfileCheck:
    """Hold spectra against a profile, line by line.

    Parameters
    ----------
    density
        Of channels in the profile's unit, such as `PowerSpectralDensity.from_arrays` makes of an array; lines outside
        the profile are left out.
    profile
        From `random_profile`.

    Returns
    -------
    ProfileCheck
        Deviations in dB, the share of lines outside the tolerance, and both RMS.

    Raises
    ------
    EstimateError
        When a unit differs, or fewer than two lines lie inside the profile.
    """
    odd = [channel for channel in density.channels if channel.unit != profile.unit]
    if odd:
        raise EstimateError(
            f"{odd[0].name} is in {odd[0].unit}, the profile in {profile.unit}; select channels in one unit, or give "
            "the channel's"
        )
    inside = np.isfinite(profile.at(density.frequency_hz))
    if np.count_nonzero(inside) < 2:
        raise EstimateError(
            f"fewer than two lines lie between {profile.frequency_hz[0]:g} and {profile.frequency_hz[-1]:g} Hz; ask "
            "for a finer resolution"
        )
    axis, values = density.frequency_hz[inside], density.values[:, inside]
    ratio = values / profile.at(axis)
    deviation_db = 10 * np.log10(np.maximum(ratio, np.finfo(float).tiny))
    outside = (deviation_db > profile.upper_db) | (deviation_db < -profile.lower_db)
    relative = density.std[:, inside] / np.maximum(values, np.finfo(float).tiny)
    return ProfileCheck(
        frequency_hz=axis,
        deviation_db=deviation_db,
        outside=outside.mean(axis=1),
        rms=np.sqrt(np.trapezoid(values, axis, axis=1)),
        profile_rms=profile.rms(),
        std_db=10 / np.log(10) * np.median(relative, axis=1),
        channels=density.channels,
        profile=profile,
    )

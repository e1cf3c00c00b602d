"""Spectra of a log against the profile of a random vibration test."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chladni.apps.psd import densities
from chladni.apps.sources import Progress, Span, no_progress
from chladni.apps.spectra import Averaging
from chladni.io.log import Log
from chladni.io.log_info import some_of
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.random_vibration import ProfileCheck, RandomProfile
from chladni.spectral.random_vibration import check_profile


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tolerated:
    """Spectra of one sampling grid, and how they keep the profile."""

    density: PowerSpectralDensity
    check: ProfileCheck
    notes: tuple[str, ...] = ()


def tolerated(
    log: Log,
    profile: RandomProfile,
    *,
    channels: Sequence[str] | None,
    averaging: Averaging,
    span: Span,
    progress: Progress = no_progress,
) -> tuple[Tolerated, ...]:
    """Hold named channels, or all in the profile's unit, against a profile, one value for each sampling grid.

    Raises
    ------
    LogError
        When there is no such channel.
    EstimateError
        When no channel is in the profile's unit, or as `densities` and `check_profile` do.
    """
    found = densities(log, channels=channels, averaging=averaging, span=span, progress=progress)
    if channels is None:
        units = sorted({channel.unit for one in found for channel in one.channels})
        kept = [[c.name for c in one.channels if c.unit == profile.unit] for one in found]
        found = tuple(one.select(names) for one, names in zip(found, kept, strict=True) if names)
        if not found:
            raise EstimateError(
                f"{log.path.name}: no channel is in {profile.unit}, as the profile is; units are {some_of(units)}. "
                "Give the channel's unit in a setup file (--setup), or the profile's (--unit)"
            )
    try:
        return tuple(
            Tolerated(density=one, check=check_profile(one, profile), notes=tuple(_unjudged(one, profile)))
            for one in found
        )
    except EstimateError as error:
        raise EstimateError(f"{log.path.name}: {error}") from error


def _unjudged(density: PowerSpectralDensity, profile: RandomProfile) -> Iterator[str]:
    """Tell what of the profile lies above the spectrum."""
    highest_hz, end_hz = float(density.frequency_hz[-1]), float(profile.frequency_hz[-1])
    if end_hz > highest_hz:
        yield (
            f"{some_of([channel.name for channel in density.channels])}: the profile ends at {end_hz:g} Hz, the "
            f"spectrum at {highest_hz:g} Hz; what lies between is not judged: sample faster"
        )

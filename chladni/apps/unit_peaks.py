"""Named peaks of densities, ranked among channels of one unit: heights in different units have no order."""

from dataclasses import dataclass

from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.spectral.peaks import find_peaks, judged_above_hz


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitPeaks:
    """Peaks of the channels that share a unit, the highest first.

    Attributes
    ----------
    unit
        Unit of the channels (not of their densities).
    channels
        Their names.
    peaks
        What `find_peaks` names in them.
    above_hz
        Where they were looked for; 0 for everywhere.
    """

    unit: str
    channels: tuple[str, ...]
    peaks: tuple[Peak, ...]
    above_hz: float


def unit_peaks(density: PowerSpectralDensity) -> tuple[UnitPeaks, ...]:
    """Name the peaks of a density, unit by unit in the order of its channels."""
    groups: dict[str, list[str]] = {}
    for channel in density.channels:
        groups.setdefault(channel.unit, []).append(channel.name)
    return tuple(
        UnitPeaks(
            unit=unit,
            channels=tuple(names),
            peaks=find_peaks(density.select(names)),
            above_hz=judged_above_hz(density),
        )
        for unit, names in groups.items()
    )

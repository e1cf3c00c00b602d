"""Averaged spectra, from which every estimate is derived: of all pairs of channels, or of each channel alone."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, Names, find_channel, find_channels
from chladni.signals.provenance import Provenance
from chladni.signals.units import power_density_unit, product, quotient
from chladni.signals.value import Coordinate, Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossSpectra(Value):
    """One-sided cross-spectral densities of all channel pairs.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    density
        ``[channel, channel, frequency]`` complex, Hermitian in the first two axes: G_ij = conj(X_i) X_j in
        unit_i unit_j / Hz, one-sided (Bendat & Piersol 2010, eq. 5.66), corrected for the window's power.
    channels
        One for each row and column.
    bandwidth_hz
        Effective noise bandwidth of a line; ``density * bandwidth_hz`` is the power (RMS^2) of a sine on that line.
    noise_density
        Like `density`: covariance of one period about the mean period, for periodic excitation only (None
        otherwise). The mean of M periods carries 1/M of it.
    provenance
        How it was made.
    """

    AXES: ClassVar = {"density": ("channels", "channels_b", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"

    frequency_hz: Real
    density: NDArray[np.complexfloating]
    channels: tuple[Channel, ...]
    bandwidth_hz: float
    noise_density: NDArray[np.complexfloating] | None = None
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        count = len(self.channels)
        expected = (count, count, self.frequency_hz.size)
        require_shape("density", self.density, expected, "channels x channels x frequencies")
        if self.noise_density is not None:
            require_shape("noise_density", self.noise_density, expected, "channels x channels x frequencies")
        self._freeze()

    def select(self, names: Names) -> Self:
        """Give the spectra of the named channels and their pairs, in the order asked for."""
        rows = find_channels(self.channels, names)
        pairs = np.ix_(rows, rows)
        return replace(
            self,
            density=self.density[pairs],
            noise_density=None if self.noise_density is None else self.noise_density[pairs],
            channels=tuple(self.channels[row] for row in rows),
        )

    def coordinate(self, axis: str) -> Coordinate:
        """Give the frequencies, or the names of the channels, which run along two axes."""
        return Value.coordinate(self, axis.removesuffix("_b"))

    def unit_at(self, field: str, place: tuple[int, ...]) -> str:  # noqa: ARG002
        """Give the unit of a pair of channels."""
        one, other = (self.channels[row].unit for row in place)
        return quotient(product(one, other), "Hz")

    def index(self, name: str) -> int:
        """Row of the named channel; `EstimateError` naming those there are when it's missing."""
        return find_channel(self.channels, name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AutoSpectra(Value):
    """One-sided auto-spectral densities alone: the diagonal of `CrossSpectra`, as many as there are channels.

    Attributes
    ----------
    density, noise_density
        ``[channel, frequency]``, real; else as in `CrossSpectra`.
    frequency_hz, channels, bandwidth_hz, provenance
        See `CrossSpectra`.
    """

    AXES: ClassVar = {"density": ("channels", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = {"density": power_density_unit}

    frequency_hz: Real
    density: Real
    channels: tuple[Channel, ...]
    bandwidth_hz: float
    noise_density: Real | None = None
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        require_shape("density", self.density, expected, "channels x frequencies")
        if self.noise_density is not None:
            require_shape("noise_density", self.noise_density, expected, "channels x frequencies")
        self._freeze()

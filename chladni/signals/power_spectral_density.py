"""Power spectral densities of channels, each with its random error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, find_channels
from chladni.signals.provenance import Provenance
from chladni.signals.units import power_density_unit
from chladni.signals.value import Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PowerSpectralDensity(Value):
    """One-sided auto-spectral densities.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[channel, frequency]``, at least 0, in unit^2/Hz of each channel.
    std
        ``[channel, frequency]``, one sigma of `values` (Bendat & Piersol 2010, eq. 8.156: value / sqrt(effective
        averages); for periodic excitation from the scatter between periods).
    channels
        One for each row.
    bandwidth_hz
        Effective noise bandwidth of a line: ``values * bandwidth_hz`` is the RMS^2 of a sine on that line.
    provenance
        How it was made.
    """

    frequency_hz: Real
    values: Real
    std: Real
    channels: tuple[Channel, ...]
    bandwidth_hz: float
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        require_shape("values", self.values, expected, "channels x frequencies")
        require_shape("std", self.std, expected, "channels x frequencies")
        self._freeze()

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each row, such as ``(m/s^2)^2/Hz``."""
        return tuple(power_density_unit(channel.unit) for channel in self.channels)

    def select(self, names: Sequence[str]) -> Self:
        """Give the densities of the named channels; `EstimateError` naming those there are when one is missing."""
        return self.rows(find_channels(self.channels, names))

    def rows(self, rows: Sequence[int]) -> Self:
        """Give the densities of some rows, in the order asked for."""
        return replace(
            self,
            values=self.values[list(rows)],
            std=self.std[list(rows)],
            channels=tuple(self.channels[row] for row in rows),
        )

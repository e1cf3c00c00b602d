"""Power spectral densities of channels, each with its random error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from chladni.signals.arrays import Real
from chladni.signals.channel import UNKNOWN, Channel, Names, Units, find_channels, made_channels, numbered
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.signals.units import power_density_unit
from chladni.signals.value import Value, over_frequency, require_frequency_axis, require_shape


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

    AXES: ClassVar = {"values": ("channels", "frequency_hz"), "std": ("channels", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = dict.fromkeys(AXES, power_density_unit)

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

    @classmethod
    def from_arrays(
        cls,
        frequency_hz: ArrayLike,
        values: ArrayLike,
        *,
        names: Names | None = None,
        units: Units = UNKNOWN,
        averages: float | None = None,
        bandwidth_hz: float | None = None,
    ) -> Self:
        """Make power spectral densities of numbers in memory, as other programs give them.

        Parameters
        ----------
        frequency_hz
            ``[frequency]``, strictly rising.
        values
            ``[channel, frequency]`` one-sided, or ``[frequency]`` of one channel.
        names
            Of the channels; ``ch1``, ``ch2``, ... by default.
        units
            Of the channels' samples, such as ``g`` of g^2/Hz: one of all, one of each, or by name. Values are
            converted to SI. ``1``, the default, isn't known.
        averages
            Independent segments that were averaged; the random error follows from it, and is unknown (infinite)
            without.
        bandwidth_hz
            Effective noise bandwidth of a line; by default the distance of the lines, as without a window.

        Raises
        ------
        EstimateError
            When shapes, names and units don't fit together.
        SetupError
            When a unit isn't known.

        Examples
        --------
        >>> density = PowerSpectralDensity.from_arrays([0.0, 0.5, 1.0], [1.0, 2.0, 1.0], units="g", averages=100)
        >>> density.units, float(density.std[0, 1] / density.values[0, 1])
        (('(m/s^2)^2/Hz',), 0.1)
        """
        axis, table = over_frequency(frequency_hz, values, np.float64)
        require_frequency_axis(axis)
        if table.ndim != 2 or (table < 0).any():
            raise EstimateError("values of a density are [channel, frequency] and at least 0")
        channels, factors = made_channels(numbered("ch", table.shape[0], names), units)
        table = table * np.square(factors)[:, np.newaxis]
        step_hz = float(np.min(np.diff(axis), initial=np.inf))
        return cls(
            frequency_hz=axis,
            values=table,
            std=np.full(table.shape, np.inf) if averages is None else table / np.sqrt(averages),
            channels=channels,
            bandwidth_hz=step_hz if bandwidth_hz is None else bandwidth_hz,
            provenance=Provenance(estimator="as given", effective_averages=averages or 0.0),
        )

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each row, such as ``(m/s^2)^2/Hz``."""
        return tuple(power_density_unit(channel.unit) for channel in self.channels)

    def select(self, names: Names) -> Self:
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

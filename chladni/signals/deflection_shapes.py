"""Operating deflection shapes: how all points move together at one frequency, as the machine runs."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, of_channel, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeflectionShapes(Value):
    """Amplitudes of all channels with their phases to one of them, at chosen lines.

    Attributes
    ----------
    frequency_hz
        ``[shape]``, the line of each shape.
    values
        ``[shape, channel]``, complex: ``abs`` is the RMS on the line in each channel's unit, ``angle`` the lead over
        the reference.
    std
        ``[shape, channel]``, one sigma of the magnitude.
    coherence
        ``[shape, channel]`` with the reference: what of a channel's motion the shape holds. 1 for the reference.
    channels
        One for each column, the reference among them.
    reference
        Name of the channel whose phase is 0.
    bandwidth_hz
        Of noise the RMS is that within this bandwidth; of a tone it's its own.
    provenance
        How it was made.
    """

    AXES: ClassVar = {
        "values": ("frequency_hz", "channels"),
        "std": ("frequency_hz", "channels"),
        "coherence": ("frequency_hz", "channels"),
    }
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = {"values": of_channel, "std": of_channel}

    frequency_hz: Real
    values: Complex
    std: Real
    coherence: Real
    channels: tuple[Channel, ...]
    reference: str
    bandwidth_hz: float
    provenance: Provenance

    def __post_init__(self) -> None:
        if self.frequency_hz.ndim != 1 or not np.all(np.isfinite(self.frequency_hz)):
            raise EstimateError("frequency_hz must be one-dimensional and finite")
        expected = (self.frequency_hz.size, len(self.channels))
        for name in ("values", "std", "coherence"):
            require_shape(name, getattr(self, name), expected, "shapes x channels")
        self._freeze()

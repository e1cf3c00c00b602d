"""Shock response spectra: how far a shock drives oscillators of every frequency."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, Names, find_channels
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value, of_channel, require_frequency_axis, require_shape

ShockQuantity = Literal["absolute-acceleration", "relative-displacement", "pseudo-velocity"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShockResponse(Value):
    """Largest responses of oscillators to a base motion, over their natural frequency.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, natural frequency of each oscillator, undamped, rising.
    positive, negative
        ``[channel, frequency]``, the largest response in either direction, at least 0, in each channel's unit.
    quantity
        Which response: ``absolute-acceleration``, ``relative-displacement`` or ``pseudo-velocity``.
    q
        Amplification at resonance, 1/(2 damping ratio).
    channels
        One for each row, with the unit of the response.
    offset
        ``[channel]``, what was taken off the samples first, in their unit.
    notes
        What to know of how it was made.
    """

    AXES: ClassVar = {
        "maximax": ("channels", "frequency_hz"),
        "positive": ("channels", "frequency_hz"),
        "negative": ("channels", "frequency_hz"),
    }
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = dict.fromkeys(AXES, of_channel)

    frequency_hz: Real
    positive: Real
    negative: Real
    quantity: ShockQuantity
    q: float
    channels: tuple[Channel, ...]
    offset: Real
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        if not self.frequency_hz.size or not self.frequency_hz[0] > 0:
            raise EstimateError("natural frequencies of a shock response spectrum must lie above 0 Hz")
        expected = (len(self.channels), self.frequency_hz.size)
        require_shape("positive", self.positive, expected, "channels x frequencies")
        require_shape("negative", self.negative, expected, "channels x frequencies")
        require_shape("offset", self.offset, expected[:1], "channels")
        self._freeze()

    def select(self, names: Names) -> Self:
        """Give the responses to the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        return replace(
            self,
            positive=self.positive[rows],
            negative=self.negative[rows],
            offset=self.offset[rows],
            channels=tuple(self.channels[row] for row in rows),
        )

    @property
    def maximax(self) -> Real:
        """``[channel, frequency]``, the largest response in any direction at any time."""
        return np.maximum(self.positive, self.negative)

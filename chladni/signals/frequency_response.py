"""Frequency response functions between channels, each with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel, find_channel, find_channels
from chladni.signals.provenance import Provenance
from chladni.signals.units import quotient
from chladni.signals.value import Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrequencyResponse(Value):
    """Response over reference, H = Y/X, with the convention e^{+j omega t}: a delay tau has the phase -omega tau.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[response, reference, frequency]`` complex, in response unit / reference unit.
    std
        ``[response, reference, frequency]``, one sigma of the magnitude, same unit (infinite where the data give
        no bound).
    coherence
        ``[response, frequency]``, 0 to 1: ordinary with one reference, multiple with several.
    excited
        ``[frequency]`` boolean; False on lines that the references don't excite, where `values` is only noise.
    responses, references
        One channel for each row and column.
    provenance
        How it was made.
    """

    frequency_hz: Real
    values: NDArray[np.complexfloating]
    std: Real
    coherence: Real
    excited: Mask
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        lines = self.frequency_hz.size
        expected = (len(self.responses), len(self.references), lines)
        require_shape("values", self.values, expected, "responses x references x frequencies")
        require_shape("std", self.std, expected, "responses x references x frequencies")
        require_shape("coherence", self.coherence, (len(self.responses), lines), "responses x frequencies")
        require_shape("excited", self.excited, (lines,), "frequencies")
        self._freeze()

    def unit(self, response: int, reference: int) -> str:
        """Unit of one function, such as ``(m/s^2)/N``."""
        return quotient(self.responses[response].unit, self.references[reference].unit)

    def select(self, responses: Sequence[str]) -> Self:
        """Give the functions of the named responses, in the order asked for."""
        rows = find_channels(self.responses, responses, role="response")
        return replace(
            self,
            values=self.values[rows],
            std=self.std[rows],
            coherence=self.coherence[rows],
            responses=tuple(self.responses[row] for row in rows),
        )

    def function(self, response: str, reference: str) -> tuple[int, int]:
        """Indices of the function between two named channels; `EstimateError` when it isn't there."""
        return (
            find_channel(self.responses, response, role="response"),
            find_channel(self.references, reference, role="reference"),
        )

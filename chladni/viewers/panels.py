"""Which frequency responses are drawn together: one reference, one unit, a few responses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.unit_text import printed_unit
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import response_quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """The functions of one group of responses to one reference, which share their plots.

    Attributes
    ----------
    response
        All functions.
    group
        The responses drawn here.
    reference
        Column of the reference.
    """

    response: FrequencyResponse
    group: Group
    reference: int

    @property
    def unit(self) -> str:
        """Unit as printed."""
        return printed_unit(self.response.unit(self.group.rows[0], self.reference))

    @property
    def quantity(self) -> str:
        """The field's word for this kind of function."""
        return response_quantity(self.group.unit, self.response.references[self.reference].unit)

    def frequency_hz(self) -> Real:
        """Give the excited frequencies; the others hold only noise and are left out."""
        return self.response.frequency_hz[self.response.excited]

    def function(self, row: int) -> NDArray[np.complexfloating]:
        """Give one function on the excited frequencies."""
        return np.asarray(self.response.values[row, self.reference, self.response.excited])

    def deviation(self, row: int) -> Real:
        """Give one sigma of the magnitude on the excited frequencies."""
        return np.asarray(self.response.std[row, self.reference, self.response.excited])

    def coherence(self, row: int) -> Real:
        """Give the coherence on the excited frequencies."""
        return np.asarray(self.response.coherence[row, self.response.excited])


def panels(response: FrequencyResponse) -> list[Panel]:
    """Divide the functions into panels, reference by reference; none when no line is excited."""
    # A plot of no lines would have an axis from nowhere to nowhere.
    if not response.excited.any():
        return []
    return [
        Panel(response=response, group=group, reference=reference)
        for reference in range(len(response.references))
        for group in groups(response.responses)
    ]

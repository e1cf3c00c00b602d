"""States that a machine went through, as far as a linear model and the force that it lacks tell them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.plant.free_run import Windows
from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KnownStates(Value):
    """States of a whole record.

    Attributes
    ----------
    names
        Of the states.
    values
        ``[state, sample]``, but for their means, which no accelerometer tells.
    """

    names: tuple[str, ...]
    values: Real

    def __post_init__(self) -> None:
        self._freeze()

    def at_starts(self, windows: Windows, names: Sequence[str]) -> Real:
        """``[window, state]`` of the named states at the windows' first samples; those that aren't known are zero."""
        found = np.zeros((len(windows), len(names)))
        first = [start for start, _ in windows]
        for place, name in enumerate(names):
            if name in self.names:
                found[:, place] = self.values[self.names.index(name), first]
        return found

"""A step."""

from dataclasses import dataclass

import numpy as np

from chladni.models.excitations.excitation import require_number
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """Nothing, then `size` from `at_s` on.

    A simulation joins samples by straight lines: a step between two samples is a ramp of one sample's length. At
    ``at_s = 0`` the input has its size from the first instant, and the step is exact.
    """

    size: float = 1.0
    at_s: float = 0.0

    def __post_init__(self) -> None:
        require_number(self, "size", self.size)
        require_number(self, "at_s", self.at_s)

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:  # noqa: ARG002  # nothing here is random
        """Give ``[sample]``."""
        # A time within a thousandth of a sample of the grid means that sample, whatever floating point says.
        first = np.ceil(self.at_s * sample_rate_hz - 1e-3)
        return np.where(np.arange(count) >= first, self.size, 0.0)

"""A sine whose frequency moves through a band."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.models.excitations.excitation import require_number
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class SweptSine:
    """A sine of constant amplitude from one frequency to another over the whole record.

    Attributes
    ----------
    amplitude
        In the input's unit.
    start_hz, end_hz
        Frequencies at the first and the last sample; either may be the higher.
    law
        ``linear``: hertz a second are constant; ``logarithmic``: octaves a second are.
    """

    amplitude: float = 1.0
    start_hz: float
    end_hz: float
    law: Literal["linear", "logarithmic"] = "linear"

    def __post_init__(self) -> None:
        require_number(self, "amplitude", self.amplitude)
        for name in ("start_hz", "end_hz"):
            require_number(self, name, getattr(self, name), positive=True)
        if self.law not in ("linear", "logarithmic"):
            raise ModelError(f"SweptSine: law = {self.law!r} is none of linear, logarithmic")

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:  # noqa: ARG002  # nothing here is random
        """Give ``[sample]``, beginning at zero and rising."""
        # Slow to import, and most programs that know of excitations never sweep.
        from scipy.signal import chirp

        if 2 * max(self.start_hz, self.end_hz) >= sample_rate_hz:
            highest = max(self.start_hz, self.end_hz)
            raise ModelError(f"SweptSine: {highest:g} Hz needs a sample rate above {2 * highest:g} Hz")
        time_s = np.arange(count) / sample_rate_hz
        end_s = max(count - 1, 1) / sample_rate_hz
        # Minus a quarter turn: scipy sweeps a cosine, and a simulation from rest should not begin with a step.
        sweep = chirp(time_s, self.start_hz, end_s, self.end_hz, method=self.law, phi=-90)
        return np.asarray(self.amplitude * sweep, dtype=np.float64)

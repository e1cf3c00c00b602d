"""Hammer blows."""

from dataclasses import dataclass

import numpy as np

from chladni.models.excitations.excitation import require_number
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class Impact:
    """Half-sine pulses, as a hammer with a soft tip gives.

    Attributes
    ----------
    peak
        In the input's unit.
    width_s
        Length of the half sine; its spectrum falls to half near 0.8/`width_s` Hz.
    at_s
        Start of the first pulse.
    every_s
        Time from one pulse to the next; None for one pulse only.
    """

    peak: float = 1.0
    width_s: float
    at_s: float = 0.0
    every_s: float | None = None

    def __post_init__(self) -> None:
        require_number(self, "peak", self.peak)
        require_number(self, "at_s", self.at_s)
        require_number(self, "width_s", self.width_s, positive=True)
        if self.every_s is not None:
            require_number(self, "every_s", self.every_s, positive=True)
            if self.every_s <= self.width_s:
                raise ModelError(
                    f"Impact: a pulse every {self.every_s:g} s must leave room for its width of {self.width_s:g} s"
                )

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:  # noqa: ARG002  # nothing here is random
        """Give ``[sample]``."""
        if self.width_s * sample_rate_hz < 2:
            raise ModelError(
                f"Impact: a pulse of {self.width_s:g} s has fewer than two samples at {sample_rate_hz:g} Hz; "
                f"give a width of at least {2 / sample_rate_hz:g} s or a higher rate"
            )
        since = np.arange(count) / sample_rate_hz - self.at_s
        if self.every_s is not None:
            since = np.where(since >= 0, since % self.every_s, since)
        inside = (since >= 0) & (since <= self.width_s)
        return np.where(inside, self.peak * np.sin(np.pi * since / self.width_s), 0.0)

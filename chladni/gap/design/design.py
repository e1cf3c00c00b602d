"""What a further measurement would bring, in numbers."""

from dataclasses import dataclass

from chladni.gap.calibration import BEYOND_DOUBT
from chladni.gap.design.experiment import Change


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """One further measurement.

    Attributes
    ----------
    change, words
        What is done differently.
    effort
        Rank among changes, the least first.
    nats, now_nats
        Log evidence between the best candidate and the nearest of the others that is expected of a log like the one
        at hand and this measurement together, and of such a log alone.
    duration_s
        Length of the record, or of each that is averaged.
    """

    change: Change
    words: str
    effort: float
    nats: float
    now_nats: float
    duration_s: float

    @property
    def tells(self) -> bool:
        """Whether it tells candidates apart that the log leaves close."""
        return self.nats > 2.0 * self.now_nats + BEYOND_DOUBT

    @property
    def sigmas(self) -> float:
        """As many standard deviations of a normal error have the same log evidence, ``sqrt(2 nats)``."""
        return float((2.0 * self.nats) ** 0.5)

    @property
    def now_sigmas(self) -> float:
        """The same of a log like the one at hand."""
        return float((2.0 * self.now_nats) ** 0.5)

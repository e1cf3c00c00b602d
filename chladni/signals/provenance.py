"""How an estimate was made."""

from dataclasses import dataclass, replace
from typing import Literal, Self

Averaging = Literal["linear", "exponential", "peak-hold", "periodic", "impact"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What a reader must know to repeat or to judge an estimate.

    Attributes
    ----------
    estimator
        ``PSD``, ``H1``, ``H2``, ``Hv``, ``ordinary coherence``, ...
    window
        Name and parameters of the window, as given to SciPy.
    segment_s
        Length of one segment (or period, or impact record) in seconds.
    overlap
        Share of a segment that the next one repeats, 0 <= overlap < 1.
    averages
        Segments that went in.
    effective_averages
        Independent segments that would scatter as much (Bendat & Piersol 2010, section 11.5.2.2; Welch 1967).
    averaging
        How segments were combined.
    detrend
        ``none``, ``constant`` or ``linear``, for each segment.
    window_decay_per_s
        Decay rate sigma that an exponential window exp(-sigma t) adds to every pole; a damping ratio read from
        the estimate is too high by sigma/omega_r until it's subtracted.
    skipped
        Segments left out because samples in them were missing or rejected.
    longest_s
        Longest stretch of the record without a gap, in seconds: no segment can be longer. 0 where that isn't known.
    notes
        Sentences of advice: what was masked, what to distrust, what to do about it.
    """

    estimator: str = ""
    window: str = "boxcar"
    segment_s: float = 0.0
    overlap: float = 0.0
    averages: int = 0
    effective_averages: float = 0.0
    averaging: Averaging = "linear"
    detrend: str = "constant"
    window_decay_per_s: float = 0.0
    skipped: int = 0
    longest_s: float = 0.0
    notes: tuple[str, ...] = ()

    def with_estimator(self, estimator: str) -> Self:
        """Give the same account for another estimator made from the same averages."""
        return replace(self, estimator=estimator)

    def with_notes(self, *notes: str) -> Self:
        """Add sentences of advice; those already there are not repeated."""
        fresh = tuple(note for note in dict.fromkeys(notes) if note not in self.notes)
        return replace(self, notes=self.notes + fresh)

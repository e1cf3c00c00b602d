"""What of a log a diagnosis rests on."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class LogUse:
    """How much of a log was used, and what was lost of it.

    Attributes
    ----------
    log
        Name, for people.
    used_s, recorded_s
        Length of what the diagnosis saw, and of what the log holds in the part that was asked for, seconds.
    sample_rate_hz
        Samples a second.
    losses
        Sentences on damage and stretches that were dropped; they stand among the remarks, too.
    warnings
        Sentences that come before any answer, which means little with them; likewise.
    """

    log: str
    used_s: float
    recorded_s: float
    sample_rate_hz: float
    losses: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

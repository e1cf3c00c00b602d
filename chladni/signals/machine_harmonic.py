"""A line of a rotating machine in a response, told from a mode."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineHarmonic:
    """A sine among the responses that is no mode.

    Attributes
    ----------
    frequency_hz
        Frequency of the line.
    reason
        What gave it away, in words with numbers: the kurtosis of the response in a narrow band around it, a damping
        ratio near zero, ...
    """

    frequency_hz: float
    reason: str

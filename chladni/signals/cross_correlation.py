"""How alike two records are when one is shifted, and by how much one is late."""

from dataclasses import dataclass
from typing import ClassVar

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossCorrelation(Value):
    """Correlation coefficients over lag.

    Attributes
    ----------
    lag_s
        ``[lag]``, rising; positive where the response comes after the reference.
    values
        ``[response, lag]``, -1 to 1.
    responses
        One for each row.
    reference
        The channel that they are held against.
    """

    AXES: ClassVar = {"values": ("responses", "lag_s")}
    ROWS: ClassVar = "lag_s"

    lag_s: Real
    values: Real
    responses: tuple[Channel, ...]
    reference: Channel

    def __post_init__(self) -> None:
        expected = (len(self.responses), self.lag_s.size)
        require_shape("values", self.values, expected, "responses x lags")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeDelays(Value):
    """By how much channels come after a reference.

    Attributes
    ----------
    delay_s
        ``[response]``, positive where the response is late.
    std_s
        ``[response]``, one sigma, of random error alone.
    coherence
        ``[response]``, mean over the lines that hang together with the reference by more than chance.
    inverted
        For each response, whether it has the opposite sign.
    responses
        One for each row.
    reference
        The channel that they are held against.
    band_hz
        The frequencies that were used.
    correlation
        Of the band alone, in which the peaks were looked for.
    notes
        What to distrust.
    """

    AXES: ClassVar = {"delay_s": ("responses",), "std_s": ("responses",), "coherence": ("responses",)}
    ROWS: ClassVar = "responses"

    delay_s: Real
    std_s: Real
    coherence: Real
    inverted: tuple[bool, ...]
    responses: tuple[Channel, ...]
    reference: Channel
    band_hz: tuple[float, float]
    correlation: CrossCorrelation
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("delay_s", "std_s", "coherence"):
            require_shape(name, getattr(self, name), (len(self.responses),), "responses")
        self._freeze()

"""A series computed from another one by a filter, and where it can be trusted."""

from dataclasses import dataclass

from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FilteredSeries(Value):
    """What a filter, an integration or a differentiation gives.

    Attributes
    ----------
    series
        The result, with its unit; runs too short for the filter are NaN and marked invalid.
    band_hz
        Lowest and highest frequency that pass.
    edges_s
        Time at the start and at the end of each unbroken run in which the result leans on what is outside it.
    notes
        The same in sentences.
    """

    series: TimeSeries
    band_hz: tuple[float, float]
    edges_s: tuple[float, float]
    notes: tuple[str, ...] = ()

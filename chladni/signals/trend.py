"""What one quantity did from log to log: its values, what a covariate explains of them, and where it changed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from chladni.signals.arrays import Real, Whole
from chladni.signals.value import Value, require_shape

TrendKind = Literal["mode", "damping", "level", "line", "cause"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ChangePoint:
    """A step in a trend.

    Attributes
    ----------
    place
        Number of the first log after it.
    first, last
        Numbers of logs between which it lies with 95 % probability: the first log after it is one of these.
    step, step_std
        By how much the level changed, covariates taken off, and one sigma of it.
    """

    place: int
    first: int
    last: int
    step: float
    step_std: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CovariateEffect:
    """What one unit of a covariate does to a quantity.

    Attributes
    ----------
    channel
        The covariate, its mean in each log.
    unit
        Of the slope.
    slope, slope_std
        And one sigma of it.
    mean
        Of the covariate over the logs.
    """

    channel: str
    unit: str
    slope: float
    slope_std: float
    mean: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trend(Value):
    """One quantity over the logs that have it, in the order of time.

    Attributes
    ----------
    kind
        ``mode`` (natural frequency), ``damping`` (ratio), ``level`` (RMS in a band), ``line`` (frequency of a peak),
        ``cause`` (probability of a cause of a gap).
    name
        Which one: ``mode 2``, or the channel.
    unit
        Of the values.
    logs
        Name of each log.
    times_ns
        ``[log]``, start of each log, nanoseconds since the Unix epoch; 0 where no log says it, and then logs are in
        the order of their names.
    values, std
        ``[log]``; the std is infinite where none is known.
    expected
        ``[log]``, levels between changes and what covariates explain; the values scatter about it.
    explained
        ``[log]``, what covariates explain of it, zero in the mean.
    scatter
        One sigma of that scatter.
    changes
        In the order of time.
    covariates
        What was taken into account.
    channel
        Of levels and lines; empty for modes and causes.
    near_hz
        Median frequency of modes, their damping, and lines; middle of a level's band.
    """

    kind: TrendKind
    name: str
    unit: str
    logs: tuple[str, ...]
    times_ns: Whole
    values: Real
    std: Real
    expected: Real
    explained: Real
    scatter: float
    changes: tuple[ChangePoint, ...] = ()
    covariates: tuple[CovariateEffect, ...] = ()
    channel: str = ""
    near_hz: float = 0.0
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        for name in ("times_ns", "values", "std", "expected", "explained"):
            require_shape(name, getattr(self, name), (len(self.logs),), "[log]")
        self._freeze()


def no_change_sentence(trends: Sequence[Trend]) -> str:
    """Say that no trend has a step, or that there is none to have one.

    Examples
    --------
    >>> no_change_sentence(())
    'Nothing was followed: a trend needs three logs or more that show the same channel, line or mode.'
    """
    if not trends:
        return "Nothing was followed: a trend needs three logs or more that show the same channel, line or mode."
    return "Nothing changed beyond what scatter and covariates explain."

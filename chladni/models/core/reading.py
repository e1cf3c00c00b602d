"""What an instrument shows: charts, quantities, tables and words, for any page or figure to draw."""

from dataclasses import dataclass
from typing import Literal

from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

Scale = Literal["linear", "log"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Curve(Value):
    """A line, or points when `points` is true; ``x`` and ``y`` are ``[point]``, NaN breaks the line."""

    label: str
    x: Real
    y: Real
    points: bool = False

    def __post_init__(self) -> None:
        if self.x.shape != self.y.shape or self.x.ndim != 1:
            raise ModelError(f"curve {self.label!r}: x has shape {self.x.shape}, y {self.y.shape}; both are [point]")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chart(Value):
    """Curves on common axes.

    Attributes
    ----------
    name
        Short and stable, such as ``step.velocity`` or ``bode.magnitude``.
    equal
        Whether both axes have one scale (Nyquist plot, map of poles).
    """

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_scale: Scale = "linear"
    y_scale: Scale = "linear"
    equal: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """A number that describes behaviour, such as the answer time; `value` is None when there is none (no overshoot).

    `definition` says what exactly is meant, in a few words.
    """

    name: str
    value: float | None
    unit: str
    definition: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InfluenceTable(Value):
    """Influence coefficients: relative change of behaviour over relative change of construction.

    Attributes
    ----------
    behaviour
        Names of columns.
    construction
        Names of rows.
    nominal
        Value of each behaviour parameter at the operating point; NaN where it has none.
    change
        ``[construction]`` relative change R_PCF = (initial - final)/initial that was applied.
    relative_change
        ``[construction, behaviour]`` R_PCD = (initial - final)/initial.
    finite
        ``[construction, behaviour]`` C = R_PCD/R_PCF, the paper's definition (equation 3).
    log_derivative
        ``[construction, behaviour]`` d ln(behaviour)/d ln(construction).
    definitions
        What each behaviour parameter means.
    """

    behaviour: tuple[str, ...]
    construction: tuple[str, ...]
    nominal: Real
    change: Real
    relative_change: Real
    finite: Real
    log_derivative: Real
    definitions: tuple[str, ...]

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InstrumentReading(Value):
    """Everything that one setting of an instrument shows.

    Attributes
    ----------
    charts
        In the order of the page; those that were asked for.
    quantities
        Behaviour in numbers.
    flags
        Sentences: parameters outside their usual range, validity left, unstable.
    offered
        Name and title of every chart that there is at this setting, in the order of the page; those of `charts` when
        none are given.
    """

    charts: tuple[Chart, ...]
    quantities: tuple[Quantity, ...]
    flags: tuple[str, ...]
    offered: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        if not self.offered:
            object.__setattr__(self, "offered", tuple((chart.name, chart.title) for chart in self.charts))

"""The setup file as pydantic models; imported only when one is read, since pydantic takes a quarter of a second."""

from collections.abc import Callable
from typing import Annotated, Literal, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from chladni.signals.channel import unit_direction
from chladni.signals.errors import SetupError
from chladni.signals.unit_labels import read_label, require_label
from chladni.signals.units import parse_quantity, quantity_by, si_factor

T = TypeVar("T")


def _checked(value: T, check: Callable[[T], object]) -> T:
    try:
        check(value)
    except SetupError as error:
        raise ValueError(str(error)) from None
    return value


def _label(text: str) -> str:
    # What the log says of the channel may settle which of several meanings it has.
    return _checked(text, require_label)


def _unit(text: str) -> str:
    return _checked(text, read_label)


def _positive(text: str) -> None:
    if parse_quantity(text)[0] <= 0:
        raise SetupError("must be greater than zero")


def _quantity(text: str) -> str:
    _checked(text, _positive)
    # As labels are read: mV/lb is that of a force or of a mass, and has to say which.
    _checked(text, lambda quantity: quantity_by(quantity, read_label))
    return text


def _direction(value: "str | Vector3") -> "str | Vector3":
    return _checked(value, unit_direction)


def _time_unit(text: str) -> str:
    if _checked(text, si_factor) is not None and si_factor(text)[1] != "s":
        raise ValueError("must be a unit of time, such as us")
    return text


def _rate_unit(text: str) -> str:
    if _checked(text, si_factor) is not None and si_factor(text)[1] != "Hz":
        raise ValueError("must be a unit of frequency, such as kHz")
    return text


def _number_with(value: str | float, si_unit: str) -> str | float:
    """A number, a quantity such as ``"125 us"``, or the path of a field, which begins with no digit."""
    if isinstance(value, float):
        if value <= 0:
            raise ValueError("must be greater than zero")
    elif value[:1].isdigit():
        _checked(value, _positive)
        if parse_quantity(value)[1] != si_unit:
            raise ValueError(f"must be in {si_unit} or a multiple of it")
    return value


def _rate(value: str | float) -> str | float:
    return _number_with(value, "Hz")


def _period(value: str | float) -> str | float:
    return _number_with(value, "s")


# Strict: TOML has types of its own, so "1" is no number; whole numbers count as numbers all the same.
Number = Annotated[float, Field(strict=True)]
Vector3 = tuple[Number, Number, Number]
Name = Annotated[str, Field(min_length=1, max_length=200)]
Path = Annotated[str, Field(min_length=1, max_length=1000)]
Label = Annotated[str, AfterValidator(_label)]
Unit = Annotated[str, AfterValidator(_unit)]
Quantity = Annotated[str, AfterValidator(_quantity)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class PointTable(_Table):
    """``[[point]]``: a measurement point, position in metres."""

    name: Name
    position: Vector3


class ChannelTable(_Table):
    """``[[channel]]``: what is known of one channel."""

    path: Path
    point: Name | None = None
    direction: Annotated[str | Vector3, AfterValidator(_direction)] | None = None
    unit: Label | None = None
    sensitivity: Quantity | None = None
    range: Quantity | None = None
    role: Literal["response", "reference"] | None = None


class LineTable(_Table):
    """``[[line]]``: a stroke of the wireframe."""

    points: Annotated[list[Name], Field(min_length=2)]


class BatchTable(_Table):
    """``[[batch]]``: how the samples lie in the batch messages of a topic."""

    topic: Path
    samples: Annotated[str | list[str], Field(min_length=1)]
    rate: Annotated[str | Number, AfterValidator(_rate)] | None = None
    rate_unit: Annotated[str, AfterValidator(_rate_unit)] = "Hz"
    dt: Annotated[str | Number, AfterValidator(_period)] | None = None
    dt_unit: Annotated[str, AfterValidator(_time_unit)] = "s"
    stamp: Literal["first", "last"] = "first"
    names: Annotated[str | list[Name], Field(min_length=1)] | None = None
    layout: Literal["channel", "sample"] = "channel"
    count: str | None = None
    scale: str | Number = 1.0
    unit: Unit | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.rate is None) == (self.dt is None):
            raise ValueError("needs either rate or dt, the time between samples")
        if isinstance(self.samples, str) and self.names is None:
            raise ValueError("needs names (a field, or a list) when samples is one array")
        self._require_names_for_arrays()
        return self

    def _require_names_for_arrays(self) -> None:
        match self.samples, self.names:
            case list(), str():
                raise ValueError("needs names as a list when each column has its own array")
            case list() as arrays, list() as names if len(arrays) != len(names):
                raise ValueError(f"has {len(names)} names for {len(arrays)} arrays of samples")


class SetupFile(_Table):
    """The whole file."""

    format: Literal["chladni.setup/1"]
    point: list[PointTable] = []
    channel: list[ChannelTable] = []
    line: list[LineTable] = []
    batch: list[BatchTable] = []

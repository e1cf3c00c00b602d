"""The setup file as pydantic models; imported only when one is read, since pydantic takes a quarter of a second."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeVar, cast

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo, model_validator

from chladni.signals.channel import unit_direction
from chladni.signals.errors import SetupError
from chladni.signals.unit_labels import read_label, require_label
from chladni.signals.units import parse_quantity, quantity_by, si_factor

if TYPE_CHECKING:
    from chladni.io.toml_reader import TomlMistakes

T = TypeVar("T")


def _checked(check: Callable[[T], object]) -> AfterValidator:
    """Make a validator of a check; where more is wrong already than is told, nothing is looked at any more."""

    def validated(value: T, info: ValidationInfo) -> T:
        mistakes = cast("TomlMistakes", info.context)
        # A label that nobody knows is compared with all that are, which takes a millisecond.
        if mistakes.may_refuse():
            try:
                check(value)
            except SetupError as error:
                mistakes.refuse()
                raise ValueError(str(error)) from None
        return value

    return AfterValidator(validated)


def _quantity(text: str) -> None:
    if parse_quantity(text)[0] <= 0:
        raise SetupError("must be greater than zero")
    # As labels are read: mV/lb is that of a force or of a mass, and has to say which.
    quantity_by(text, read_label)


def _time_unit(text: str) -> None:
    if si_factor(text)[1] != "s":
        raise SetupError("must be a unit of time, such as us")


def _rate_unit(text: str) -> None:
    if si_factor(text)[1] != "Hz":
        raise SetupError("must be a unit of frequency, such as kHz")


def _number_with(value: str | float, si_unit: str) -> None:
    """Take a number, a quantity such as ``"125 us"``, or the path of a field, which begins with no digit."""
    if isinstance(value, float):
        number, unit = value, si_unit
    elif value[:1].isdigit():
        number, unit = parse_quantity(value)
    else:
        return
    if number <= 0:
        raise SetupError("must be greater than zero")
    if unit != si_unit:
        raise SetupError(f"must be in {si_unit} or a multiple of it")


# Strict: TOML has types of its own, so "1" is no number; whole numbers count as numbers all the same.
Number = Annotated[float, Field(strict=True)]
Vector3 = tuple[Number, Number, Number]
Name = Annotated[str, Field(min_length=1, max_length=200)]
Path = Annotated[str, Field(min_length=1, max_length=1000)]
# What the log says of the channel may settle which of several meanings a label has.
Label = Annotated[str, _checked(require_label)]
Unit = Annotated[str, _checked(read_label)]
Quantity = Annotated[str, _checked(_quantity)]


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
    direction: Annotated[str | Vector3, _checked(unit_direction)] | None = None
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
    rate: Annotated[str | Number, _checked(partial(_number_with, si_unit="Hz"))] | None = None
    rate_unit: Annotated[str, _checked(_rate_unit)] = "Hz"
    dt: Annotated[str | Number, _checked(partial(_number_with, si_unit="s"))] | None = None
    dt_unit: Annotated[str, _checked(_time_unit)] = "s"
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

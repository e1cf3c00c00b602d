"""Tables of a model file as pydantic models; imported only when one is read, since pydantic takes its time.

They say which keys there are and of what type. What numbers mean depends on what they belong to (a joint of rotating
bodies has its stiffness in N m/rad), so units are checked where the records are made.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator

from chladni.models.core.port import HoldKind
from chladni.models.files.quantity import is_finite

MAX_TABLES = 1000
"""Most bodies, joints, inputs, ... of a file."""

MAX_COEFFICIENTS = 40
"""Most coefficients of a polynomial: a transfer function of higher order has no meaning in double precision."""

_NUMBER = "must be a number, or text with a unit such as '1.2 kN/mm'"


def _number(value: object) -> float | str:
    match value:
        case str():
            return value
        case bool():
            raise ValueError(_NUMBER)
        case int() | float() if is_finite(value):
            return float(value)
        case int() | float():
            raise ValueError("must be finite, and within double precision")
    raise ValueError(_NUMBER)


def _printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("must be text without line feeds and control characters")
    return text


Number = Annotated[float | str, PlainValidator(_number)]
# Names and channels are printed to terminals, which obey control characters.
Text = Annotated[str, Field(strict=True, min_length=1, max_length=1000), AfterValidator(_printable)]
Polynomial = Annotated[list[Number], Field(min_length=1, max_length=MAX_COEFFICIENTS)]
Channel = Text | None
Held = HoldKind | None


class Table(BaseModel):
    """What all tables share."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class BodyTable(Table):
    """``[[body]]``."""

    name: Text
    mass: Number | None = None
    inertia: Number | None = None
    position: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)


class JointTable(Table):
    """``[[joint]]``."""

    name: Text
    between: tuple[Text, Text]
    stiffness: Number
    damping: Number


class InputTable(Table):
    """``[[input]]`` of a structure."""

    name: Text
    kind: Literal["force", "base_acceleration", "displacement", "disturbance"] = "force"
    at: Text | None = None
    joint: Text | None = None
    channel: Channel = None
    hold: Held = None


class OutputTable(Table):
    """``[[output]]`` of a structure."""

    name: Text
    measures: Literal["acceleration", "velocity", "displacement", "force"]
    at: Text | None = None
    joint: Text | None = None
    channel: Channel = None
    hold: Held = None


class ControllerTable(Table):
    """``[[controller]]``."""

    name: Text
    feedback: Text
    drives: Text
    reference: Channel = None
    hold: Held = None
    law: Literal["p", "pd", "pi", "pid", "p-p", "transfer-function"] | None = None
    gains: dict[str, Number] = {}
    num: Polynomial | None = None
    den: Polynomial | None = None
    rate_of: Literal["feedback", "error"] = "feedback"
    gain: Number | None = None
    limit: Number | None = None


class EffectTable(Table):
    """``[[effect]]``."""

    effect: Text
    site: Text
    variant: Text | None = None
    parameters: dict[str, Number] = {}


class AnyFile(BaseModel):
    """Any file, to see which kind it is."""

    model_config = ConfigDict(extra="ignore")

    kind: Any = None


class ModelFile(Table):
    """What files of all kinds hold."""

    format: Literal["chladni.model/1"]
    name: Text
    kind: Literal["structure", "drive", "scheme"]
    effect: Annotated[list[EffectTable], Field(max_length=MAX_TABLES)] = []
    tolerance: dict[str, Any] = {}


class StructureFile(ModelFile):
    """A file of a structure."""

    body: Annotated[list[BodyTable], Field(min_length=1, max_length=MAX_TABLES)]
    joint: Annotated[list[JointTable], Field(max_length=MAX_TABLES)] = []
    input: Annotated[list[InputTable], Field(max_length=MAX_TABLES)] = []
    output: Annotated[list[OutputTable], Field(max_length=MAX_TABLES)] = []
    controller: Annotated[list[ControllerTable], Field(max_length=MAX_TABLES)] = []


class SignalTable(Table):
    """``[[input]]`` and ``[[output]]`` of a drive."""

    signal: Text
    name: Text | None = None
    channel: Channel = None
    hold: Held = None


class DriveFile(ModelFile):
    """A file of a drive."""

    drive: Text
    parameters: dict[str, Number] = {}
    options: dict[str, Text] = {}
    input: Annotated[list[SignalTable], Field(max_length=MAX_TABLES)] = []
    output: Annotated[list[SignalTable], Field(max_length=MAX_TABLES)] = []


class SchemeFile(ModelFile):
    """A file of a block scheme; its tables are looked at where blocks are known."""

    block: Any = None
    input: Any = None
    output: Any = None
    derivative_filter: Any = None
    tolerance: Any = None

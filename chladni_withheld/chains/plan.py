"""What a case is made of: parts, places, channels, numbers; and the model file that tells it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

GROUND = "ground"


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """Spring and damper between two bodies; `first` may be ``ground``."""

    name: str
    first: str
    second: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Input:
    """A force on a body, between the bodies of a joint, or an acceleration of the ground (`at` is ``ground``)."""

    name: str
    channel: str
    unit: str
    at: str = ""
    joint: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """What is measured at a body, or between the bodies of a joint.

    Attributes
    ----------
    measures
        ``acceleration``, ``velocity`` or ``displacement``, or a drive's own signal, such as ``pressure_drop``.
    fed_back
        Whether a controller sees it.
    """

    name: str
    channel: str
    measures: str
    unit: str
    at: str = ""
    joint: str = ""
    fed_back: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """A controller: its gains are among the plan's numbers, ``NAME.kp`` and so on, and aren't doubted.

    Attributes
    ----------
    law
        ``p-p``, ``pd`` or ``pid``, on the output `feedback`, a displacement.
    limit
        Of the force, or None.
    """

    name: str
    reference: str
    feedback: str
    drives: str
    law: Literal["p-p", "pd", "pid"]
    limit: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """A structure and its instruments.

    Attributes
    ----------
    numbers
        Nominal numbers by the names that the model's parameters have: ``body2.mass``, ``joint1.stiffness``.
    tolerance
        One sigma over the value, of each number.
    rotary
        Whether bodies turn: inertias, torques, angles.
    drive, options
        Kind of drive and its options; a structure has neither.
    """

    name: str
    bodies: tuple[str, ...]
    joints: tuple[Joint, ...]
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    loop: Loop | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)
    tolerance: Mapping[str, float] = field(default_factory=dict)
    rotary: bool = False
    drive: str = ""
    options: Mapping[str, str] = field(default_factory=dict)

    def inertia_of(self, body: str) -> str:
        """Name of the number that holds a body's inertia."""
        if self.drive:
            return "inertia" if self.rotary else "reduced_mass"
        return f"{body}.inertia" if self.rotary else f"{body}.mass"

    def of_joint(self, numbers: Mapping[str, float], joint: str, word: str) -> float:
        """A joint's ``stiffness`` or ``damping``; a drive has no springs."""
        return numbers.get(f"{joint}.{word}", 0.0)

    def joint(self, name: str) -> Joint:
        """Joint by its name."""
        return next(joint for joint in self.joints if joint.name == name)

    def driven(self) -> tuple[str, ...]:
        """Names of what drives a simulation from outside: inputs, with a loop's reference in place of its motor."""
        motor = "" if self.loop is None else self.loop.drives
        reference = () if self.loop is None else (self.loop.name,)
        return (*(one.name for one in self.inputs if one.name != motor), *reference)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """An effect of the machine that the model doesn't have.

    Attributes
    ----------
    effect
        Word of the vocabulary, or of what is outside of it.
    site
        Joint, body, input, output or ``ground``.
    law
        Which of the hidden laws.
    numbers
        Of the law, SI.
    source
        The other output, of ``cross_axis``.
    """

    effect: str
    site: str
    law: str
    numbers: Mapping[str, float]
    source: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A plan, and the grid on which its log is taken.

    Attributes
    ----------
    rate_hz, samples
        Of the log.
    modes_hz
        Natural frequencies of the nominal machine but for rigid motion, rising; a loop's own are among them.
    """

    plan: Plan
    rate_hz: float
    samples: int
    modes_hz: tuple[float, ...]


def model_text(plan: Plan) -> str:
    """Give ``model.toml`` with the nominal numbers; written by hand so that it shares nothing with the reader."""
    return "\n\n".join(_drive_tables(plan) if plan.drive else _structure_tables(plan)) + "\n"


def _structure_tables(plan: Plan) -> list[str]:
    return [
        f'format = "chladni.model/1"\nname = "{plan.name}"\nkind = "structure"',
        *(_table("body", {"name": body, plan.inertia_of(body).split(".")[1]: plan.numbers[plan.inertia_of(body)]})
          for body in plan.bodies),
        *(_table("joint", {
            "name": joint.name, "between": [joint.first, joint.second],
            "stiffness": plan.numbers[f"{joint.name}.stiffness"], "damping": plan.numbers[f"{joint.name}.damping"],
        }) for joint in plan.joints),
        *(_input(one) for one in plan.inputs),
        *(_output(one) for one in plan.outputs),
        *_controllers(plan),
        _tolerances(plan),
    ]  # fmt: skip


def _drive_tables(plan: Plan) -> list[str]:
    options = [f'{name} = "{word}"' for name, word in plan.options.items()]
    return [
        f'format = "chladni.model/1"\nname = "{plan.name}"\nkind = "drive"\ndrive = "{plan.drive}"',
        *(["\n".join(["[options]", *options])] if options else []),
        "\n".join(["[parameters]", *(f"{name} = {value!r}" for name, value in plan.numbers.items())]),
        *(_table("input", {"signal": one.name, "channel": one.channel}) for one in plan.inputs),
        *(_table("output", {"signal": one.measures, "channel": one.channel}) for one in plan.outputs),
        "\n".join(["[tolerance]", *(f"{name} = {value!r}" for name, value in plan.tolerance.items())]),
    ]


def _table(name: str, content: dict[str, object]) -> str:
    return "\n".join([f"[[{name}]]", *(f"{key} = {_value(value)}" for key, value in content.items())])


def _value(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + " }"
    return repr(value)


def _place(one: Input | Output) -> dict[str, object]:
    return {"joint": one.joint} if one.joint else {"at": one.at}


def _input(one: Input) -> str:
    kind = "base_acceleration" if one.at == GROUND else "force"
    return _table("input", {"name": one.name, "kind": kind, **_place(one), "channel": one.channel})


def _output(one: Output) -> str:
    return _table("output", {"name": one.name, "measures": one.measures, **_place(one), "channel": one.channel})


def _controllers(plan: Plan) -> Iterable[str]:
    if plan.loop is None:
        return
    loop = plan.loop
    gains = {name.split(".")[1]: value for name, value in plan.numbers.items() if name.startswith(f"{loop.name}.")}
    gain = gains.pop("gain")
    content: dict[str, object] = {
        "name": loop.name, "reference": loop.reference, "feedback": loop.feedback, "law": loop.law, "gains": gains,
        "drives": loop.drives, "gain": f"{gain!r} N m/V" if plan.rotary else f"{gain!r} N/V",
    }  # fmt: skip
    if loop.limit is not None:
        content["limit"] = f"{loop.limit!r} N m" if plan.rotary else f"{loop.limit!r} N"
    yield _table("controller", content)


def _tolerances(plan: Plan) -> str:
    return "\n".join(["[tolerance]", "default = 0.05", *(f'"{name}" = {value!r}' for name, value in
                                                          plan.tolerance.items())])  # fmt: skip

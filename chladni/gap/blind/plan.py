"""What a case is made of, as the model file will tell it: parts, places, channels, numbers."""

from collections.abc import Mapping
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

"""What is measured on a structure."""

from dataclasses import dataclass
from typing import Literal

from chladni.models.core.port import HoldKind
from chladni.models.structures.structure import Motion

Measure = Literal["acceleration", "velocity", "displacement", "force"]

_UNITS: dict[Motion, dict[Measure, str]] = {
    "translation": {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "force": "N"},
    "rotation": {"acceleration": "rad/s^2", "velocity": "rad/s", "displacement": "rad", "force": "N m"},
}


def measure_unit(measure: Measure, motion: Motion) -> str:
    """SI unit of a measure, by whether the body translates or rotates."""
    return _UNITS[motion][measure]


@dataclass(frozen=True, slots=True, kw_only=True)
class StructureOutput:
    """One output.

    At a body: its acceleration in space, as an accelerometer feels it; its velocity and displacement relative to the
    ground. At a joint: the motion of the second end minus that of the first, or the force that the joint resists
    with (spring, damper and every law that acts at the joint), positive when the second end is pulled back.

    Attributes
    ----------
    name
        Name in the model.
    measures
        ``force`` only at a joint.
    at
        A body or a joint.
    channel
        Channel of a log that holds it, or None.
    hold
        How it's sampled, see `Terminal`.
    """

    name: str
    measures: Measure
    at: str
    channel: str | None = None
    hold: HoldKind | None = None

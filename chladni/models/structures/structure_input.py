"""What drives a structure: forces, a shaking ground, a prescribed motion, a disturbance of a controller."""

from dataclasses import dataclass
from typing import Literal

from chladni.models.core.port import HoldKind

InputKind = Literal["force", "base_acceleration", "displacement", "disturbance"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StructureInput:
    """One input.

    ===================== ========================= =================================================================
    kind                  acts at                   what it does
    ===================== ========================= =================================================================
    ``force``             a body, or a joint        a force (torque) on the body, or of an actuator between a joint's
                                                    bodies: + on the second, - on the first
    ``base_acceleration`` ``ground``                the ground's acceleration; everything stands on it
    ``displacement``      a body                    prescribes the body's motion relative to the ground
    ``disturbance``       a controller              adds to the controller's command, before gain and limit
    ===================== ========================= =================================================================

    Attributes
    ----------
    name
        Name in the model.
    at
        Body, joint, controller or ``ground``.
    kind
        See the table.
    channel
        Channel of a log that holds it, or None.
    hold
        How it runs between its samples, see `Terminal`.
    """

    name: str
    at: str
    kind: InputKind = "force"
    channel: str | None = None
    hold: HoldKind | None = None

"""Terminals and ports: where signals enter and leave a compiled model, and where effects attach."""

from dataclasses import dataclass
from typing import Literal

PortKind = Literal["joint", "body", "ground", "input", "actuation", "output", "pair", "output_pair"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Terminal:
    """A named input or output.

    Attributes
    ----------
    name
        Name in the model.
    unit
        SI unit of the signal.
    channel
        Channel of a log that holds it, or None.
    derivatives
        For inputs: how many time derivatives of the signal the equations need beside it. 2 for a prescribed
        displacement, whose velocity and acceleration act too; else 0.
    """

    name: str
    unit: str
    channel: str | None = None
    derivatives: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """A place where a law may add a force (or a signal) f that depends on a displacement d and a velocity s.

    ============== ====================== ====================== ===============================================
    kind           d                      s                      f
    ============== ====================== ====================== ===============================================
    ``joint``      second body minus      its rate               resists: -f acts on the second body, +f on the
                   first                                         first; adds to the joint's force output
    ``body``       of the body            its rate               acts on the body, along +
    ``ground``     0                      0                      acceleration added to the ground's [m/s^2]
    ``input``      the command, after     0                      adds to the command
                   what acts before
    ``actuation``  of the place where     its rate               adds to the input's force, along +
                   the input acts
    ``output``     the output, after      0                      adds to the output (and to what feeds it back)
                   what acts before
    ``pair``       second body minus      its rate               resists, as at a joint: `first~second`, where the
                   first                                         first may be ``ground``
    ============== ====================== ====================== ===============================================

    For a rotating joint read angle, angular velocity and torque. Two outputs (``output_pair``) are a site without a
    port.

    Attributes
    ----------
    name
        The site: name of the joint, body, input or output; ``ground``; ``arm~hand`` of a pair.
    stiffness, damping
        Of a joint's linear spring and damper, SI; 0 elsewhere. Laws that replace the spring (backlash) need them.
    unit
        Of f.
    displacement_unit
        Of d.
    """

    name: str
    kind: PortKind
    unit: str = "N"
    displacement_unit: str = "m"
    stiffness: float = 0.0
    damping: float = 0.0

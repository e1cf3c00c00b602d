"""Terminals and ports: where signals enter and leave a compiled model, and where effects attach."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

from chladni.signals.errors import ModelError
from chladni.signals.wording import near_words

PortKind = Literal["joint", "body", "ground", "input", "actuation", "output", "pair", "output_pair"]
#: What an input does between its samples: keeps the last one, runs straight to the next, is band-limited.
HoldKind = Literal["zoh", "foh", "band_limited"]
HOLDS: Final[tuple[HoldKind, ...]] = get_args(HoldKind)


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
    hold
        How the signal runs between its samples, None where nobody has said. Of an output: ``band_limited`` where an
        anti-alias filter stood before its sampling; else a sample is the value at its stamp.
    """

    name: str
    unit: str
    channel: str | None = None
    derivatives: int = 0
    hold: HoldKind | None = None


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


def require_named(holds: Mapping[str, HoldKind], known: Iterable[str]) -> None:
    """Refuse holds of signals that there aren't; `ModelError` with the nearest name."""
    names = list(known)
    for name in holds:
        if name not in names:
            near = near_words(name, names)
            wish = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names) or 'none'}"
            raise ModelError(f"no input or output {name[:60]!r}; {wish}")

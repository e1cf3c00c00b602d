"""End stops at both ends of a stroke."""

from typing import Any

from chladni.models.core.port_law import PortLaw


def end_stops_law(d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Force of a spring and damper beyond either end; a stop pushes, it never pulls.

    `parameters`: low end, high end [m], stiffness [N/m], damping [N s/m].
    """
    low, high, stiffness, damping = parameters[0], parameters[1], parameters[2], parameters[3]
    # Leaving fast, the damper would outweigh the spring and hold the piston back.
    force = 0.0
    if d > high:
        force = max(0.0, stiffness * (d - high) + damping * s)
    elif d < low:
        force = min(0.0, stiffness * (d - low) + damping * s)
    return force


def end_stops(*, low: float, high: float, stiffness: float, damping: float) -> PortLaw:
    """Stops at displacements `low` and `high` [m] of the joint where the law is placed.

    Force balance beyond the upper end, ``F = max(0, k (d - high) + c s)``, likewise below; so a constant force F_0
    rests at a penetration of F_0/k.
    """
    return PortLaw(port=0, function=end_stops_law, parameters=(low, high, stiffness, damping))

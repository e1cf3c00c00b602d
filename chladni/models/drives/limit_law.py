"""Dead zone and saturation of a command, in one law at an input port."""

from sys import float_info
from typing import Any

from chladni.models.core.port_law import PortLaw

#: Larger than any command; infinite numbers have no place among the parameters of a law.
UNLIMITED = float_info.max


def limited(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """What is left of a command minus the command; a `LawFunction`.

    `parameters`: half width of the dead zone, largest magnitude behind it.

    Examples
    --------
    >>> [command + limited(command, 0.0, 0.0, (1.0, 1.5), (), ()) for command in (0.5, 2.0, -3.0)]
    [0.0, 1.0, -1.5]
    """
    width, limit = parameters[0], parameters[1]
    # Both in one law: laws at one port add up, and don't see each other.
    left = 0.0
    if d > width:
        left = min(d - width, limit)
    elif d < -width:
        left = max(d + width, -limit)
    return float(left - d)


def limit_law(*, half_width: float = 0.0, limit: float = UNLIMITED) -> PortLaw:
    """Nothing within `half_width`, and never more than `limit`; the port is filled in where the law is placed."""
    return PortLaw(port=0, function=limited, parameters=(half_width, limit))

"""What a controller's limit adds to its command."""

from typing import Any


def limiter(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give sat(d) - d: nothing inside the limit, and what is above it taken away; a `LawFunction`.

    Examples
    --------
    >>> limiter(3.0, 0.0, 0.0, (2.0,), (), ()), limiter(-1.0, 0.0, 0.0, (2.0,), (), ())
    (-1.0, 0.0)
    """
    limit = parameters[0]
    if d > limit:
        return float(limit - d)
    if d < -limit:
        return float(-limit - d)
    return 0.0

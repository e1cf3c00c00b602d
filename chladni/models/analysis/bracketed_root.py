"""A root inside a bracket, by Newton's steps that never leave it."""

from collections.abc import Callable
from math import inf

# A step of Newton's this much smaller than the bracket, and than the step before, leaves an error of its square.
SURE, CONVERGING = 1e-7, 1e-3
# Bisection alone needs about as many steps as a double has bits.
MOST_STEPS = 100


def bracketed_root(
    measure: Callable[[float], tuple[float, float]],
    low: float,
    high: float,
    *,
    begins_below: bool,
    guess: float,
    rounding: float,
) -> float:
    """Find where a signal passes zero, to rounding.

    A step that would leave the bracket, or isn't half of the one before, is replaced by bisection (Press et al. 2007,
    section 9.4): at a jump, where a slope says nothing, that alone goes on.

    Parameters
    ----------
    measure
        Gives the signal and its slope at a place.
    low, high
        The signal has one sign at one of them and another one at the other.
    begins_below
        Whether the signal is negative at `low`.
    guess
        Where to begin, inside.
    rounding
        A step as small as this ends the search.

    Examples
    --------
    >>> root = bracketed_root(lambda x: (x * x - 2, 2 * x), 1.0, 2.0, begins_below=True, guess=1.5, rounding=0.0)
    >>> round(root, 12)
    1.414213562373
    """
    width = last = high - low
    at = guess
    for _ in range(MOST_STEPS):
        away, slope = measure(at)
        low, high = (at, high) if (away < 0) == begins_below else (low, at)
        further = at - away / slope if slope else inf
        newton = low <= further <= high and abs(further - at) <= 0.5 * last
        if not newton:
            further = 0.5 * (low + high)
        step = abs(further - at)
        if step <= rounding or (newton and step <= min(SURE * width, CONVERGING * last)):
            return further
        last, at = step, further
    return at

"""Counts and bounds in sentences."""

from math import floor, log10


def counted(number: int, noun: str) -> str:
    """Give a count with its noun, in the plural unless there's one.

    Examples
    --------
    >>> counted(1, "sample"), counted(0, "gap"), counted(3, "message")
    ('1 sample', '0 gaps', '3 messages')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def rounded_up(bound: float, *, digits: int = 3) -> str:
    """Give a lower bound of what may be asked for, to so many digits and never below it: the next larger number.

    Examples
    --------
    >>> rounded_up(0.53407), rounded_up(0.5), rounded_up(12.34, digits=2)
    ('0.535', '0.5', '13')
    """
    told = f"{bound:.{digits}g}"
    if not bound > 0 or float(told) >= bound:
        return told
    return f"{float(told) + 10.0 ** (floor(log10(bound)) + 1 - digits):.{digits}g}"

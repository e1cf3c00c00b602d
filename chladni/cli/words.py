"""Numbers as people read them in a table."""

from math import isfinite

from chladni.signals.wording import with_sigma

NOTHING = "-"
PLAIN_BELOW = 1e7
# Zero has no sign that anybody measured.
ZERO = {"-0": "0"}


def number(value: float | None, *, digits: int = 4) -> str:
    """Give a number to so many significant digits, a dash when there is none.

    Examples
    --------
    >>> number(0.00012345), number(None), number(1700.0), number(12800.0), number(-0.0)
    ('0.0001234', '-', '1700', '12800', '0')
    """
    if value is None or not isfinite(value):
        return NOTHING
    told = f"{value:.{digits}g}"
    if "e+" in told and abs(value) < PLAIN_BELOW:
        # An exponent is harder to read than a few more digits.
        told = f"{value:.0f}"
    return ZERO.get(told, told)


def angle(degrees: float) -> str:
    """Give an angle to whole degrees.

    Examples
    --------
    >>> angle(-0.3), angle(89.6)
    ('0', '90')
    """
    return number(round(degrees), digits=3)


def fixed(value: float, *, places: int) -> str:
    """Give a number to so many places, a dash when there is none.

    Examples
    --------
    >>> fixed(0.99949, places=3), fixed(float("nan"), places=3)
    ('0.999', '-')
    """
    return f"{value:.{places}f}" if isfinite(value) else NOTHING


def count(value: int | None) -> str:
    """Give a count, with a space between thousands, a dash when there is none.

    Examples
    --------
    >>> count(1234567), count(0)
    ('1 234 567', '0')
    """
    return NOTHING if value is None else f"{value:,}".replace(",", " ")


def unit(text: str) -> str:
    """Give a unit, a dash for the unit of pure numbers and of channels that say none.

    Examples
    --------
    >>> unit("m/s^2"), unit("1")
    ('m/s^2', '-')
    """
    return NOTHING if text == "1" else text


def with_error(value: float, std: float) -> str:
    """Give a value to the digits that its one sigma allows.

    Examples
    --------
    >>> with_error(7.32441, 0.0021), with_error(0.258, float("inf")), with_error(24.7, 0.0)
    ('7.3244 ± 0.0021', '0.258 ± ?', '24.7')
    """
    return with_sigma(value, std, unknown=" ± ?")

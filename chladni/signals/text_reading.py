"""Lines and numbers in text that others wrote, each read in one way everywhere.

Python's own ways are made for programs. `str.splitlines` ends lines at form feeds and Unicode's separators as well,
which files have within their lines. `float` and `int` take ``1_0`` for ten, and the digits of any script.
"""

import re
from typing import Final

_LINE_END: Final = re.compile(r"\r\n|\r|\n")


def lines_of(text: str) -> list[str]:
    r"""Give the lines of a text without their ends: LF, CR LF and CR end one, as when Python reads a file.

    Examples
    --------
    >>> lines_of("a\x0cb\r\nc\n")
    ['a\x0cb', 'c']
    """
    lines = _LINE_END.split(text)
    return lines if lines[-1] else lines[:-1]


def real_number(text: str) -> float:
    """Give the number that a text is: ASCII digits with a sign, decimal point and exponent, or ``nan`` or ``inf``.

    Blanks around it are passed over.

    Raises
    ------
    ValueError
        When it's no number.

    Examples
    --------
    >>> real_number(" 1.5e3 ")
    1500.0
    >>> real_number("1_0")
    Traceback (most recent call last):
    ValueError: '1_0' is no number
    """
    _require_plain(text, "number")
    return float(text)


def whole_number(text: str) -> int:
    """Give the whole number that a text is: ASCII digits and a sign; blanks around it are passed over.

    Raises
    ------
    ValueError
        When it's none, or has thousands of digits.

    Examples
    --------
    >>> whole_number(" -12")
    -12
    """
    _require_plain(text, "whole number")
    return int(text)


def _require_plain(text: str, what: str) -> None:
    if "_" in text or not text.isascii():
        raise ValueError(f"{text[:40]!r} is no {what}")

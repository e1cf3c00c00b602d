"""Counts, bounds, values and near words in sentences."""

from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from math import floor, log10
from typing import Final

MOST_SHOWN: Final = 60
"""Characters of a foreign value that a message repeats."""

# A slip is one of a word that people write, among names that they can have in mind.
_LONGEST_WORD: Final = 100
_MOST_WORDS: Final = 1000


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


def shown(found: object) -> str:
    """Give the start of a value as Python writes it.

    Examples
    --------
    >>> shown("x" * 100)
    "'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx..."
    """
    text = repr(found[: MOST_SHOWN + 1] if isinstance(found, str) else found)
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 3]}..."


def near_words(word: str, known: Iterable[str], *, count: int = 1, cutoff: float = 0.6) -> list[str]:
    """Give the known words that `word` may be a slip of, the nearest first.

    A word of more than 100 characters is nobody's slip, and comparing long ones takes minutes; of very many known
    words the first thousand are looked at.

    Examples
    --------
    >>> near_words("wirst", ["mass", "wrist"])
    ['wrist']
    """
    if len(word) > _LONGEST_WORD:
        return []
    short = (one for one in known if len(one) <= _LONGEST_WORD)
    return get_close_matches(word, islice(short, _MOST_WORDS), n=count, cutoff=cutoff)

"""Counts, bounds, values and near words in sentences."""

from collections.abc import Collection, Iterable, Sequence
from difflib import get_close_matches
from itertools import islice
from math import floor, isfinite, log10
from typing import Final

from chladni.signals.visible import visible

MOST_SHOWN: Final = 60
"""Characters of a foreign value that a message repeats."""

# A slip is one of a word that people write, among names that they can have in mind.
_LONGEST_WORD: Final = 100
_MOST_WORDS: Final = 1000
# More are those of values without noise, from a model, and nobody reads them.
_MOST_PLACES: Final = 9


def counted(number: int, noun: str) -> str:
    """Give a count with its noun, in the plural unless there's one.

    Examples
    --------
    >>> counted(1, "sample"), counted(0, "gap"), counted(3, "message")
    ('1 sample', '0 gaps', '3 messages')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def listed(words: Sequence[str]) -> str:
    """Give words as a list in a sentence.

    Examples
    --------
    >>> listed(["wrist"]), listed(["base", "elbow", "wrist"])
    ('wrist', 'base, elbow and wrist')
    """
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


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


def with_sigma(value: float, sigma: float, *, unknown: str = "", exact: str = "") -> str:
    """Give a value and one sigma, of which two digits say something, and the value to the second one's place.

    Parameters
    ----------
    value, sigma
        In one unit; not finite or zero as sigma where it isn't known, or nothing scatters.
    unknown, exact
        What then stands in its place.

    Examples
    --------
    >>> with_sigma(12.50312, 0.0213), with_sigma(1407.31, 122.0), with_sigma(0.258, float("inf"), unknown=" ± ?")
    ('12.503 ± 0.021', '1407 ± 120', '0.258 ± ?')
    >>> with_sigma(51.5, 2e-13), with_sigma(3.1e-7, 2e-8), with_sigma(1.5e12, 1e11)
    ('51.5 ± 2e-13', '3.10e-07 ± 2.0e-08', '1.50e+12 ± 1.0e+11')
    """
    # No bound known: digits that suggest one would be a lie.
    if not (isfinite(value) and isfinite(sigma)):
        return f"{value:.4g}{unknown}"
    if sigma <= 0:
        return f"{value:.6g}{exact}"
    power, places = _power(sigma), 1 - _power(sigma)
    size = max(abs(value), sigma)
    if places <= _MOST_PLACES and 1e-4 <= size < 1e6:
        return f"{value:.{max(places, 0)}f} ± {float(f'{sigma:.1e}'):.{max(places, 0)}f}"
    if 1e-4 <= size < 1e6:
        return f"{value:.{_MOST_PLACES}g} ± {sigma:.1g}"
    return f"{value:.{min(max(_power(size) - power + 1, 0), _MOST_PLACES)}e} ± {sigma:.1e}"


def _power(number: float) -> int:
    return int(f"{number:e}".split("e")[1])


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


def near_matches(word: str, known: Collection[str], *, count: int = 3) -> str:
    """Name what comes near `word`, or the first few of what there is, as they are shown.

    Examples
    --------
    >>> near_matches("/imu.linear_accel.x", ["/imu.linear_acceleration.x", "/odom.x"])
    'did you mean /imu.linear_acceleration.x?'
    """
    near = near_words(word, dict.fromkeys(known), count=count, cutoff=0.6)
    if near:
        return f"did you mean {' or '.join(map(visible, near))}?"
    first = sorted(known)[:8]
    more = f" and {len(known) - len(first)} more" if len(known) > len(first) else ""
    return f"there are: {', '.join(map(visible, first))}{more}" if first else "there are none"

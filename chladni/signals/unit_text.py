"""Algebra on the text of units: products, quotients and powers such as ``(m/s^2)^2/Hz``.

The text is all there is: no table says what a symbol means. An expression is read into factors, and written again in
one canonical order, so that equal factors give equal text. ``m/s^k`` and ``rad/s^k`` stay together as one factor,
because a reader wants accelerance in ``(m/s^2)/N`` and not in ``m/(N s^2)``.
"""

import re
from collections.abc import Callable

from chladni.signals.errors import SetupError

MAX_LENGTH = 100
MAX_EXPONENT = 99

# A factor is a symbol and the power of seconds it is divided by: ("m", 2) is m/s^2, ("N", 0) is N.
Factor = tuple[str, int]
Exponents = dict[Factor, int]
Scaled = tuple[float, Exponents]

MOTION = ("m", "rad")
# What results may be shown in beside SI: rates of these are written as those of motions are, (mm/s)^2/Hz.
_MOTION_AS_WRITTEN = (*MOTION, "nm", "um", "mm", "cm", "km", "inch", "in", "mil", "ft", "deg", "mrad")
SECOND: Factor = ("s", 0)

# Micro and ohm signs have twins among the Greek letters that look the same; both are meant.
_SPELLINGS = str.maketrans(
    {
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        "\N{OHM SIGN}": "ohm",
        "\N{GREEK CAPITAL LETTER OMEGA}": "ohm",
        "·": "*",
        "⋅": "*",
        "∙": "*",
        "•": "*",
        "×": "*",
        "%": "percent",
        "‰": "permille",
        # What editors make of a minus, and what looks like the degree sign.
        "\N{MINUS SIGN}": "-",
        "\N{EN DASH}": "-",
        "\N{HYPHEN}": "-",
        "\N{NON-BREAKING HYPHEN}": "-",
        "\N{MASCULINE ORDINAL INDICATOR}": "°",
        "\N{RING ABOVE}": "°",
    }
)
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_RAISED_RUN = re.compile(r"⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_WORDS = (
    # Degrees of temperature are one symbol; deg C would be a product.
    (re.compile(r"(?:°|\b[Dd]eg(?:rees?)?\.?)\s*(?:([CFK])\b|([Cc])elsius\b|([Ff])ahrenheit\b)"), r" deg\1\2\3 "),
    (re.compile(r"°"), "deg"),
    (re.compile(r"\s+per\s+"), "/"),
    (re.compile(r"\bsquare\s+([A-Za-z]+)"), r"\1^2"),
    (re.compile(r"\bcubic\s+([A-Za-z]+)"), r"\1^3"),
    (re.compile(r"\s+squared\b"), "^2"),
    (re.compile(r"\s+cubed\b"), "^3"),
    # Powers in braces or parentheses, as TeX and some exporters have them.
    (re.compile(r"\^\s*[{(]\s*([+-]?[0-9]+)\s*[})]"), r"^\1"),
    # A dot closes an abbreviation (in./s); between symbols it multiplies, as a hyphen does: N.m, ft-lbf, m.s-2.
    (re.compile(r"(?<=[A-Za-z])\.(?![A-Za-z0-9(])"), ""),
    (re.compile(r"(?<=[A-Za-z0-9)])[.-](?=[A-Za-z(])"), "*"),
)
_TOKEN = re.compile(
    r"\s*(?:(?P<symbol>[A-Za-z_]+)|(?P<number>-?[0-9]+)|(?P<operator>[*/()])|\^\s*(?P<exponent>[+-]?[0-9]+))"
)


def read(text: str, resolve: Callable[[str], Scaled]) -> Scaled:
    """Read an expression of symbols, ``*``, ``/``, ``^`` and parentheses; a blank multiplies.

    Parameters
    ----------
    text
        Such as ``"kN/mm"`` or ``"V/(m/s²)"``, at most 100 characters.
    resolve
        Gives the scale and the factors of one symbol; raises `SetupError` when it knows none.

    Raises
    ------
    SetupError
        When the text is no such expression, an exponent is out of bounds, or the scale overflows.
    """
    if len(text) > MAX_LENGTH:
        raise SetupError(f"unit {text[:20]!r}... has {len(text)} characters; at most {MAX_LENGTH} are read")
    return _Reader(text, resolve).whole()


def symbol_as_written(symbol: str) -> Scaled:
    """Take a symbol for itself, the `resolve` of pure text algebra."""
    return 1.0, {(symbol, 0): 1}


def write(exponents: Exponents) -> str:
    """Write factors in canonical order: ``1``, ``N``, ``m/s^2``, ``(m/s^2)/N``, ``N s/m``, ``m/(A V)``."""
    above = [_power(factor, power) for factor, power in sorted(exponents.items()) if power > 0]
    below = [_power(factor, -power) for factor, power in sorted(exponents.items()) if power < 0]
    if not below:
        return _bare(above[0]) if len(above) == 1 else " ".join(above) or "1"
    denominator = below[0] if len(below) == 1 else f"({' '.join(below)})"
    return f"{' '.join(above) or '1'}/{denominator}"


def with_unit(number: str, unit: str) -> str:
    """Put a unit behind a number in a sentence; nothing for the unit of pure numbers.

    Examples
    --------
    >>> with_unit("2000", "N"), with_unit("2000", "1")
    ('2000 N', '2000')
    """
    return number if unit == "1" else f"{number} {unit}"


def printed_unit(unit: str) -> str:
    """Give a unit as it's printed.

    Examples
    --------
    >>> printed_unit("(m/s^2)^2/Hz")
    '(m/s²)²/Hz'
    """
    return unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴").replace("*", "·")


def in_unit(unit: str) -> str:
    """Say in a sentence which unit something is in.

    Examples
    --------
    >>> f"'a' is {in_unit('N')}, 'b' {in_unit('1')}"
    "'a' is in N, 'b' without unit"
    """
    return "without unit" if unit == "1" else f"in {unit}"


def combined(left: Scaled, right: Scaled, *, power: int = 1) -> Scaled:
    """Multiply a scaled unit by another one raised to a power.

    Raises
    ------
    SetupError
        When an exponent leaves ``MAX_EXPONENT`` or the scale 1e-150 to 1e150.
    """
    exponents = dict(left[1])
    for factor, exponent in right[1].items():
        exponents[factor] = exponents.get(factor, 0) + power * exponent
    result = _settled({factor: exponent for factor, exponent in exponents.items() if exponent})
    try:
        scale = left[0] * right[0] ** power
    except OverflowError:
        scale = 0.0
    if not 1e-150 < scale < 1e150 or any(abs(exponent) > MAX_EXPONENT for exponent in result.values()):
        raise SetupError(
            f"unit {write(right[1])!r} to the power of {power}: exponents go to {MAX_EXPONENT}, scales to 1e150"
        )
    return scale, result


def spelled(text: str) -> str:
    """Give an expression in the one spelling that is read: ``m/s²``, ``m/s**2`` and ``m/s^{2}`` are ``m/s^2``."""
    raised = _RAISED_RUN.sub(lambda run: "^" + run.group().translate(_RAISED), text)
    plain = raised.translate(_SPELLINGS).replace("**", "^")
    for pattern, replacement in _WORDS:
        plain = pattern.sub(replacement, plain)
    return plain.strip()


class _Reader:
    """Recursive descent over one expression; depth and length are bounded by `MAX_LENGTH`."""

    def __init__(self, text: str, resolve: Callable[[str], Scaled]) -> None:
        self._text = text
        self._resolve = resolve
        self._rest = self._tokens(spelled(text))

    def whole(self) -> Scaled:
        if not self._rest:
            return 1.0, {}
        result = self._expression()
        if self._rest:
            raise self._mistake(f"{self._rest[0][1]!r} has no place there")
        return result

    def _tokens(self, spelled: str) -> list[tuple[str, str]]:
        tokens: list[tuple[str, str]] = []
        place = 0
        while place < len(spelled):
            match = _TOKEN.match(spelled, place)
            if match is None:
                raise self._mistake(f"{spelled[place:].strip()[:10]!r} can't be read")
            kind, content = str(match.lastgroup), match.group(str(match.lastgroup))
            # Digits count as an exponent only right behind a symbol: m/s2, but not "m 2". None writes m0 for 1.
            if kind == "number" and tokens and tokens[-1][0] == "symbol" and match.group() == content != "0":
                kind = "exponent"
            tokens.append((kind, content))
            place = match.end()
        return tokens

    def _expression(self) -> Scaled:
        result = self._factor()
        divided = False
        while self._rest and self._rest[0][1] != ")":
            operator = self._rest.pop(0)[1] if self._rest[0][1] in {"*", "/"} else " "
            if operator == " " and divided:
                raise self._mistake("a blank after '/' is ambiguous; write N/(m s) or N/m*s")
            divided = divided or operator == "/"
            result = combined(result, self._factor(below=operator == "/"), power=-1 if operator == "/" else 1)
        return result

    def _factor(self, *, below: bool = False) -> Scaled:
        # Only the bare 1 is a number that units have; anything else is a quantity, or a slip.
        kind, text = self._rest.pop(0) if self._rest else ("", "its end")
        if kind == "symbol":
            glued = self._glued(text)
            if glued is not None:
                return glued
            result = self._resolve(text)
        elif (kind, text) == ("number", "1"):
            result = (1.0, {})
        elif text == "(":
            result = self._group()
        else:
            raise self._mistake(f"found {text!r} where a symbol is due")
        if self._rest and self._rest[0][0] == "exponent":
            exponent = self._exponent()
            if below and exponent < 0:
                raise self._mistake("a negative power behind '/' divides twice; write m/s^2 or m s^-2")
            result = combined((1.0, {}), result, power=exponent)
        return result

    def _exponent(self) -> int:
        exponent = int(self._rest.pop(0)[1])
        if abs(exponent) > MAX_EXPONENT:
            raise self._mistake(f"exponents go to {MAX_EXPONENT}, found {exponent}")
        return exponent

    def _glued(self, symbol: str) -> Scaled | None:
        """A motion and its seconds written as one: ms^-2 is m s^-2 to whoever measures vibration, never 1/(ms)^2."""
        if len(symbol) < 2 or symbol[-1] != "s" or not self._rest or self._rest[0][0] != "exponent":
            return None
        try:
            scale, factors = self._resolve(symbol[:-1])
        except SetupError:
            return None
        if list(factors.values()) != [1] or next(iter(factors)) not in {(motion, 0) for motion in MOTION}:
            return None
        exponent = self._exponent()
        if exponent > 0:
            meanings = f"{symbol[:-1]}/s^{exponent} or ({symbol})^{exponent}"
            raise self._mistake(f"{symbol}^{exponent} may be meant as {meanings}; write which")
        return combined((scale, factors), self._resolve("s"), power=exponent)

    def _group(self) -> Scaled:
        result = self._expression()
        if not self._rest:
            raise self._mistake("a parenthesis is not closed")
        self._rest.pop(0)
        return result

    def _mistake(self, what: str) -> SetupError:
        return SetupError(f"unit {self._text!r}: {what}; units look like m/s^2, N s/m or (m/s^2)/N")


def _settled(exponents: Exponents) -> Exponents:
    """Move seconds into motion: m * s^-2 becomes m/s^2, (m/s) * s^-1 too; N s/m stays as it is."""
    result = dict(exponents)
    # Numerators first: in (m/s^2)/(rad/s) over s it's the acceleration that becomes a jerk.
    for factor in sorted(result, key=lambda factor: (-result[factor], factor)):
        symbol, per_second = factor
        power, seconds = result[factor], result.get(SECOND, 0)
        if symbol not in _MOTION_AS_WRITTEN or not seconds or seconds % power:
            continue
        moved = per_second - seconds // power
        if moved < 0 or (power < 0 and per_second == 0):
            continue
        del result[factor], result[SECOND]
        result[symbol, moved] = result.get((symbol, moved), 0) + power
        if not result[symbol, moved]:
            del result[symbol, moved]
        break
    return result


def _power(factor: Factor, power: int) -> str:
    symbol, per_second = factor
    if per_second:
        symbol = f"({symbol}/s^{per_second})" if per_second > 1 else f"({symbol}/s)"
    return symbol if power == 1 else f"{symbol}^{power}"


def _bare(text: str) -> str:
    return text[1:-1] if text.endswith(")") else text

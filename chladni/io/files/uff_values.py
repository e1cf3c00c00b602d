"""The values of a function in a universal file: text by columns or blanks, binary in its writer's number format."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Bytes, Real
from chladni.signals.errors import LogError
from chladni.signals.text_reading import real_number
from chladni.signals.wording import counted

#: Bytes of a number and numbers of a value, by ordinate type.
VALUE_SIZES = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}
# Columns of the format leave no blank between a number and the sign of the next; Fortran leaves out the letter of an
# exponent of three digits.
_NUMBER = re.compile(
    rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+|[-+]\d{3}(?![\d.]))?|[-+]?(?:nan|inf(?:inity)?)\b", re.IGNORECASE
)
_DOUBLE = 8
# Columns of a single and of a double, and of a line (E13.5 and E20.12 of the specification of dataset 58).
_WIDTHS = {4: 13, 8: 20}
_LINE = 80
_DEC, _IEEE, _IBM = 1, 2, 3
_IEEE_LITTLE, _IEEE_BIG = "IEEE little endian", "IEEE big endian"
_LITTLE, _BIG = 1, 2
_REMEDY = (
    "state the format in columns 8 to 19 of its line 58b (byte order 1 little, 2 big endian; format 1 DEC, 2 IEEE, "
    "3 IBM), or export it as text (58)"
)
# Squares of what 32 bits resolve span 64 bits; numbers read in a wrong format span all that their exponent can.
_WIDEST_SPAN = 2.0**64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Values:
    """Abscissae of unevenly spaced values, the values themselves, and sentences on how they were read."""

    x: Real | None
    data: NDArray[Any]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """What a function announces: bytes of a number, numbers of a value, values, and whether x stand between them."""

    width: int
    parts: int
    count: int
    even: bool

    @property
    def numbers(self) -> int:
        """Numbers of all values together, abscissae included."""
        return self.count * (self.parts + (0 if self.even else 1))

    def binary_sizes(self) -> tuple[int, ...]:
        """Bytes that the values may take: abscissae are single, or as wide as the values."""
        if self.even or self.width == 4:
            return (self.numbers * self.width,)
        return (self.numbers * self.width, self.count * (4 + self.parts * self.width))

    def odd_lines(self, body: bytes) -> int:
        """Lines that aren't as long as they are due, where most of them have the columns of the specification."""
        width = self.parts * _WIDTHS[self.width] + (0 if self.even else _WIDTHS[4])
        a_line = _LINE // width
        due = [a_line * width] * (self.count // a_line) + [self.count % a_line * width]
        lengths = [len(line.rstrip()) for line in body.split(b"\n")]
        found = [length for length in lengths if length]
        odd = sum(length != expected for length, expected in zip_longest(found, filter(None, due)))
        return odd if 2 * found.count(due[0]) > len(found) else 0

    def arranged(self, numbers: Real) -> tuple[Real | None, NDArray[Any]]:
        """Take apart abscissae and values, which stand one after the other."""
        rows = numbers.reshape(self.count, -1)
        x = None if self.even else rows[:, 0].copy()
        return x, self.joined(rows if self.even else rows[:, 1:])

    def joined(self, parts: Real) -> NDArray[Any]:
        """Make complex values of two numbers each; real ones have one."""
        columns = np.ascontiguousarray(parts)
        return (columns.view(np.complex128) if self.parts == 2 else columns)[:, 0]


def layout_of(kind: int, count: int, *, even: bool) -> Layout | None:
    """Give the layout that an ordinate type announces; None when there is no such type, or nothing is announced."""
    if kind not in VALUE_SIZES or count <= 0:
        return None
    width, parts = VALUE_SIZES[kind]
    return Layout(width=width, parts=parts, count=count, even=even)


def fortran_number(text: str) -> float:
    """Read a number as Fortran writes it: an exponent of E or D, or of three digits and no letter.

    Raises
    ------
    ValueError
        When it's no number.

    Examples
    --------
    >>> fortran_number("1.5D+01"), fortran_number("-2.5-101")
    (15.0, -2.5e-101)
    """
    try:
        return real_number(text)
    except ValueError:
        plain = text.strip().upper().replace("D", "E")
        sign = max(plain.rfind("+"), plain.rfind("-"))
        return real_number(f"{plain[:sign]}E{plain[sign:]}" if sign > 0 and "E" not in plain else plain)


# --- text --------------------------------------------------------------------------------------------------------


def text_values(body: bytes, layout: Layout) -> Values:
    """Read values as text, with exponents of E or D, or of three digits and no letter; numbers may touch.

    Raises
    ------
    LogError
        When there are fewer than announced, or one is no number.
    """
    words = body.split()
    numbers = _parsed(words[: layout.numbers]) if len(words) >= layout.numbers else None
    if numbers is None:
        words = _NUMBER.findall(body)
        numbers = _parsed(words[: layout.numbers])
        between = _NUMBER.sub(b" ", body).split()
        if between or numbers is None:
            strange = (between or words)[0]
            word = next(word for word in body.split() if strange in word)
            raise LogError(f"has {word[:20].decode('latin-1')!r} where a number is due")
    if len(numbers) < layout.numbers:
        count = len(numbers) // (layout.numbers // layout.count)
        raise LogError(f"announces {layout.count} values and holds {count}; it's cut short")
    x, data = layout.arranged(numbers)
    spare = len(words) - layout.numbers
    notes = [f"holds {spare} numbers more than it announces, which were left out"] if spare else []
    odd = layout.odd_lines(body)
    if odd:
        told = f"{counted(odd, 'line')} of values shorter or longer than the columns of the format"
        notes.append(f"has {told}; it's damaged, and numbers there may be wrong: export it again")
    return Values(x=x, data=data, notes=tuple(notes))


def _parsed(words: list[bytes]) -> Real | None:
    """The numbers of all words; None when one is none."""
    try:
        return np.array([fortran_number(word.decode("latin-1")) for word in words], dtype=np.float64)
    except ValueError:
        return None


# --- binary ------------------------------------------------------------------------------------------------------


def binary_values(raw: bytes, layout: Layout, *, byte_order: int, number_format: int) -> Values:
    """Read binary values in the number format that the header states.

    Where the header leaves it open, and where values in the stated format can't be measured ones, the format is taken
    in which alone they can be, and told.

    Parameters
    ----------
    raw
        As many bytes as `Layout.binary_sizes` has.
    byte_order
        1 little endian, 2 big endian; else the header doesn't say.
    number_format
        1 DEC, 2 IEEE 754, 3 IBM System/370; else the header doesn't say.

    Raises
    ------
    LogError
        When the values don't tell an open format, or in DEC's double precision, of which there are two.

    Notes
    -----
    A number in a wrong format has bits of a mantissa for its exponent: numbers span all magnitudes there are, or are
    denormal. Formats: VAX Architecture Reference Manual (F floating), IBM System/370 Principles of Operation.
    """
    rows = np.frombuffer(raw, dtype=np.uint8).reshape(layout.count, -1)
    head = rows.shape[1] - layout.parts * layout.width
    stated = _stated(byte_order, number_format)
    if stated == ("DEC",) and layout.width == _DOUBLE:
        raise LogError("holds double precision of DEC, which is D or G floating; export it as text (58)")
    readings = {name: _reading(rows, head, layout, name) for name in stated}
    likely = [name for name, reading in readings.items() if reading.believable]
    if not likely:
        # What the header states is doubted only where it can't be.
        readings |= {name: _reading(rows, head, layout, name) for name in _FORMATS if name not in stated}
        likely = [name for name, reading in readings.items() if reading.believable]
    if len(likely) == 1:
        (name,) = likely
    elif len(stated) == 1 and not likely:
        # Values that are no numbers can't be measured in any format.
        (name,) = stated
    else:
        raise LogError(f"{_said(stated)}; they may be {' or '.join(likely) or 'in none known here'}; {_REMEDY}")
    told = () if stated == (name,) else (f"{_said(stated)}; they were read as {name}, in which alone they can be",)
    return replace(readings[name].values, notes=told)


def _stated(byte_order: int, number_format: int) -> tuple[str, ...]:
    """The formats that a header leaves open."""
    orders = {_LITTLE: (_IEEE_LITTLE,), _BIG: (_IEEE_BIG,)}
    if number_format == _IEEE:
        return orders.get(byte_order, (_IEEE_LITTLE, _IEEE_BIG))
    if number_format in (_DEC, _IBM):
        return ("DEC",) if number_format == _DEC else ("IBM",)
    # DEC's machines were little endian, IBM's big endian.
    return {_LITTLE: (_IEEE_LITTLE, "DEC"), _BIG: (_IEEE_BIG, "IBM")}.get(byte_order, tuple(_FORMATS))


def _said(stated: tuple[str, ...]) -> str:
    if len(stated) == 1:
        return f"states {stated[0]} numbers, in which its binary values can't be measured ones"
    return "doesn't state the number format of its binary values"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Reading:
    values: Values
    believable: bool


def _reading(rows: Bytes, head: int, layout: Layout, name: str) -> _Reading:
    numbers, clean = _decoded(rows[:, head:], layout.width, name)
    x, clean_x = _decoded(rows[:, :head], head, name) if head else (None, True)
    data = layout.joined(numbers.reshape(layout.count, layout.parts))
    believable = clean and clean_x and _measured(numbers) and (x is None or _measured(x))
    return _Reading(values=Values(x=x, data=data), believable=believable)


def _decoded(columns: Bytes, width: int, name: str) -> tuple[Real, bool]:
    """The numbers in columns of bytes, and whether each is one that the format's machines make."""
    raw = np.ascontiguousarray(columns).reshape(-1, width)
    # Damaged values may be anything; what isn't finite is for the reader to mask.
    with np.errstate(all="ignore"):
        return _FORMATS[name](raw)


def _ieee(order: str) -> Callable[[Bytes], tuple[Real, bool]]:
    def decoded(raw: Bytes) -> tuple[Real, bool]:
        single = raw.view(f"{order}f{raw.shape[1]}")
        numbers = single[:, 0].astype(np.float64)
        smallest = float(np.finfo(single.dtype).smallest_normal)
        return numbers, not bool(np.any((numbers != 0) & (np.abs(numbers) < smallest)))

    return decoded


def _dec(raw: Bytes) -> tuple[Real, bool]:
    """F floating: sign, 8 bits of an exponent of 2 over 128, 23 of a fraction behind a hidden 0.1; words swapped."""
    if raw.shape[1] == _DOUBLE:
        return np.full(len(raw), np.nan), False
    words = raw.view("<u2").astype(np.int64)
    bits = (words[:, 0] << 16) | words[:, 1]
    exponent, fraction = (bits >> 23) & 0xFF, bits & 0x7FFFFF
    magnitude = np.ldexp((fraction | 0x800000).astype(np.float64), exponent - 128 - 24)
    numbers = np.where(bits >> 31, -magnitude, magnitude)
    # Without an exponent it's zero, with a sign a reserved operand.
    numbers = np.where(exponent == 0, np.where(bits >> 31, np.nan, 0.0), numbers)
    return numbers, not bool(np.any((exponent == 0) & (bits != 0)))


def _ibm(raw: Bytes) -> tuple[Real, bool]:
    """Sign, 7 bits of an exponent of 16 over 64, the rest a fraction whose first digit isn't 0."""
    digits = 8 * (raw.shape[1] - 1)
    bits = raw.view(f">u{raw.shape[1]}")[:, 0].astype(np.uint64)
    fraction = bits & np.uint64((1 << digits) - 1)
    exponent = ((bits >> np.uint64(digits)) & np.uint64(0x7F)).astype(np.int64)
    magnitude = np.ldexp(fraction.astype(np.float64), 4 * (exponent - 64) - digits)
    numbers = np.where(bits >> np.uint64(digits + 7), -magnitude, magnitude)
    return numbers, not bool(np.any((fraction >> np.uint64(digits - 4) == 0) & (bits != 0)))


_FORMATS: dict[str, Callable[[Bytes], tuple[Real, bool]]] = {
    _IEEE_LITTLE: _ieee("<"),
    _IEEE_BIG: _ieee(">"),
    "DEC": _dec,
    "IBM": _ibm,
}


def _measured(numbers: Real) -> bool:
    """Whether numbers can be measured values: finite, and none farther above the others than a converter reaches."""
    sizes = np.abs(numbers[numbers != 0])
    if not np.isfinite(sizes).all():
        return False
    return sizes.size == 0 or bool(sizes.max() <= _WIDEST_SPAN * np.median(sizes))

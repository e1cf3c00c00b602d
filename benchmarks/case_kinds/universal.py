"""Universal files written by hand: datasets 58 and 58b, with whatever a vendor puts into their fields."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pyuff

TIME, FREQUENCY_RESPONSE = 1, 4
UNKNOWN, DISPLACEMENT, VELOCITY, ACCELERATION, FORCE, OF_TIME, OF_FREQUENCY = 0, 8, 11, 12, 13, 17, 18
"""Specific data types of a universal file, records 8 to 10."""
Encoder = Callable[[np.ndarray], bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Function:
    """One dataset 58, field by field; `step` and `label` are as written, right or wrong."""

    values: np.ndarray
    function_type: int = TIME
    step: float = 0.005
    abscissa_type: int = OF_TIME
    abscissa_label: str = "s"
    ordinate_type: int = ACCELERATION
    ordinate_label: str = "m/s2"
    denominator_type: int = UNKNOWN
    denominator_label: str = "NONE"
    response: tuple[int, int] = (1, 1)
    reference: tuple[int, int] = (0, 0)
    double: bool = False
    abscissa: np.ndarray | None = None

    @property
    def numbers(self) -> np.ndarray:
        """Reals as they stand in the file, one after another."""
        if np.iscomplexobj(self.values):
            return np.column_stack([self.values.real, self.values.imag]).ravel()
        return self.values


def _head(function: Function) -> list[str]:
    kind = 2 + 2 * function.double + (3 - function.double) * np.iscomplexobj(function.values)
    assert kind in (2, 4, 5, 6)
    ends = (function.response, function.reference)
    rows = [
        (function.abscissa_type, "Frequency" if function.abscissa_type == OF_FREQUENCY else "Time",
         function.abscissa_label),
        (function.ordinate_type, "Ord", function.ordinate_label),
        (function.denominator_type, "NONE", function.denominator_label),
        (0, "NONE", "NONE"),
    ]  # fmt: skip
    even, step = (1, function.step) if function.abscissa is None else (0, 0.0)
    return [
        *["NONE"] * 5,
        f"{function.function_type:5d}{0:10d}{0:5d}{0:10d}" + "".join(f" {'NONE':<10}{a:10d}{b:4d}" for a, b in ends),
        f"{kind:10d}{function.values.size:10d}{even:10d}{0.0:13.5e}{step:13.5e}{0.0:13.5e}",
        *(f"{code:10d}{0:5d}{0:5d}{0:5d} {name:<20} {label:<20}" for code, name, label in rows),
    ]


def e_notation(number: float, width: int, digits: int) -> str:
    """Write a number as C and Python do."""
    return f"{number:{width}.{digits}e}"


def text_dataset(function: Function, number: Callable[[float, int, int], str] = e_notation) -> bytes:
    """Write a dataset 58 as text."""
    width, digits, a_line = (20, 12, 4) if function.double else (13, 5, 6)
    numbers = function.numbers
    if function.abscissa is not None:
        numbers, a_line = np.column_stack([function.abscissa, function.values]).ravel(), 6
    cells = [number(float(each), width, digits) for each in numbers]
    data = ["".join(cells[at : at + a_line]) for at in range(0, len(cells), a_line)]
    head = [f"{line:<80}" for line in ("    -1", "    58", *_head(function))]
    # Labels are written in latin-1, as instruments of the day did.
    return "".join(f"{line}\n" for line in (*head, *data, f"{'    -1':<80}")).encode("latin-1")


def ieee(function: Function, order: Literal["<", ">"]) -> Encoder:
    """Encode IEEE numbers, single or double as the function says."""
    return lambda numbers: numbers.astype(f"{order}f{8 if function.double else 4}").tobytes()


def binary_dataset(
    function: Function, order: int, form: int, encode: Encoder, *, byte_count: int | None = None
) -> bytes:
    """Write a dataset 58b: byte order 1 little, 2 big; format 1 DEC VMS, 2 IEEE 754, 3 IBM 5/370."""
    data = encode(function.numbers)
    size = len(data) if byte_count is None else byte_count
    top = f"{'58':>6}b{order:6d}{form:6d}{11:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    lines = ["    -1", top, *_head(function)]
    return b"".join(f"{line:<80}\n".encode("latin-1") for line in lines) + data + f"\n{'    -1':<80}\n".encode()


def vax_f(numbers: np.ndarray) -> bytes:
    """Encode VAX F floating: sign, 8-bit exponent of excess 128, 23 bits after a hidden 0.1; words swapped."""
    words = b""
    for number in numbers:
        fraction, exponent = np.frexp(abs(float(number)))
        bits = 0
        if number:
            bits = (int(number < 0) << 31) | (int(exponent + 128) << 23) | (round(float(fraction) * 2**24) & 0x7FFFFF)
        words += struct.pack("<HH", bits >> 16, bits & 0xFFFF)
    return words


def from_vax_f(data: bytes) -> np.ndarray:
    """Decode VAX F by its definition (VAX Architecture Reference Manual), for the check of `vax_f`."""
    high, low = np.frombuffer(data, "<u2").reshape(-1, 2).T.astype(np.int64)
    exponent, fraction = (high >> 7) & 0xFF, ((high & 0x7F) << 16) | low
    size = (0.5 + fraction / 2.0**24) * 2.0 ** (exponent - 128)
    return np.where(exponent == 0, 0.0, np.where(high >> 15, -size, size))


def ibm(numbers: np.ndarray) -> bytes:
    """Encode IBM hexadecimal single: sign, 7-bit exponent of 16 with excess 64, 24-bit fraction, big endian."""
    words = b""
    for number in numbers:
        size, exponent = abs(float(number)), 64
        while size >= 1:
            size, exponent = size / 16, exponent + 1
        while 0 < size < 1 / 16:
            size, exponent = size * 16, exponent - 1
        fraction = min(round(size * 2**24), 2**24 - 1)
        words += struct.pack(">I", (int(number < 0) << 31) | (exponent << 24) | fraction if number else 0)
    return words


def from_ibm(data: bytes) -> np.ndarray:
    """Decode IBM hexadecimal single (IBM System/370 Principles of Operation), for the check of `ibm`."""
    bits = np.frombuffer(data, ">u4").astype(np.int64)
    size = (bits & 0xFFFFFF) / 2.0**24 * 16.0 ** (((bits >> 24) & 0x7F) - 64)
    return np.where(bits >> 31, -size, size)


def write_sets(path: Path, *datasets: bytes) -> Path:
    """Write datasets one after another."""
    path.write_bytes(b"".join(datasets))
    return path


def assert_reads(path: Path, functions: Sequence[Function]) -> None:
    """The `pyuff` library reads what was written."""
    sets = pyuff.UFF(str(path)).read_sets()
    found = sets if isinstance(sets, list) else [sets]
    assert len(found) == len(functions)
    for each, function in zip(found, functions, strict=True):
        scale = float(np.max(np.abs(function.values)))
        assert np.allclose(each["data"], function.values, rtol=0, atol=2e-5 * scale)
        assert (each["rsp_node"], each["ref_node"]) == (function.response[0], function.reference[0])


def response_functions(values: Sequence[np.ndarray], step: float, **fields: object) -> list[Function]:
    """Accelerances at points 1, 2, ... over a force at point 1, in direction +z."""
    common = Function(
        values=values[0], function_type=FREQUENCY_RESPONSE, step=step, abscissa_type=OF_FREQUENCY,
        abscissa_label="Hz", denominator_type=FORCE, reference=(1, 3), double=True,
    )  # fmt: skip
    made = [replace(common, values=each, response=(point, 3)) for point, each in enumerate(values, start=1)]
    return [replace(each, **fields) for each in made]  # type: ignore[arg-type]

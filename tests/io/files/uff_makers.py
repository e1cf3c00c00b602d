"""Functions of universal files, written byte by byte after the format's description, and numbers of old machines."""

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: Width of the columns of values by ordinate type.
WIDTHS = {2: 13, 4: 20, 5: 13, 6: 20}


def function_set(
    values: Sequence[complex] | NDArray[np.complexfloating] | NDArray[np.floating], **fields: object
) -> bytes:
    """A dataset 58 as text, or 58b where `raw` holds the bytes of its values."""
    given = {
        "id1": "acc", "id5": "NONE", "kind": 1, "node": 3, "dir": 1, "ref_node": 0, "ref_dir": 0, "form": 2,
        "count": len(values), "even": 1, "least": 0.0, "step": 5e-3, "x_type": 17, "x_axis": "NONE", "x_label": "s",
        "type": 12, "powers": (0, 0), "axis": "NONE", "label": "m/s^2", "below_type": 0, "below": "NONE", "raw": None,
        "order": 1, "format": 2, "bytes": None, "exponent": "e", "newline": b"\n", "before_end": b"",
    } | fields  # fmt: skip
    lines = [given["id1"], "NONE", "NONE", "NONE", given["id5"]]
    response = f"{'NONE':10s}{given['node']:10d}{given['dir']:4d}"
    reference = f"{'NONE':10s}{given['ref_node']:10d}{given['ref_dir']:4d}"
    form = f"{given['form']:10d}{given['count']:10d}{given['even']:10d}"
    lines += [
        f"{given['kind']:5d}{0:10d}{0:5d}{0:10d} {response} {reference}",
        f"{form}{given['least']:13.5e}{given['step']:13.5e}{0:13.5e}",
        _axis(given["x_type"], (0, 0), given["x_axis"], given["x_label"]),
        _axis(given["type"], given["powers"], given["axis"], given["label"]),
        _axis(given["below_type"], (0, 0), "NONE", given["below"]),
        _axis(0, (0, 0), "NONE", "NONE"),
    ]
    header = b"".join(_encoded(f"{line:80s}") + given["newline"] for line in lines)
    opening, closing = b"    -1" + given["newline"], b"    -1" + given["newline"]
    raw = given["raw"]
    if raw is None:
        text = _text(values, int(given["form"])).replace("e", str(given["exponent"])).encode()
        return opening + b"    58" + given["newline"] + header + text + closing
    size = len(raw) if given["bytes"] is None else given["bytes"]
    kind = f"    58b{given['order']:6d}{given['format']:6d}{11:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}".encode()
    return opening + kind + given["newline"] + header + raw + given["before_end"] + closing


def response_set(values: NDArray[np.complexfloating], **fields: object) -> bytes:
    """A frequency response in text, lines 1 Hz apart."""
    given = {
        "kind": 4, "form": 6, "step": 1.0, "x_type": 18, "x_label": "Hz", "dir": 3, "node": 1, "ref_node": 1,
        "ref_dir": 3, "below_type": 13,
    }  # fmt: skip
    return function_set(values, **(given | fields))


def units_set(length: float, force: float, *, code: int = 9, description: str = "own units") -> bytes:
    """A dataset 164."""
    head = f"    -1\n   164\n{code:10d}{description:20s}{1:10d}\n"
    return (head + f"{length:25.16e}{force:25.16e}{1:25.16e}\n{0:25.16e}\n    -1\n".replace("e", "D")).encode()


def vax_f(values: Sequence[float] | NDArray[np.floating]) -> bytes:
    """F floating: value = (-1)^s 0.1f 2^(e - 128), 16-bit words with the low byte first, the high word first."""
    raw = b""
    for value in values:
        mantissa, exponent = np.frexp(abs(float(value)))
        digits = round(float(mantissa) * 2**24)
        bits = 0 if value == 0 else (int(value < 0) << 31) | ((int(exponent) + 128) << 23) | (digits & 0x7FFFFF)
        raw += struct.pack("<HH", bits >> 16, bits & 0xFFFF)
    return raw


def ibm(values: Sequence[float] | NDArray[np.floating], digits: int = 6) -> bytes:
    """System/370: value = (-1)^s 0.f 16^(e - 64), big endian, six or fourteen hexadecimal digits."""
    raw = b""
    for value in values:
        exponent, mantissa = 0, abs(float(value))
        while mantissa >= 1:
            mantissa, exponent = mantissa / 16, exponent + 1
        while 0 < mantissa < 1 / 16:
            mantissa, exponent = mantissa * 16, exponent - 1
        lead = 0 if value == 0 else (int(value < 0) << 7) | (exponent + 64)
        raw += bytes([lead]) + int(mantissa * 16**digits).to_bytes(digits // 2, "big")
    return raw


def _axis(kind: object, powers: object, name: object, label: object) -> str:
    length, force = powers  # type: ignore[misc]
    return f"{kind:10d}{length:5d}{force:5d}{0:5d} {name:20s} {label:20s}"


def _encoded(line: str) -> bytes:
    # Surrogates carry single bytes, such as those of Latin-1, through text.
    return line.encode("utf-8", "surrogateescape")


def _text(values: object, form: int) -> str:
    numbers = [part for value in values for part in ([value.real, value.imag] if form > 4 else [value])]  # type: ignore[attr-defined]
    width, a_line = WIDTHS[form], 6 if WIDTHS[form] == 13 else 4
    cells = [f"{number:{width}.{5 if width == 13 else 11}e}" for number in numbers]
    return "".join("".join(cells[first : first + a_line]) + "\n" for first in range(0, len(cells), a_line))

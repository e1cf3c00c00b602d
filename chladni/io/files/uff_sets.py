"""The door to universal files that all their readers and writers go through: headers and values of functions, units.

They are read here, because the size of binary values, their number format, and text that isn't UTF-8 have to be taken
from the header; pyuff, which takes every line of -1 for the end of a dataset, writes them.
"""

import os
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chladni.io.atomic import atomic_path, scratch_path
from chladni.io.files.uff_records import UniversalFile
from chladni.io.files.uff_values import Layout, Values, binary_values, fortran_number, layout_of, text_values
from chladni.signals.errors import LogError
from chladni.signals.text_reading import whole_number

if TYPE_CHECKING:
    import pyuff

Dataset = dict[str, Any]

FUNCTION_AT_NODE = 58
UNITS = 164
HEADER = 151
LEFT_OUT = "; it was left out."
"""How a sentence ends on a dataset that can't be read."""
# Name and width, or where it begins, of each field of the lines 6 to 11 (Fortran formats of the specification); a
# leading blank counts to the text behind it.
_PLACE = (
    ("func_type", 5), ("func_id", 10), ("ver_num", 5), ("load_case_id", 10), ("rsp_ent_name", 11), ("rsp_node", 10),
    ("rsp_dir", 4), ("ref_ent_name", 11), ("ref_node", 10), ("ref_dir", 4),
)  # fmt: skip
_FORM = (("ord_data_type", 10), ("num_pts", 10), ("abscissa_spacing", 10))
_REAL_WIDTH = 13
_FORM_REALS = (("abscissa_min", 30), ("abscissa_inc", 43), ("z_axis_value", 56))
_AXIS_FIELDS = (
    ("spec_data_type", 10), ("len_unit_exp", 5), ("force_unit_exp", 5), ("temp_unit_exp", 5), ("axis_lab", 21),
    ("axis_units_lab", 21),
)  # fmt: skip
_AXES = ("abscissa", "ordinate", "orddenom", "z_axis")
_BINARY_FIELDS = (("byte_ordering", 6), ("fp_format", 6), ("n_ascii_lines", 12), ("n_bytes", 12))
_TEXTS = frozenset(["rsp_ent_name", "ref_ent_name", "axis_lab", "axis_units_lab"])
# Factors to SI by units code: metre and newton in the file's units (I-deas universal dataset 164).
_FOOT, _INCH, _POUND_FORCE, _POUNDAL, _KILOGRAM_FORCE = 0.3048, 0.0254, 4.4482216152605, 0.138254954376, 9.80665
_SYSTEMS = {
    1: ("SI", 1.0, 1.0),
    2: ("foot and pound-force", 1 / _FOOT, 1 / _POUND_FORCE),
    3: ("metre and kilogram-force", 1.0, 1 / _KILOGRAM_FORCE),
    4: ("foot and poundal", 1 / _FOOT, 1 / _POUNDAL),
    5: ("mm and mN", 1e3, 1e3),
    6: ("cm and cN", 1e2, 1e2),
    7: ("inch and pound-force", 1 / _INCH, 1 / _POUND_FORCE),
    8: ("mm and kilogram-force", 1e3, 1 / _KILOGRAM_FORCE),
}
# Writers round the factors, some to four digits.
_SAME_FACTOR = 1e-3
_LEAST_FACTOR = 1e-30
# Far above any time or frequency: the last of the abscissae must not overflow.
_LARGEST = 1e100


def cut_off_note(file: UniversalFile) -> tuple[str, ...]:
    """Say so when the file ends anywhere but behind a dataset."""
    tail = file.content[-4096:].rstrip(b" \t\r\n\0\x1a")
    # Behind binary values the closing line begins without a line break.
    if tail.endswith(b"    -1") or tail.rpartition(b"\n")[2].strip() == b"-1":
        return ()
    note = (
        f"{file.path}: doesn't end with the line -1 that closes a dataset; it was cut off, and what stands after the "
        "last whole dataset is lost."
    )
    return (note,)


def read_headers(file: UniversalFile) -> list[Dataset]:
    """Read what each dataset says of itself: its type, the header of a function, the factors of dataset 164.

    Each function has the units that hold for it under ``system``: the last dataset 164 before it, else the first of
    the file, else None. What can't be read is said under ``mistake``.
    """
    headers: list[Dataset] = []
    for number, span in enumerate(file.spans):
        header: Dataset = {"type": span.kind}
        try:
            if span.kind == FUNCTION_AT_NODE:
                header |= _function_header(file.header(number), binary=span.binary)
            elif span.kind == UNITS:
                header |= _units(file.header(number))
        except LogError as error:
            header["mistake"] = f"{file.path}: dataset {number + 1} (type {span.kind}) can't be read: {error}"
        headers.append(header)
    systems = [header for header in headers if header["type"] == UNITS]
    system = systems[0] if systems else None
    for header in headers:
        system = header if header["type"] == UNITS else system
        header["system"] = system
    return headers


def read_dataset(file: UniversalFile, headers: Sequence[Dataset], number: int) -> tuple[Dataset, tuple[str, ...]]:
    """Read one function with its values under ``data`` and ``x``, and give sentences on how they were read.

    Raises
    ------
    LogError
        When the header or the values can't be read, or aren't there.
    """
    header = headers[number]
    if "mistake" in header:
        raise LogError(header["mistake"])
    where = f"{file.path}: dataset {number + 1}"
    size = len(file.content)
    layout = layout_of(header["ord_data_type"], header["num_pts"], even=header["abscissa_spacing"] != 0)
    # The abscissa is built from the announced count, so that it must be believable.
    if layout is None or not layout.numbers <= size:
        raise LogError(
            f"{where} announces {header['num_pts']} values of type {header['ord_data_type']}, which a file of "
            f"{size} bytes doesn't hold"
        )
    try:
        values = _values(file.values(number), header, layout)
    except LogError as error:
        raise LogError(f"{where} {error}") from error
    x = values.x
    if x is None:
        x = header["abscissa_min"] + np.arange(layout.count) * header["abscissa_inc"]
    return {**header, "data": values.data, "x": x}, tuple(f"{where} {note}." for note in values.notes)


def listed_kinds(headers: Iterable[Dataset]) -> str:
    """List datasets by number, with their count."""
    kinds = Counter(header["type"] for header in headers)
    return ", ".join(f"{kind} ({count})" for kind, count in sorted(kinds.items()))


# --- units -------------------------------------------------------------------------------------------------------


def length_and_force(system: Dataset | None) -> tuple[float, float]:
    """By what lengths and forces of a file are divided to get metres and newtons, from dataset 164; 1 without."""
    if system is None:
        return 1.0, 1.0
    if "mistake" in system:
        raise LogError(system["mistake"])
    return system["length"], system["force"]


def contradiction(system: Dataset | None) -> str | None:
    """Say how the units code of dataset 164 contradicts its factors; None when it doesn't."""
    if system is None or "mistake" in system or system["units_code"] not in _SYSTEMS:
        return None
    name, *expected = _SYSTEMS[system["units_code"]]
    factors = (system["length"], system["force"])
    if all(abs(one / other - 1) <= _SAME_FACTOR for one, other in zip(factors, expected, strict=True)):
        return None
    return (
        f"dataset 164 names {name} (units code {system['units_code']}), but divides lengths by {factors[0]:g} and "
        f"forces by {factors[1]:g}"
    )


def _units(lines: list[str]) -> Dataset:
    words = " ".join(lines[2:]).split()
    try:
        length, force = fortran_number(words[0]), fortran_number(words[1])
        code = whole_number((lines[1] if len(lines) > 1 else "")[:10])
    except (ValueError, IndexError):
        raise LogError("its lines aren't a units code and factors of length and force") from None
    if not all(isfinite(one) and _LEAST_FACTOR < one < 1 / _LEAST_FACTOR for one in (length, force)):
        raise LogError(f"dataset 164 has the factors {length:g} and {force:g} for length and force, which are none")
    return {"units_code": code, "length": length, "force": force}


# --- functions ---------------------------------------------------------------------------------------------------


def _function_header(lines: list[str], *, binary: bool) -> Dataset:
    lines = lines + [""] * (12 - len(lines))
    header: Dataset = {"binary": int(binary)}
    header |= {f"id{number}": lines[number].strip() for number in range(1, 6)}
    header |= _fields(lines[6], _PLACE) | _fields(lines[7], _FORM, least=3)
    header |= {name: _real(lines[7][start : start + _REAL_WIDTH], name) for name, start in _FORM_REALS}
    for axis, line in zip(_AXES, lines[8:], strict=True):
        header |= {f"{axis}_{name}": field for name, field in _fields(line, _AXIS_FIELDS).items()}
    return header | _fields(lines[0][7:], _BINARY_FIELDS) if binary else header


def _fields(line: str, columns: Sequence[tuple[str, int]], *, least: int = 0) -> Dataset:
    """Texts and integers in fixed columns; what is blank is 0, but among the first `least`."""
    fields: Dataset = {}
    start = 0
    for place, (name, width) in enumerate(columns):
        text = line[start : start + width].strip()
        start += width
        fields[name] = text if name in _TEXTS else _integer(text, name, blank=place >= least)
    return fields


def _integer(text: str, name: str, *, blank: bool) -> int:
    if not text and blank:
        return 0
    try:
        return whole_number(text)
    except ValueError:
        raise LogError(f"found {text[:20]!r} where an integer is due ({name})") from None


def _real(field: str, name: str) -> float:
    text = field.strip()
    try:
        number = fortran_number(text) if text else 0.0
    except ValueError:
        number = nan
    if not abs(number) < _LARGEST:
        raise LogError(f"found {text[:20]!r} where a number is due ({name})")
    return number


def _values(raw: bytes, header: Dataset, layout: Layout) -> Values:
    if not header["binary"]:
        return text_values(raw, layout)
    sizes = layout.binary_sizes()
    raw, notes = _without_line_breaks(raw, sizes)
    # Padding behind the last value isn't one.
    size = len(raw) if len(raw) in sizes else header["n_bytes"] if header["n_bytes"] in sizes else sizes[0]
    if len(raw) < size:
        count = len(raw) * layout.count // size
        raise LogError(
            f"announces {layout.count} values and holds {count}; it's cut short, or changed by a text-mode transfer"
        )
    values = binary_values(raw[:size], layout, byte_order=header["byte_ordering"], number_format=header["fp_format"])
    return replace(values, notes=notes + values.notes)


def _without_line_breaks(raw: bytes, sizes: tuple[int, ...]) -> tuple[bytes, tuple[str, ...]]:
    """Undo a transfer in text mode, which made CR LF of each LF: then no LF stands alone, and the size tells."""
    if len(raw) in sizes or raw.count(b"\n") != raw.count(b"\r\n"):
        return raw, ()
    undone = raw.replace(b"\r\n", b"\n")
    if len(undone) not in sizes:
        return raw, ()
    return undone, (
        "was changed by a text-mode transfer; the line breaks that it put into the values were taken out",
    )


# --- writing -----------------------------------------------------------------------------------------------------


def si_units() -> Dataset:
    """Dataset 164 that says SI."""
    return {
        "type": UNITS,
        "units_code": 1,
        "units_description": "SI",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 0.0,
    }


def write_datasets(path: Path | str, datasets: list[Dataset], *, overwrite: bool) -> None:
    """Write a file of datasets that appears whole, or not at all."""
    with atomic_path(path, overwrite=overwrite) as temporary:
        append_datasets(temporary, datasets)


def append_datasets(path: Path, datasets: list[Dataset]) -> None:
    """Write datasets behind what `path` holds, if there is anything."""
    import pyuff

    # Beside the file: its disk is the one that must have room, whatever TMPDIR says.
    with scratch_path(path) as one, path.open("ab") as whole, warnings.catch_warnings():
        # Pyuff leaves closing its second handle to the interpreter, which does it before the call returns.
        warnings.simplefilter("ignore", ResourceWarning)
        # Pyuff reads a file again before each dataset that it adds: thousands of them go through small files.
        for dataset in datasets:
            os.truncate(one, 0)
            _write_one(pyuff.UFF(str(one)), dataset)
            whole.write(one.read_bytes())


def _write_one(file: "pyuff.UFF", dataset: Dataset) -> None:
    try:
        file.write_sets(dataset, mode="add")
    # No narrower: pyuff raises `Exception`, behind which it hides what the operating system says, and signals.
    except Exception as error:
        if isinstance(error.__context__, (OSError, KeyboardInterrupt, SystemExit)):
            raise error.__context__ from None
        raise

"""The door to universal files that all their readers and writers go through: datasets by pyuff, checked."""

import tempfile
import warnings
from pathlib import Path
from typing import Any

from chladni.io.atomic import atomic_path
from chladni.signals.errors import LogError

Dataset = dict[str, Any]

FUNCTION_AT_NODE = 58
UNITS = 164
# Fewest characters or bytes that a value of each ordinate type takes in a file: single, double, complex.
_LEAST_BYTES = {2: 4, 4: 8, 5: 8, 6: 16}
# Enough for a last line and the blanks or zeros behind it.
_TAIL_BYTES = 4096


def open_uff(path: Path) -> Any:
    """Open a universal file with pyuff; `LogError` when there is none, or none that it can read."""
    import pyuff

    if not path.is_file():
        raise LogError(f"{path}: no such file")
    try:
        return pyuff.UFF(str(path))
    except Exception as error:  # pyuff raises nothing more specific
        raise LogError(f"{path}: this universal file can't be read: {error}") from error


def cut_off_note(path: Path) -> tuple[str, ...]:
    """Say so when the file ends anywhere but behind a dataset; pyuff passes over what isn't closed."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _TAIL_BYTES))
        tail = file.read().rstrip(b" \t\r\n\0\x1a")
    # Behind binary values the closing line begins without a line break.
    if tail.endswith(b"    -1") or tail.rpartition(b"\n")[2].strip() == b"-1":
        return ()
    note = (
        f"{path}: doesn't end with the line -1 that closes a dataset; it was cut off, and what stands after the last "
        "whole dataset is lost."
    )
    return (note,)


def read_headers(path: Path, file: Any) -> list[Dataset]:
    """Read what is in front of the data, and check that the data it announces are there."""
    count = int(file.get_n_sets())
    if count == 0:
        raise LogError(
            f"{path}: holds no whole dataset between lines of -1; is it a universal file, or was it cut off?"
        )
    headers = []
    for number, kind in enumerate(file.get_set_types()):
        if kind not in (FUNCTION_AT_NODE, UNITS):
            headers.append({"type": int(kind)})
            continue
        try:
            headers.append(dict(file.read_sets(number, header_only=True)))
        except Exception as error:  # pyuff raises nothing more specific
            raise LogError(f"{path}: dataset {number + 1} (type {kind}) can't be read: {error}") from error
    # Pyuff builds the abscissa from the announced count, so it must be believable before the values are read.
    size = path.stat().st_size
    for number, header in enumerate(headers):
        least = _LEAST_BYTES.get(header.get("ord_data_type", 0), 0) * header.get("num_pts", 0)
        if header["type"] == FUNCTION_AT_NODE and not 0 < least <= size:
            raise LogError(
                f"{path}: dataset {number + 1} announces {header.get('num_pts')} values of type "
                f"{header.get('ord_data_type')}, which a file of {size} bytes doesn't hold"
            )
    return headers


def read_dataset(path: Path, file: Any, number: int) -> Dataset:
    """Read one function with its values, as many as it announces; `LogError` when they aren't there."""
    try:
        dataset = dict(file.read_sets(number))
    except Exception as error:  # pyuff raises nothing more specific
        raise LogError(
            f"{path}: the values of dataset {number + 1} can't be read: {error}; binary files of some exporters hold "
            "line breaks inside the data: export as text (58) or convert with pyuff.fix_58b"
        ) from error
    found, announced = len(dataset["data"]), dataset["num_pts"]
    if found < announced:
        raise LogError(f"{path}: dataset {number + 1} announces {announced} values and holds {found}; it's cut short")
    # Padding behind the last binary value would otherwise count as samples.
    dataset["data"], dataset["x"] = dataset["data"][:announced], dataset["x"][:announced]
    return dataset


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

    with tempfile.TemporaryDirectory() as folder, path.open("ab") as whole, warnings.catch_warnings():
        # Pyuff leaves closing its second handle to the interpreter, which does it before the call returns.
        warnings.simplefilter("ignore", ResourceWarning)
        # Pyuff reads a file again before each dataset that it adds: thousands of them go through small files.
        part = Path(folder) / "part.uff"
        for dataset in datasets:
            pyuff.UFF(str(part)).write_sets(dataset, mode="add")
            whole.write(part.read_bytes())
            part.unlink()

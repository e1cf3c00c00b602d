"""Values as tables: to pandas, to xarray, to CSV."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_write
from chladni.io.files.csv import write_csv
from chladni.signals.errors import SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value
from chladni.signals.visible import cell_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Column:
    """A column of a table: its name, the unit of its numbers (empty where they have none), and the numbers."""

    name: str
    unit: str
    numbers: NDArray[Any]


def to_pandas(value: Value) -> "pd.DataFrame":
    """Give a value as a data frame; see `Value.to_pandas`."""
    try:
        import pandas as pd
    except ImportError as error:
        raise SetupError("to_pandas needs pandas; install chladni[pandas]") from error
    columns = list(_columns(value))
    frame = pd.DataFrame(
        {one.name: one.numbers for one in columns}, index=pd.Index(value.coordinate(value.ROWS), name=value.ROWS)
    )
    frame.attrs["units"] = {one.name: one.unit for one in columns}
    return frame


def to_xarray(value: Value) -> "xr.Dataset":
    """Give a value as a dataset; see `Value.to_xarray`."""
    try:
        import xarray as xr
    except ImportError as error:
        raise SetupError("to_xarray needs xarray; install chladni[xarray]") from error
    _require_axes(value)
    dimensions = dict.fromkeys(one for axes in value.AXES.values() for one in axes)
    found = xr.Dataset(
        {_variable(name, dimensions): (axes, getattr(value, name)) for name, axes in value.AXES.items()},
        coords={one: np.asarray(value.coordinate(one)) for one in dimensions},
    )
    for name, axes in value.AXES.items():
        units = {value.unit_at(name, place) for place in _places(value, axes)}
        # A dataset has one unit for a variable; where channels differ, each says its own.
        if len(units) == 1:
            found[_variable(name, dimensions)].attrs["units"] = units.pop()
    return found


def to_csv(value: Value, path: Path | str) -> None:
    """Write a value as a table; see `Value.to_csv`."""
    if isinstance(value, TimeSeries):
        # As logs are converted: with the start of its clock, and read again by `chladni.open`.
        write_csv(value, path)
        return
    columns = [*_row_units(value), *(real for one in _columns(value) for real in _real(one))]
    rows = value.coordinate(value.ROWS)
    titles = [value.ROWS, *(f"{one.name} [{one.unit}]" if one.unit else one.name for one in columns)]
    with atomic_write(path) as file:
        text = io.TextIOWrapper(file, encoding="utf-8", newline="")
        writer = csv.writer(text)
        # Names come from files that others wrote.
        writer.writerow(map(cell_text, titles))
        writer.writerows(zip(map(_cell, rows), *(map(_cell, one.numbers.tolist()) for one in columns), strict=True))
        text.flush()
        text.detach()


def _columns(value: Value) -> Iterator[_Column]:
    """Give the columns of a value: a channel's by its name, what stands beside it with its own name after that."""
    _require_axes(value)
    for place, (name, axes) in enumerate(value.AXES.items()):
        if value.ROWS not in axes:
            continue
        others = tuple(one for one in axes if one != value.ROWS)
        numbers = np.moveaxis(getattr(value, name), axes.index(value.ROWS), 0)
        labels = [tuple(map(str, value.coordinate(one))) for one in others]
        for label, at in zip(product(*labels), _places(value, others), strict=True):
            told = " / ".join(label)
            title = " ".join(filter(None, (told, name if place or not told or value.OF_ROW else "")))
            yield _Column(name=title, unit=value.unit_at(name, at), numbers=numbers[(slice(None), *at)])


def _row_units(value: Value) -> Iterator[_Column]:
    """Give the units of rows that are channels, where a column has several."""
    if value.OF_ROW:
        units = np.array([channel.unit for channel in getattr(value, value.ROWS)], dtype=object)
        yield _Column(name="unit", unit="", numbers=units)


def _places(value: Value, axes: tuple[str, ...]) -> Iterator[tuple[int, ...]]:
    return product(*(range(len(value.coordinate(one))) for one in axes if one != value.ROWS))


def _require_axes(value: Value) -> None:
    if not value.AXES:
        raise SetupError(f"a {type(value).__name__} is no table; take its fields")


def _variable(name: str, dimensions: dict[str, None]) -> str:
    """Name a variable of a dataset, which mayn't be called as one of its dimensions."""
    return f"{name}_values" if name in dimensions else name


def _real(column: _Column) -> Iterator[_Column]:
    """Give a complex column as its real and imaginary parts, which files hold as two."""
    if not np.iscomplexobj(column.numbers):
        yield column
        return
    for part, numbers in (("real", column.numbers.real), ("imag", column.numbers.imag)):
        yield _Column(name=f"{column.name} {part}", unit=column.unit, numbers=numbers)


def _cell(number: Any) -> Any:
    """Leave a cell empty where nothing is known."""
    if isinstance(number, str):
        return cell_text(number)
    return "" if isinstance(number, float) and not np.isfinite(number) else number

"""What all value records share: arrays that can't be written to, and loud refusal of bare NumPy arithmetic."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.outlets import outlet

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes

ScalarT = TypeVar("ScalarT", bound=np.generic)
#: What stands along an axis: numbers, or names.
Coordinate = NDArray[Any] | Sequence[Any]


def read_only(array: NDArray[ScalarT]) -> NDArray[ScalarT]:
    """Give a view of `array` that can't be written to; no data is copied."""
    view = array.view()
    view.flags.writeable = False
    return view


def of_channel(unit: str) -> str:
    """Give the unit of a channel as that of its values, see `Value.UNITS`."""
    return unit


class Drawn:
    """Abstract base of what has a picture."""

    __slots__ = ()

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw it by matplotlib.

        Parameters
        ----------
        ax
            Axes to draw into; None makes a figure of as many as it takes, with pyplot.

        Returns
        -------
        Axes
            Those drawn into; of several the first, the others are in ``.figure.axes``.

        Raises
        ------
        SetupError
            When it has no picture, or one that takes more than the one axes given.
        """
        axes: Axes = outlet("plot")(self, ax=ax)
        return axes

    def _repr_png_(self) -> bytes | None:
        """Give the picture that a notebook shows; None, so that it shows text, where there is nothing to draw."""
        content: bytes | None = outlet("png")(self)
        return content


class Value(Drawn):
    """Abstract base of the value records; every subclass is a final, frozen, slotted dataclass.

    A value carries a unit and an axis that a bare array would lose, so ``np.asarray(value)`` and
    ``value * 2`` raise `TypeError`; the numbers are in the fields.

    Attributes
    ----------
    AXES
        Of the fields that make a table, the main one first: what each of their axes runs along, see `coordinate`.
    ROWS
        Which of these axes runs down the rows of a table.
    UNITS
        Of these fields, the unit, or what makes it of the unit of a channel on the first axis but `ROWS`.
    OF_ROW
        Where rows are channels: the fields in the unit of their row's channel.
    """

    __slots__ = ()
    __array_ufunc__: Any = None
    AXES: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    ROWS: ClassVar[str] = ""
    UNITS: ClassVar[Mapping[str, str | Callable[[str], str]]] = {}
    OF_ROW: ClassVar[tuple[str, ...]] = ()

    def coordinate(self, axis: str) -> Coordinate:
        """Give what stands along one axis of `AXES`: the numbers of that field, or the names of its channels."""
        along: Coordinate = getattr(self, axis)
        # Channels know their names; this floor's records of them are above this module.
        return along if isinstance(along, np.ndarray) else [getattr(one, "name", one) for one in along]

    def unit_at(self, field: str, place: tuple[int, ...]) -> str:
        """Give the unit of a field of `AXES` at a place along its axes but `ROWS`; empty where it has none."""
        unit = self.UNITS.get(field, "")
        if isinstance(unit, str):
            return unit
        channels = next(one for one in self.AXES[field] if one != self.ROWS)
        return unit(getattr(self, channels)[place[0]].unit)

    def to_pandas(self) -> "pd.DataFrame":
        """Give it as a data frame: a row for each frequency, moment or mode, a column for each channel.

        ``.attrs["units"]`` holds the unit of each column. Error bars, coherence and the like are columns of their own
        (``tip std``).

        Raises
        ------
        SetupError
            When pandas isn't installed, or it's no table.
        """
        frame: pd.DataFrame = outlet("to_pandas")(self)
        return frame

    def to_xarray(self) -> "xr.Dataset":
        """Give it as a dataset of labelled arrays.

        Raises
        ------
        SetupError
            When xarray isn't installed, or it's no table.
        """
        dataset: xr.Dataset = outlet("to_xarray")(self)
        return dataset

    def to_csv(self, path: Path | str) -> None:
        """Write it as a table, columns as in `to_pandas` with their unit in brackets; complex ones in two parts.

        Points, directions and how it was made aren't in a table.

        Raises
        ------
        SetupError
            When it's no table.
        LogError
            When the file can't be written.
        """
        outlet("to_csv")(self, path)

    def __array__(self, dtype: object = None, copy: object = None) -> Any:
        raise TypeError(
            f"{type(self).__name__} carries units that an array would lose; use its fields, such as .values"
        )

    def _freeze(self) -> None:
        """Replace each array field with a read-only view; called last in ``__post_init__``."""
        for name in _field_names(self):
            content = getattr(self, name)
            if isinstance(content, np.ndarray):
                object.__setattr__(self, name, read_only(content))

    def __reduce__(self) -> tuple[Any, ...]:
        # Going through the constructor keeps arrays read-only after pickle, which restoring state would not.
        return _rebuild, (type(self), {name: getattr(self, name) for name in _field_names(self)})

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        content = {name: copy.deepcopy(getattr(self, name), memo) for name in _field_names(self)}
        return type(self)(**content)


def require_shape(name: str, array: NDArray[Any], expected: tuple[int, ...], axes: str) -> None:
    """Raise `EstimateError` unless `array` has the `expected` shape; `axes` names it for the message."""
    if array.shape != expected:
        raise EstimateError(f"{name} has shape {array.shape}, but {axes} asks for {expected}")


def require_frequency_axis(frequency_hz: Real) -> None:
    """Raise `EstimateError` unless the axis is one-dimensional, finite and strictly rising."""
    if frequency_hz.ndim != 1 or not np.all(np.isfinite(frequency_hz)) or np.any(np.diff(frequency_hz) <= 0):
        raise EstimateError("frequency_hz must be one-dimensional, finite and strictly rising")


def over_frequency(frequency_hz: ArrayLike, values: ArrayLike, dtype: type[ScalarT]) -> tuple[Real, NDArray[ScalarT]]:
    """Give an axis and values ``[..., frequency]`` over it as arrays, the values with two axes at least.

    Raises
    ------
    EstimateError
        When the last axis of the values isn't as long as the frequencies.
    """
    axis = np.asarray(frequency_hz, dtype=np.float64)
    table = np.atleast_2d(np.asarray(values, dtype=dtype))
    if axis.ndim != 1 or table.shape[-1] != axis.size:
        raise EstimateError(
            f"values have shape {table.shape} over frequencies {axis.shape}; frequency is their last axis"
        )
    return axis, table


# Looked up for every record that is made; dataclasses builds the tuple anew each time.
_FIELD_NAMES: dict[type[Any], tuple[str, ...]] = {}


def _field_names(value: Value) -> tuple[str, ...]:
    cls: type[Any] = type(value)
    if cls not in _FIELD_NAMES:
        _FIELD_NAMES[cls] = tuple(field.name for field in fields(cls))
    return _FIELD_NAMES[cls]


def _rebuild(cls: type[Value], content: dict[str, Any]) -> Value:
    return cls(**content)

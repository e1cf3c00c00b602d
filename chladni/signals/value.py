"""What all value records share: arrays that can't be written to, and loud refusal of bare NumPy arithmetic."""

import copy
from dataclasses import fields
from typing import Any, NoReturn, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError

ScalarT = TypeVar("ScalarT", bound=np.generic)


def read_only(array: NDArray[ScalarT]) -> NDArray[ScalarT]:
    """Give a view of `array` that can't be written to; no data is copied."""
    view = array.view()
    view.flags.writeable = False
    return view


class Value:
    """Abstract base of the value records; every subclass is a final, frozen, slotted dataclass.

    A value carries a unit and an axis that a bare array would lose, so ``np.asarray(value)`` and
    ``value * 2`` raise `TypeError`; the numbers are in the fields.
    """

    __slots__ = ()
    __array_ufunc__ = None

    def __array__(self, dtype: object = None, copy: object = None) -> NoReturn:
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

"""Likeness of modal vectors."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.value import Coordinate, Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalAssurance(NDArrayOperatorsMixin, Value):
    """Modal assurance criterion between two sets of modes; a plain matrix to NumPy, since it has no unit.

    Attributes
    ----------
    values
        ``[mode of a, mode of b]``, 0 (orthogonal) to 1 (the same up to a complex factor).
    a_hz, b_hz
        ``[mode]`` natural frequencies of either set; NaN where they aren't known.
    """

    AXES: ClassVar = {"values": ("mode_a", "mode_b")}
    ROWS: ClassVar = "mode_a"

    values: Real
    a_hz: Real
    b_hz: Real

    def __post_init__(self) -> None:
        require_shape("values", self.values, (self.a_hz.size, self.b_hz.size), "modes of a x modes of b")
        self._freeze()

    def coordinate(self, axis: str) -> Coordinate:
        """Give the numbers of the modes of a set, from 1 on."""
        return np.arange(1, (self.a_hz if axis == "mode_a" else self.b_hz).size + 1)

    def __array__(self, dtype: Any = None, copy: Any = None) -> NDArray[Any]:
        return np.array(self.values, dtype=dtype, copy=copy)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        plain = (one.values if isinstance(one, ModalAssurance) else one for one in inputs)
        return getattr(ufunc, method)(*plain, **options)

    @property
    def shape(self) -> tuple[int, int]:
        """Modes of a, and of b."""
        return self.a_hz.size, self.b_hz.size

    def __getitem__(self, place: Any) -> Any:
        return self.values[place]

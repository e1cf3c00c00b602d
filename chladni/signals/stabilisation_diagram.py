"""Poles over model orders, as an analyst looks at them."""

from dataclasses import dataclass, replace
from typing import Any, Literal, Self, get_args

import numpy as np

from chladni.signals.arrays import Index, Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.outlets import outlet
from chladni.signals.value import Value, require_frequency_axis, require_shape

PoleStatus = Literal["new", "frequency", "damping", "vector"]
POLE_STATUSES: tuple[PoleStatus, ...] = get_args(PoleStatus)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StabilisationDiagram(Value):
    """Poles of all model orders above an indicator function.

    Attributes
    ----------
    order, frequency_hz, damping_ratio
        ``[pole]`` the oscillating poles on the stable side, by order.
    status
        ``[pole]`` index into `POLE_STATUSES`: nothing agrees with the order below, the frequency does, the damping
        does too, the vector (participation or shape) does too.
    mode
        ``[pole]`` row of the mode that the pole was taken for, -1 for none.
    indicator_hz, indicator
        ``[line]`` and ``[curve, line]``: singular values of the frequency responses (CMIF) or of the cross-spectra,
        the greatest first; the diagram is drawn over them.
    indicator_name, indicator_unit
        What the curves are.
    """

    order: Whole
    frequency_hz: Real
    damping_ratio: Real
    status: Whole
    mode: Whole
    indicator_hz: Real
    indicator: Real
    indicator_name: str
    indicator_unit: str

    def __post_init__(self) -> None:
        for name in ("frequency_hz", "damping_ratio", "status", "mode"):
            require_shape(name, getattr(self, name), self.order.shape, "poles")
        if np.any((self.status < 0) | (self.status >= len(POLE_STATUSES))):
            raise EstimateError(f"status must index {POLE_STATUSES}")
        require_frequency_axis(self.indicator_hz)
        curves = self.indicator.shape[:1]
        require_shape("indicator", self.indicator, (*curves, self.indicator_hz.size), "curves x lines")
        self._freeze()

    def select(self, rows: Index) -> Self:
        """Give the same poles with the numbers that some modes have when only those are kept, in the order given."""
        numbers = {int(row): number for number, row in enumerate(rows)}
        return replace(self, mode=np.array([numbers.get(int(row), -1) for row in self.mode], dtype=np.int64))

    def pick(self, source: Any, **options: Any) -> Any:
        """Pick modes by clicking at poles, in a notebook; it begins with the modes that were taken from this diagram.

        Parameters
        ----------
        source
            What the modes were identified from: frequency responses, a series, a log or the path to one.
        options
            As `identify_modes` was given them, such as ``band_hz=``.

        Returns
        -------
        ModePicking
            See `chladni.pick_modes`; ``.modes`` holds what is picked, ``.frequencies_hz`` the list that repeats it.
        """
        return outlet("pick")(self, source, **options)

"""Modal mass and modal A: what turns shapes into receptances."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Index, Real
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalScale(Value):
    """Scale of each mode's shape (largest component 1), from a driving point.

    Attributes
    ----------
    response, reference
        Names of the channels of the driving point.
    modal_a
        ``[mode]`` complex a_r, kg rad/s for forces and translations: participation_j = shapes_j / a_r at every
        reference j that is a driving point (Maia & Silva 1997, section 2.4).
    modal_mass, modal_mass_std
        ``[mode]`` Re(a_r / (2 j omega_d)), kg for forces and translations, and one sigma of it. A shape over the
        square root of its modal mass has unit modal mass.
    """

    response: str
    reference: str
    modal_a: NDArray[np.complexfloating]
    modal_mass: Real
    modal_mass_std: Real

    def __post_init__(self) -> None:
        for name in ("modal_mass", "modal_mass_std"):
            require_shape(name, getattr(self, name), self.modal_a.shape, "modes")
        self._freeze()

    def select(self, rows: Index) -> Self:
        """Give the scale of some modes, in the order asked for."""
        return replace(
            self,
            modal_a=self.modal_a[rows],
            modal_mass=self.modal_mass[rows],
            modal_mass_std=self.modal_mass_std[rows],
        )

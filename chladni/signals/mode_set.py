"""Natural modes: frequencies, damping ratios and modal vectors, each with its uncertainty."""

from dataclasses import dataclass, replace
from math import pi
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_fit import ModalFit
from chladni.signals.modal_scale import ModalScale
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModeSet(Value):
    """Modes by rising natural frequency; an empty set is an answer, and its notes say why.

    Attributes
    ----------
    frequency_hz, frequency_std_hz
        ``[mode]`` undamped natural frequency abs(pole)/(2 pi), and one sigma of it.
    damping_ratio, damping_std
        ``[mode]`` -Re(pole)/abs(pole), and one sigma of it.
    shapes
        ``[mode, channel]`` complex displacement of each channel along its own direction, largest component 1.
    shape_std
        ``[mode, channel]`` complex: one sigma of the real part + j one sigma of the imaginary part; 0 at the
        component that is 1 by convention.
    channels
        One for each column of `shapes`.
    references
        Excitations of the frequency responses; empty when the modes are from responses alone.
    participation
        ``[mode, reference]`` complex, or None when the modes are from responses alone. The receptance is
        H_ij(s) = sum over modes of shapes_i participation_j / (s - pole) + its conjugate partner + residuals.
    scale
        Modal mass and modal A, or None: unscaled, and a note says why.
    spread
        How the poles of each mode scatter over model orders; None for methods without model orders.
    harmonics
        Lines of rotating machines that were told from modes and left out.
    fit
        Synthesised frequency responses and their error; None when the modes are from responses alone.
    stabilisation
        All poles that the modes were chosen from; None for methods without model orders.
    provenance
        How they were made; notes are advice.
    """

    frequency_hz: Real
    frequency_std_hz: Real
    damping_ratio: Real
    damping_std: Real
    shapes: NDArray[np.complexfloating]
    shape_std: NDArray[np.complexfloating]
    channels: tuple[Channel, ...]
    references: tuple[Channel, ...] = ()
    participation: NDArray[np.complexfloating] | None = None
    scale: ModalScale | None = None
    spread: OrderSpread | None = None
    harmonics: tuple[MachineHarmonic, ...] = ()
    fit: ModalFit | None = None
    stabilisation: StabilisationDiagram | None = None
    provenance: Provenance

    def __post_init__(self) -> None:
        count = self.frequency_hz.size
        for name in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"):
            require_shape(name, getattr(self, name), (count,), "modes")
        for name in ("shapes", "shape_std"):
            require_shape(name, getattr(self, name), (count, len(self.channels)), "modes x channels")
        if self.participation is not None:
            expected = (count, len(self.references))
            require_shape("participation", self.participation, expected, "modes x references")
        if self.fit is not None:
            expected = (len(self.channels), len(self.references))
            require_shape("fit.function_error", self.fit.function_error, expected, "channels x references")
        if np.any(np.diff(self.frequency_hz) < 0) or np.any(self.frequency_hz <= 0):
            raise EstimateError("frequency_hz of modes must be positive and rising")
        self._freeze()

    @property
    def poles(self) -> Complex:
        """``[mode]`` -zeta omega + j omega sqrt(1 - zeta^2) in rad/s."""
        omega = 2 * pi * self.frequency_hz
        return -self.damping_ratio * omega + 1j * omega * np.sqrt(1 - self.damping_ratio**2)

    def select(self, rows: Index) -> Self:
        """Give some of the modes, by rising frequency; the fit stays that of all of them.

        Parameters
        ----------
        rows
            ``[mode]`` rows to keep, by rising frequency.
        """
        return replace(
            self,
            frequency_hz=self.frequency_hz[rows],
            frequency_std_hz=self.frequency_std_hz[rows],
            damping_ratio=self.damping_ratio[rows],
            damping_std=self.damping_std[rows],
            shapes=self.shapes[rows],
            shape_std=self.shape_std[rows],
            participation=None if self.participation is None else self.participation[rows],
            scale=None if self.scale is None else self.scale.select(rows),
            spread=None if self.spread is None else self.spread.select(rows),
            stabilisation=None if self.stabilisation is None else self.stabilisation.select(rows),
        )

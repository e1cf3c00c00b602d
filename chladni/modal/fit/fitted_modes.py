"""Modes fitted to frequency responses, each with its uncertainty."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.modal.fit.modal_model import ModalModel
from chladni.signals.arrays import Index, Real
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FittedModes(Value):
    """Modal model of greatest likelihood, and one sigma of all that is in it.

    Attributes
    ----------
    model
        Modes by rising natural frequency; the largest component of each shape is 1, so that the participation
        carries the scale of the receptance.
    kept
        ``[mode]`` index of each mode among those that the fit began with; the others were left out, see `notes`.
    frequency_std_hz, damping_std
        ``[mode]`` one sigma of natural frequency and damping ratio.
    covariance
        ``[mode, 2, mode, 2]`` covariance of natural frequency (Hz) and damping ratio of all modes.
    shape_std
        ``[mode, response]`` complex: one sigma of the real part + j one sigma of the imaginary part; 0 at the
        component that is 1 by convention.
    participation_std
        ``[mode, reference]`` complex, packed alike.
    modal_mass_std
        ``[mode, response, reference]`` one sigma of Re(psi_i / (2 j omega_d L_j)), the modal mass if response i and
        reference j are a driving point.
    chi_square
        Weighted sum of squared residuals over its degrees of freedom: about 1 where noise explains the misfit. NaN
        when no standard deviation of the functions is known.
    inflation
        ``[mode]`` what the variance from independent lines was multiplied by: correlation of neighbouring lines,
        misfit, and weights that are estimates themselves.
    notes
        What was left out, what to distrust.
    """

    model: ModalModel
    kept: Index
    frequency_std_hz: Real
    damping_std: Real
    covariance: Real
    shape_std: NDArray[np.complexfloating]
    participation_std: NDArray[np.complexfloating]
    modal_mass_std: Real
    chi_square: float
    inflation: Real
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        modes = self.model.poles.size
        for name in ("kept", "frequency_std_hz", "damping_std", "inflation"):
            require_shape(name, getattr(self, name), (modes,), "modes")
        require_shape("covariance", self.covariance, (modes, 2, modes, 2), "modes x (frequency, damping), twice")
        require_shape("shape_std", self.shape_std, self.model.shapes.shape, "modes x responses")
        require_shape("participation_std", self.participation_std, self.model.participation.shape, "as the model's")
        functions = (self.model.shapes.shape[1], self.model.participation.shape[1])
        require_shape("modal_mass_std", self.modal_mass_std, (modes, *functions), "modes x responses x references")
        self._freeze()

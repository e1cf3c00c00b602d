"""The modal model: poles, shapes, participation and residuals, and the frequency responses that they add up to."""

from dataclasses import dataclass, replace
from math import pi
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value, require_shape
from chladni.spectral.forms import ORDER, Form


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalModel(Value):
    """Sum of modes and of what lies outside the band, as receptance (Maia & Silva 1997, section 2.4).

        H_ij(s) = sum_r psi_ri L_rj / (s - lambda_r) + conj(psi_ri L_rj) / (s - conj(lambda_r)) + LR_ij/s^2 + UR_ij

    Attributes
    ----------
    poles
        ``[mode]`` lambda in rad/s, with Im > 0; the conjugate partners are implied.
    shapes
        ``[mode, response]`` psi, complex.
    participation
        ``[mode, reference]`` L, complex; ones for a single reference make the shapes residues.
    lower, upper
        ``[response, reference]`` LR and UR: the inertia and the flexibility of modes below and above the band.
        Undamped ones leave real terms; they are complex here because damping of those modes and small phase errors
        of the sensors leave an imaginary part that is nearly constant over a band.
    """

    poles: Complex
    shapes: NDArray[np.complexfloating]
    participation: NDArray[np.complexfloating]
    lower: NDArray[np.complexfloating]
    upper: NDArray[np.complexfloating]

    def __post_init__(self) -> None:
        modes = self.poles.size
        functions = (self.shapes.shape[-1], self.participation.shape[-1])
        require_shape("poles", self.poles, (modes,), "modes")
        require_shape("shapes", self.shapes, (modes, functions[0]), "modes x responses")
        require_shape("participation", self.participation, (modes, functions[1]), "modes x references")
        for name in ("lower", "upper"):
            require_shape(name, getattr(self, name), functions, "responses x references")
        self._freeze()

    @property
    def frequency_hz(self) -> Real:
        """``[mode]`` undamped natural frequency abs(lambda)/(2 pi)."""
        return np.abs(self.poles) / (2 * pi)

    @property
    def damping_ratio(self) -> Real:
        """``[mode]`` -Re(lambda)/abs(lambda)."""
        return np.asarray(-self.poles.real / np.abs(self.poles), dtype=np.float64)

    @property
    def residues(self) -> Complex:
        """``[mode, response, reference]`` psi_ri L_rj."""
        return np.asarray(self.shapes[:, :, np.newaxis] * self.participation[:, np.newaxis], dtype=np.complex128)

    def synthesise(self, frequency_hz: Real, form: Form) -> Complex:
        """Add up the frequency responses, in the convention e^{+j omega t}.

        Parameters
        ----------
        frequency_hz
            ``[line]``; positive where the model has a lower residual and `form` is not accelerance.
        form
            ``receptance``, ``mobility`` or ``accelerance``: what is above times 1, s or s^2.

        Returns
        -------
        ``[response, reference, line]`` in the form's unit, such as (m/s^2)/N.

        Examples
        --------
        >>> one = np.ones((1, 1), dtype=complex)
        >>> model = ModalModel(
        ...     poles=np.array([-1 + 100j]), shapes=-0.005j * one, participation=one, lower=0 * one, upper=0 * one
        ... )
        >>> abs(model.synthesise(np.array([0.0]), "receptance")[0, 0, 0] - 1 / 10001) < 1e-12
        np.True_
        """
        s = 2j * pi * frequency_hz
        order = ORDER[form]
        if np.any(s == 0) and order < 2 and np.any(self.lower):
            raise EstimateError(
                f"at 0 Hz the {form} of a model with a lower residual is infinite; leave that line out"
            )
        # s^(order - 2) rather than s^order / s^2, so that accelerance has its rigid body motion at 0 Hz.
        low = np.ones_like(s) if order == 2 else np.divide(1, s ** (2 - order), out=0 * s, where=s != 0)
        powers = s**order
        direct = self._sum(self.residues, powers / (s - self.poles[:, np.newaxis]))
        partner = self._sum(self.residues.conj(), powers / (s - self.poles.conj()[:, np.newaxis]))
        return direct + partner + self.lower[..., np.newaxis] * low + self.upper[..., np.newaxis] * powers

    def select(self, modes: Any) -> Self:
        """Give the model with some of its modes, by index or mask; residuals stay."""
        return replace(
            self, poles=self.poles[modes], shapes=self.shapes[modes], participation=self.participation[modes]
        )

    @staticmethod
    def _sum(residues: Complex, functions: Complex) -> Complex:
        return np.asarray(np.moveaxis(residues, 0, -1) @ functions, dtype=np.complex128)

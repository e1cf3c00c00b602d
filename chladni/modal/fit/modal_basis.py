"""What one mode, and what lies outside the band, adds to the lines of a function."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from chladni.modal.fit.lag_window import LagWindow
from chladni.modal.fit.model_lines import ModelLines
from chladni.signals.arrays import Complex, Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ModalBasis(Value):
    """Functions over lines whose combinations with *real* weights are modal models.

    A shape enters with its conjugate, so that the model is linear in Re psi and Im psi, not in psi. For each mode
    there are two columns, phi + phi~ for the real part and j(phi - phi~) for the imaginary. phi is s^p/(s - lambda)
    as the window of the segments shows it, and phi~ the same of conj(lambda).

    Attributes
    ----------
    functions
        ``[2 mode + 4, line]`` for Re, Im of each mode's residue, then for Re, Im of two residual terms, orthonormal
        over the lines.
    slopes
        ``[2 mode, line]`` the derivative to lambda, for Re, Im of residue times change of the pole.
    residual_terms
        ``[2, 2]`` the two terms as combinations of s^(p-2) (lower) and s^p (upper).
    """

    functions: Complex
    slopes: Complex
    residual_terms: Real

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def modes(self) -> Complex:
        """``[2 mode, line]`` of the functions."""
        return self.functions[: len(self.slopes)]

    @property
    def residuals(self) -> Complex:
        """``[4, line]`` of the functions."""
        return self.functions[len(self.slopes) :]

    def at(self, near: slice) -> Self:
        """Give the basis on some of the lines."""
        return replace(self, functions=self.functions[:, near], slopes=self.slopes[:, near])


def modal_basis(lines: ModelLines, poles: Complex) -> ModalBasis:
    """Evaluate the basis for given poles ``[mode]`` in rad/s."""
    direct, slope = _functions(lines, poles)
    partner, partner_slope = _functions(lines, poles.conj())
    residuals, terms = _residual_functions(lines)
    return ModalBasis(
        functions=np.concatenate([_pairs(direct, partner), residuals]),
        slopes=_pairs(slope, partner_slope),
        residual_terms=terms,
    )


def _pairs(direct: Complex, partner: Complex) -> Complex:
    pairs = np.stack([direct + partner, 1j * (direct - partner)], axis=1)
    return pairs.reshape(-1, direct.shape[-1])


def _functions(lines: ModelLines, poles: Complex) -> tuple[Complex, Complex]:
    """s^p/(s - lambda) and its derivative to lambda, as the segments see them."""
    s, order = lines.s, lines.order
    if lines.window is None:
        endless = 1 / (s - poles[:, np.newaxis])
        powers = s**order
        return powers * endless, powers * endless**2
    return _windowed(s, order, poles, lines.window)


def _windowed(s: Complex, order: int, poles: Complex, window: LagWindow) -> tuple[Complex, Complex]:
    # s/(s - l) = 1 + l/(s - l) and s^2/(s - l) = s + l + l^2/(s - l): only the decay is seen through the window, the
    # impulse at lag 0 isn't, and of its derivative only as far as the lag window is steep there.
    decay, slope = window.decay_transform(s, poles)
    pole = poles[:, np.newaxis]
    if order == 0:
        return decay, slope
    if order == 1:
        return 1 + pole * decay, decay + pole * slope
    start = s - window.slope_per_s + pole
    return start + pole**2 * decay, 1 + 2 * pole * decay + pole**2 * slope


def _residual_functions(lines: ModelLines) -> tuple[Complex, Real]:
    # Over a narrow band s^-2 and 1 are nearly the same; orthonormal combinations keep the equations well conditioned.
    omega = lines.s.imag
    raw = np.stack([-(omega ** (lines.order - 2.0)), omega ** float(lines.order)])
    terms = np.eye(2)
    for row in range(2):
        if row:
            terms[1] -= (terms[1] @ raw @ (terms[0] @ raw)) * terms[0]
        length = np.linalg.norm(terms[row] @ raw)
        terms[row] /= length if length > 0 else 1.0
    functions = (terms @ raw) * 1j**lines.order
    return np.stack([functions, 1j * functions], axis=1).reshape(4, -1), terms

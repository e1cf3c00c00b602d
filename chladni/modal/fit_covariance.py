"""Error bars of a fitted modal model, propagated to first order."""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from chladni.modal.fit_inflation import Misfit
from chladni.modal.fitted_modes import FittedModes
from chladni.modal.lsfd import ShapeSolution
from chladni.modal.modal_model import ModalModel
from chladni.modal.model_lines import ModelLines
from chladni.modal.normal_equations import symmetric_inverse
from chladni.modal.reduced_equations import reduced_equations

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]


def fitted_modes(
    lines: ModelLines,
    poles: Complex,
    solution: ShapeSolution,
    *,
    found: Misfit,
    kept: NDArray[np.intp],
    notes: tuple[str, ...],
) -> FittedModes:
    """Attach error bars to poles and their best shapes, with what was found of the misfit."""
    spread = _spread(lines, solution)
    model, largest = _normalised(solution.model(poles))
    modes, inflation = range(poles.size), found.inflation
    scale = solution.shapes[np.arange(poles.size), largest]
    change = np.stack([_frequency_slopes(poles), _damping_slopes(poles)], axis=1)
    inflated = np.sqrt(inflation[:, np.newaxis] * inflation)
    covariance = np.einsum("rax,rxsy,sby->rasb", change, spread.poles(), change) * inflated[:, None, :, None]
    std = np.sqrt(np.einsum("rara->ra", covariance))
    gains = np.sqrt(inflation)[:, np.newaxis]
    shape_std = np.stack([spread.shape_std(mode, int(largest[mode]), scale[mode]) for mode in modes])
    participation_std = np.stack([spread.participation_std(mode, int(largest[mode]), scale[mode]) for mode in modes])
    masses = np.stack([spread.mass_std(mode, int(largest[mode]), scale[mode], poles[mode]) for mode in modes])
    order = np.argsort(np.abs(poles), kind="stable")
    return FittedModes(
        model=model.select(order),
        kept=kept[order],
        frequency_std_hz=std[order, 0],
        damping_std=std[order, 1],
        covariance=covariance[order][:, :, order],
        shape_std=(gains * shape_std)[order],
        participation_std=(gains * participation_std)[order],
        modal_mass_std=(gains[..., np.newaxis] * masses)[order],
        chi_square=found.chi_square if lines.weighted else float("nan"),
        inflation=inflation[order],
        notes=notes,
    )


def no_modes(lines: ModelLines, notes: tuple[str, ...]) -> FittedModes:
    """Give the answer that no mode is left."""
    responses, references, _ = lines.values.shape
    none = np.zeros((responses, references), dtype=np.complex128)
    model = ModalModel(
        poles=np.empty(0, dtype=np.complex128),
        shapes=np.empty((0, responses), dtype=np.complex128),
        participation=np.empty((0, references), dtype=np.complex128),
        lower=none,
        upper=none,
    )
    return FittedModes(
        model=model,
        kept=np.empty(0, dtype=np.intp),
        frequency_std_hz=np.empty(0),
        damping_std=np.empty(0),
        covariance=np.empty((0, 2, 0, 2)),
        shape_std=model.shapes,
        participation_std=model.participation,
        modal_mass_std=np.empty((0, responses, references)),
        chi_square=float("nan"),
        inflation=np.empty(0),
        notes=notes,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Spread:
    """First-order scatter of all parameters: x_i = own_i + coupling_i theta, with independent own_i and theta.

    ``own[response, coefficient, coefficient]`` and ``theta[parameter, parameter]`` are covariances,
    ``coupling[response, coefficient, parameter]``; parameters are Re, Im of poles, then of participation.
    """

    own: Floats
    coupling: Floats
    theta: Floats
    shapes: Complex
    participation: Complex

    def poles(self) -> Floats:
        """``[mode, 2, mode, 2]`` covariance of Re and Im of the poles."""
        modes = len(self.participation)
        return self.theta[: 2 * modes, : 2 * modes].reshape(modes, 2, modes, 2)

    def shape_std(self, mode: int, largest: int, scale: complex) -> Complex:
        """``[response]`` of the components over the largest."""
        ratios = self.shapes[mode] / scale
        own, coupling = self._shape(mode)
        # d(psi_i/psi_c) = (d psi_i - (psi_i/psi_c) d psi_c) / psi_c
        through = coupling - _real(ratios) @ coupling[largest]
        total = own + _real(ratios) @ own[largest] @ _real(ratios.conj()) + _sandwich(through, self.theta)
        total[largest] = 0
        return _packed(total, np.full(ratios.shape, 1 / scale))

    def participation_std(self, mode: int, largest: int, scale: complex) -> Complex:
        """``[reference]`` of participation times the largest component."""
        own, coupling = self._shape(mode)
        vector = self.participation[mode]
        # d(L_j psi_c) = psi_c d L_j + L_j d psi_c
        through = _real(np.full(vector.shape, scale)) @ self._components(mode) + _real(vector) @ coupling[largest]
        total = _real(vector) @ own[largest] @ _real(vector.conj()) + _sandwich(through, self.theta)
        return _packed(total, np.ones_like(vector))

    def mass_std(self, mode: int, largest: int, scale: complex, pole: complex) -> Floats:
        """``[response, reference]`` of Re(a / (2 j omega_d)), a = (psi_i/psi_c)/(L_j psi_c)."""
        vector, ratios = self.participation[mode], self.shapes[mode] / scale
        with np.errstate(divide="ignore", invalid="ignore"):
            mass = ratios[:, np.newaxis] / (vector * scale) / (2j * pole.imag)
            return np.stack(
                [self._mass_std(mode, largest, scale, pole, j, mass[:, j]) for j in range(vector.size)], axis=1
            )

    def _mass_std(
        self, mode: int, largest: int, scale: complex, pole: complex, reference: int, mass: Complex
    ) -> Floats:
        own, coupling = self._shape(mode)
        here, there = 1 / (self.participation[mode, reference] * scale**2 * 2j * pole.imag), -2 * mass / scale
        beside = -mass / self.participation[mode, reference]
        tuned = np.zeros((2, self.theta.shape[0]))
        tuned[0, 2 * mode + 1] = 1 / pole.imag
        direct = _real(np.full(mass.shape, here))
        through = direct @ coupling + _real(there) @ coupling[largest]
        through += _real(beside) @ self._components(mode)[reference] - _real(mass) @ tuned
        total = direct @ own @ np.swapaxes(direct, -1, -2)
        shared = _real(there)
        total = total + shared @ own[largest] @ np.swapaxes(shared, -1, -2)
        # The largest component is one scatter, seen twice.
        both = direct[largest] + shared[largest]
        total[largest] = both @ own[largest] @ both.T
        return np.asarray(np.sqrt((total + _sandwich(through, self.theta))[:, 0, 0]), dtype=np.float64)

    def _shape(self, mode: int) -> tuple[Floats, Floats]:
        rows = slice(2 * mode, 2 * mode + 2)
        return self.own[:, rows, rows], self.coupling[:, rows]

    def _components(self, mode: int) -> Floats:
        """``[reference, 2, parameter]`` that picks Re, Im of a participation vector."""
        modes, references = self.participation.shape
        picks = np.zeros((references, 2, self.theta.shape[0]))
        for j in range(references):
            first = 2 * modes * (1 + j) + 2 * mode
            picks[j, [0, 1], [first, first + 1]] = 1
        return picks


def _spread(lines: ModelLines, solution: ShapeSolution) -> _Spread:
    equations = reduced_equations(lines, solution)
    modes, references = solution.participation.shape
    size = 2 * modes * (1 + references)
    theta = np.zeros((size, size))
    theta[np.ix_(equations.free, equations.free)] = symmetric_inverse(equations.curvature).inverse
    coupling = np.zeros((*equations.coupling.shape[:2], size))
    # Shapes and residuals follow the parameters so that the misfit stays least.
    coupling[..., equations.free] = -equations.coupling
    return _Spread(
        own=solution.equations.inverse,
        coupling=coupling,
        theta=theta,
        shapes=solution.shapes,
        participation=solution.participation,
    )


def _normalised(model: ModalModel) -> tuple[ModalModel, NDArray[np.intp]]:
    largest = np.argmax(np.abs(model.shapes), axis=1)
    scale = model.shapes[np.arange(largest.size), largest][:, np.newaxis]
    shapes = model.shapes / scale
    # Exactly 1, which rounding of the quotient needn't give.
    shapes[np.arange(largest.size), largest] = 1
    normalised = ModalModel(
        poles=model.poles,
        shapes=shapes,
        participation=model.participation * scale,
        lower=model.lower,
        upper=model.upper,
    )
    return normalised, largest


def _real(factors: Complex) -> Floats:
    """``[..., 2, 2]`` matrices that multiply (Re, Im) by complex factors."""
    return np.stack(
        [np.stack([factors.real, -factors.imag], axis=-1), np.stack([factors.imag, factors.real], axis=-1)], axis=-2
    )


def _sandwich(through: Floats, covariance: Floats) -> Floats:
    return np.asarray(through @ covariance @ np.swapaxes(through, -1, -2), dtype=np.float64)


def _packed(covariance: Floats, factors: Complex) -> Complex:
    """One sigma of Re + j one sigma of Im, after multiplication by complex factors."""
    turned = _real(factors) @ covariance @ np.swapaxes(_real(factors), -1, -2)
    variances = np.maximum(np.einsum("...aa->...a", turned), 0.0)
    return np.asarray(np.ascontiguousarray(np.sqrt(variances)).view(np.complex128)[..., 0], dtype=np.complex128)


def _frequency_slopes(poles: Complex) -> Floats:
    """``[mode, 2]`` derivative of abs(lambda)/(2 pi) to Re and Im."""
    unit = poles / np.abs(poles)
    return np.stack([unit.real, unit.imag], axis=1) / (2 * pi)


def _damping_slopes(poles: Complex) -> Floats:
    """``[mode, 2]`` derivative of -Re/abs to Re and Im."""
    size = np.abs(poles)
    return np.stack([-(poles.imag**2), poles.real * poles.imag], axis=1) / size[:, np.newaxis] ** 3

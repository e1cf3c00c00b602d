"""First-order scatter of all parameters of a fitted modal model."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.fit.lsfd import ShapeSolution, synthesis
from chladni.modal.fit.mode_scatter import ModeScatter
from chladni.modal.fit.model_lines import ModelLines
from chladni.modal.fit.normal_equations import symmetric_inverse
from chladni.modal.fit.reduced_equations import reduced_equations
from chladni.signals.arrays import Complex, Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ParameterSpread:
    """First-order scatter of all parameters: x_i = own_i + coupling_i theta, with independent own_i and theta.

    ``own[response, coefficient, coefficient]`` and ``theta[parameter, parameter]`` are covariances,
    ``coupling[response, coefficient, parameter]``; parameters are Re, Im of poles, then of participation.
    ``root[parameter, direction]`` times its transpose is theta, and ``rooted`` the coupling of shapes times root: a
    variance then is a sum of squares, which keeps many responses cheap.
    """

    own: Real
    coupling: Real
    theta: Real
    root: Real
    rooted: Real
    solution: ShapeSolution

    @property
    def shapes(self) -> Complex:
        """``[mode, response]`` as they were solved for."""
        return self.solution.shapes

    @property
    def participation(self) -> Complex:
        """``[mode, reference]`` as it was fitted."""
        return self.solution.participation

    def poles(self) -> Real:
        """``[mode, 2, mode, 2]`` covariance of Re and Im of the poles."""
        modes = len(self.participation)
        return self.theta[: 2 * modes, : 2 * modes].reshape(modes, 2, modes, 2)

    def shape_std(self, mode: int, largest: int, scatter: ModeScatter) -> Complex:
        """``[response]`` of the components over the largest."""
        scale = self.shapes[mode, largest]
        ratios = self.shapes[mode] / scale
        own, coupling = self._shape(mode)
        own = own * scatter.shares[:, np.newaxis, np.newaxis]
        # d(psi_i/psi_c) = (d psi_i - (psi_i/psi_c) d psi_c) / psi_c
        through = coupling - real_matrices(ratios) @ coupling[largest]
        total = own + real_matrices(ratios) @ own[largest] @ real_matrices(ratios.conj())
        total = total + scatter.shared * _squared(through)
        total[largest] = 0
        return _packed(total, np.full(ratios.shape, 1 / scale), scatter.common)

    def participation_std(self, mode: int, largest: int) -> Complex:
        """``[reference]`` of participation times the largest component."""
        scale = self.shapes[mode, largest]
        own, coupling = self._shape(mode)
        vector = self.participation[mode]
        # d(L_j psi_c) = psi_c d L_j + L_j d psi_c
        through = (
            real_matrices(np.full(vector.shape, scale)) @ self._components(mode)
            + real_matrices(vector) @ coupling[largest]
        )
        total = real_matrices(vector) @ own[largest] @ real_matrices(vector.conj()) + _squared(through)
        return _packed(total, np.ones_like(vector))

    def amplitude(self, mode: int, largest: int) -> tuple[Real, Real]:
        """Directions whose fields are the influence of the data on Re and Im of the largest residue.

        They are of theta ``[2, parameter]`` and of the largest response's own scatter ``[2, coefficient]``.
        """
        reference = int(np.argmax(np.abs(self.participation[mode])))
        factor = real_matrices(self.participation[mode, reference])
        rows = slice(2 * mode, 2 * mode + 2)
        through = factor @ self.rooted[largest, rows]
        through += real_matrices(self.shapes[mode, largest]) @ self._components(mode)[reference]
        return through @ self.root.T, factor @ self.own[largest, rows]

    def field(self, near: slice, theta: Real, own: tuple[int, Real] | None = None) -> Complex:
        """Change of the model ``[response, reference, line]`` with theta and with one response's own scatter."""
        vectors, modes = self.participation, len(self.participation)
        changes = theta.view(np.complex128).reshape(-1, modes)
        follow = self.coupling @ theta
        if own is not None:
            follow[own[0]] += own[1]
        basis, shapes = self.solution.basis, self.shapes.T
        total = synthesis(basis.at(near), follow, vectors)
        residues = shapes[:, np.newaxis] * (vectors * changes[0][:, np.newaxis]).T
        total += np.ascontiguousarray(residues).view(np.float64) @ basis.slopes[:, near]
        moved = shapes[:, np.newaxis] * changes[1:]
        return np.asarray(total + np.ascontiguousarray(moved).view(np.float64) @ basis.modes[:, near])

    def mass_std(self, mode: int, largest: int, pole: complex) -> Real:
        """``[response, reference]`` of Re(a / (2 j omega_d)), a = (psi_i/psi_c)/(L_j psi_c)."""
        scale = self.shapes[mode, largest]
        vector, ratios = self.participation[mode], self.shapes[mode] / scale
        with np.errstate(divide="ignore", invalid="ignore"):
            mass = ratios[:, np.newaxis] / (vector * scale) / (2j * pole.imag)
            return np.stack(
                [self._mass_std(mode, largest, scale, pole, j, mass[:, j]) for j in range(vector.size)], axis=1
            )

    def _mass_std(
        self, mode: int, largest: int, scale: complex, pole: complex, reference: int, mass: Complex
    ) -> Real:
        own, coupling = self._shape(mode)
        here, there = 1 / (self.participation[mode, reference] * scale**2 * 2j * pole.imag), -2 * mass / scale
        beside = -mass / self.participation[mode, reference]
        tuned = np.zeros((2, self.root.shape[1]))
        tuned[0] = self.root[2 * mode + 1] / pole.imag
        direct = real_matrices(np.full(mass.shape, here))
        through = direct @ coupling + real_matrices(there) @ coupling[largest]
        through += real_matrices(beside) @ self._components(mode)[reference] - real_matrices(mass) @ tuned
        total = direct @ own @ np.swapaxes(direct, -1, -2)
        shared = real_matrices(there)
        total = total + shared @ own[largest] @ np.swapaxes(shared, -1, -2)
        # The largest component is one scatter, seen twice.
        both = direct[largest] + shared[largest]
        total[largest] = both @ own[largest] @ both.T
        return np.asarray(np.sqrt((total + _squared(through))[:, 0, 0]), dtype=np.float64)

    def _shape(self, mode: int) -> tuple[Real, Real]:
        rows = slice(2 * mode, 2 * mode + 2)
        return self.own[:, rows, rows], self.rooted[:, rows]

    def _components(self, mode: int) -> Real:
        """``[reference, 2, direction]`` root of Re, Im of a participation vector."""
        modes, references = self.participation.shape
        return self.root[2 * modes :].reshape(references, modes, 2, -1)[:, mode]


def parameter_spread(lines: ModelLines, solution: ShapeSolution) -> ParameterSpread:
    """Invert the equations of all parameters at the solution."""
    equations = reduced_equations(lines, solution)
    modes, references = solution.participation.shape
    size = 2 * modes * (1 + references)
    theta = np.zeros((size, size))
    theta[np.ix_(equations.free, equations.free)] = symmetric_inverse(equations.curvature)
    coupling = np.zeros((*equations.coupling.shape[:2], size))
    # Shapes and residuals follow the parameters so that the misfit stays least.
    coupling[..., equations.free] = -equations.coupling
    # Poles in rad/s and participation factors are of different size; a common one keeps the digits of both.
    sizes = np.sqrt(np.diag(theta))
    safe = np.where(sizes > 0, sizes, 1.0)
    strengths, directions = np.linalg.eigh(theta / safe[:, np.newaxis] / safe)
    root = sizes[:, np.newaxis] * directions * np.sqrt(np.maximum(strengths, 0.0))
    return ParameterSpread(
        own=solution.inverse,
        coupling=coupling,
        theta=theta,
        root=root,
        rooted=(coupling[:, : 2 * modes].reshape(-1, size) @ root).reshape(-1, 2 * modes, size),
        solution=solution,
    )


def real_matrices(factors: Complex | complex) -> Real:
    """``[..., 2, 2]`` matrices that multiply (Re, Im) by complex factors."""
    factors = np.asarray(factors)
    return np.stack(
        [np.stack([factors.real, -factors.imag], axis=-1), np.stack([factors.imag, factors.real], axis=-1)], axis=-2
    )


def _squared(through: Real) -> Real:
    return np.asarray(through @ np.swapaxes(through, -1, -2), dtype=np.float64)


def _packed(covariance: Real, factors: Complex, further: Real | float = 0.0) -> Complex:
    """One sigma of Re + j one sigma of Im, after multiplication by complex factors, and with further variance."""
    turned = real_matrices(factors) @ covariance @ np.swapaxes(real_matrices(factors), -1, -2)
    variances = np.maximum(np.einsum("...aa->...a", turned), 0.0) + further
    return np.asarray(np.ascontiguousarray(np.sqrt(variances)).view(np.complex128)[..., 0], dtype=np.complex128)

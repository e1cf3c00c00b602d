"""Normal equations for poles and participation, with shapes and residuals eliminated."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.fit.lsfd import ShapeSolution
from chladni.modal.fit.model_lines import ModelLines
from chladni.modal.fit.normal_equations import projections, rotated, rotated_rows, symmetric_inverse, weight_course
from chladni.signals.arrays import Complex, Index, Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedEquations:
    """Curvature and slope of the cost for the parameters that enter nonlinearly.

    Attributes
    ----------
    curvature
        ``[parameter, parameter]`` half the second derivative of the cost (Gauss-Newton).
    descent
        ``[parameter]`` half the negative gradient.
    coupling
        ``[response, coefficient, parameter]`` minus the change of the best coefficients with the parameters.
    free
        ``[parameter]`` places of the free parameters among Re, Im of all poles and then of all participation
        components, reference by reference; the largest component of each vector is fixed at 1.
    """

    curvature: Real
    descent: Real
    coupling: Real
    free: Index

    def promised(self) -> float:
        """What a full step lowers the cost by, to first order."""
        return float(self.descent @ symmetric_inverse(self.curvature) @ self.descent)

    def moved(self, poles: Complex, participation: Complex, damping: float) -> tuple[Complex, Complex]:
        """Take one step, shortened by `damping`."""
        damped = self.curvature + damping * np.diag(np.diag(self.curvature))
        step = np.zeros(2 * poles.size * (1 + participation.shape[1]))
        step[self.free] = symmetric_inverse(damped) @ self.descent
        changes = step.view(np.complex128).reshape(1 + participation.shape[1], poles.size)
        return poles + changes[0], participation + changes[1:].T


def reduced_equations(lines: ModelLines, solution: ShapeSolution) -> ReducedEquations:
    """Set up the equations at the best coefficients for given poles and participation."""
    basis, vectors = solution.basis, solution.participation
    functions = np.concatenate([basis.modes, basis.slopes, basis.residuals])
    course = weight_course(lines.weights, len(vectors))
    responses, references, _ = lines.values.shape
    free = _free(vectors)
    curvature = np.zeros((free.size, free.size))
    descent = np.zeros(free.size)
    coupling = np.empty((responses, solution.coefficients.shape[1], free.size))
    for batch in course.batches(responses, references, len(functions)):
        shapes = solution.shapes.T[batch]
        own, cross = _blocks(course.gram(functions, lines.weights[batch]), shapes, vectors)
        cross = cross[..., free]
        eliminated = solution.inverse[batch] @ cross
        coupling[batch] = eliminated
        curvature += own[np.ix_(free, free)] - np.einsum("icp,icq->pq", cross, eliminated, optimize=True)
        projected = projections(functions[: 4 * len(vectors)], lines.weights[batch] * solution.residual[batch])
        descent += _gradient(projected, shapes, vectors)[free]
    return ReducedEquations(curvature=(curvature + curvature.T) / 2, descent=descent, coupling=coupling, free=free)


def _free(participation: Complex) -> Index:
    modes, references = participation.shape
    free = np.ones((1 + references, modes, 2), dtype=bool)
    # A factor can be moved from shape to participation; this convention takes that freedom away.
    free[1 + np.argmax(np.abs(participation), axis=1), np.arange(modes)] = False
    return np.flatnonzero(free)


def _blocks(gram: Real, shapes: Complex, vectors: Complex) -> tuple[Real, Real]:
    """Products of derivatives to the parameters with each other, summed, and with those to the coefficients."""
    modes, references = vectors.shape
    head = 2 * modes
    value, slope, rest = slice(0, head), slice(head, 2 * head), slice(2 * head, None)
    own = np.zeros(((1 + references) * head, (1 + references) * head))
    cross = np.zeros((len(gram), head + 4 * references, (1 + references) * head))
    for j in range(references):
        here = slice((1 + j) * head, (2 + j) * head)
        tail = slice(head + 4 * j, head + 4 * (j + 1))
        residues = shapes * vectors[:, j]
        # Columns: change of the poles seen through the residue; of the participation seen through the shape.
        by_pole = rotated(gram[:, j, :, slope], residues[:, np.newaxis])
        by_vector = rotated(gram[:, j, :, value], shapes[:, np.newaxis])
        own[:head, :head] += rotated_rows(by_pole[:, slope], residues).sum(axis=0)
        own[:head, here] = rotated_rows(by_vector[:, slope], residues).sum(axis=0)
        own[here, :head] = own[:head, here].T
        own[here, here] = rotated_rows(by_vector[:, value], shapes).sum(axis=0)
        cross[:, :head, :head] += rotated_rows(by_pole[:, value], vectors[:, j])
        cross[:, :head, here] = rotated_rows(by_vector[:, value], vectors[:, j])
        cross[:, tail, :head] = by_pole[:, rest]
        cross[:, tail, here] = by_vector[:, rest]
    return own, cross


def _gradient(projected: Real, shapes: Complex, vectors: Complex) -> Real:
    head = 2 * len(vectors)
    value, slope = projected[..., :head], projected[..., head:]
    residues = shapes[:, np.newaxis] * vectors.T
    poles = rotated(slope, residues).sum(axis=(0, 1))
    components = rotated(value, shapes[:, np.newaxis]).sum(axis=0)
    return np.concatenate([poles, components.ravel()])

"""Least-squares frequency domain: shapes and residuals for given poles and participation."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.modal.fit.modal_basis import ModalBasis, modal_basis
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.model_lines import ModelLines, model_lines
from chladni.modal.fit.normal_equations import (
    combinations,
    projections,
    rotated,
    rotated_rows,
    symmetric_inverse,
    weight_course,
    weighted_power,
)
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import require_shape

# Rounds that bring the solution from the precision of normal equations to that of the data.
REFINEMENTS = 40
SETTLED = 1e-12
ROUGH = 1e-7
RESIDUAL_COLUMNS = 4


def least_squares_frequency_domain(
    response: FrequencyResponse,
    poles: NDArray[np.complexfloating],
    participation: NDArray[np.complexfloating] | None = None,
    *,
    band_hz: tuple[float, float] | None = None,
) -> ModalModel:
    """Fit shapes, lower and upper residuals to frequency responses, for given poles.

    Parameters
    ----------
    response
        Motions over excitations, all in one form (accelerance, mobility, receptance). Lines count by 1/std^2; lines
        that aren't excited or have no value don't count. Where no `std` is known all lines of a function count alike.
    poles
        ``[mode]`` in rad/s, Re < 0 < Im.
    participation
        ``[mode, reference]``, rows of any length but zero; None for a single reference.
    band_hz
        Lines to fit, default all.

    Returns
    -------
    ModalModel
        With the participation that was given: each shape carries the scale of the receptance.

    Raises
    ------
    EstimateError
        When poles and participation don't fit to each other or to the response, or no line is left.

    Notes
    -----
    Peeters, Van der Auweraer, Guillaume & Leuridan (2004), eq. 14, with real and imaginary parts as unknowns, since a
    shape enters with its conjugate. Averages of windowed segments are fitted with the modes as the window shows them
    (see `LagWindow`), so that shapes and residuals are those of the structure.
    """
    lines = model_lines(response, band_hz)
    checked, vectors = checked_modes(response, poles, participation)
    return solve_shapes(lines, modal_basis(lines, checked), vectors).model(checked)


def checked_modes(
    response: FrequencyResponse,
    poles: NDArray[np.complexfloating],
    participation: NDArray[np.complexfloating] | None,
) -> tuple[Complex, Complex]:
    """Check and convert poles and participation; see `least_squares_frequency_domain`."""
    checked = np.asarray(poles, dtype=np.complex128)
    references = len(response.references)
    if participation is None and references != 1:
        raise EstimateError(f"{references} references need participation vectors; give [mode, reference]")
    given = np.ones((checked.size, 1)) if participation is None else participation
    vectors = np.asarray(given, dtype=np.complex128)
    require_shape("participation", vectors, (checked.size, references), "modes x references")
    for pole in checked:
        if not (np.isfinite(pole) and pole.real < 0 < pole.imag):
            raise EstimateError(f"pole {pole:.6g} rad/s is no decaying oscillation; Re < 0 < Im is asked for")
    if not np.all(np.isfinite(vectors)) or not np.all(np.any(vectors != 0, axis=1)):
        raise EstimateError("participation vectors must be finite, none of them zero")
    return checked, vectors


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShapeSolution:
    """Shapes and residuals, and what the equations leave of the data.

    Attributes
    ----------
    coefficients
        ``[response, column]``: Re, Im of each mode's shape, then for each reference four residual coefficients.
    participation
        ``[mode, reference]`` that the shapes were solved for.
    residual
        ``[response, reference, line]`` measured minus model.
    inverse
        ``[response, column, column]`` of the normal equations.
    basis
        The functions that the coefficients combine.
    """

    coefficients: Real
    participation: Complex
    residual: Complex
    inverse: Real
    basis: ModalBasis

    @property
    def shapes(self) -> Complex:
        """``[mode, response]``."""
        modes = len(self.participation)
        return np.ascontiguousarray(self.coefficients[:, : 2 * modes]).view(np.complex128).T

    @property
    def strength(self) -> Real:
        """``[mode]`` root of the sum of squared residues."""
        participation = np.linalg.norm(self.participation, axis=1)
        return np.asarray(np.linalg.norm(self.shapes, axis=1) * participation, dtype=np.float64)

    def model(self, poles: Complex) -> ModalModel:
        """Give the model in terms of lower and upper residual."""
        responses, references = len(self.coefficients), self.participation.shape[1]
        modes = len(self.participation)
        tail = np.ascontiguousarray(self.coefficients[:, 2 * modes :]).view(np.complex128)
        terms = tail.reshape(responses, references, 2) @ self.basis.residual_terms
        return ModalModel(
            poles=poles,
            shapes=self.shapes.copy(),
            participation=self.participation,
            lower=terms[..., 0].copy(),
            upper=terms[..., 1].copy(),
        )


def solve_shapes(
    lines: ModelLines, basis: ModalBasis, participation: Complex, *, enough: float = 0.0
) -> ShapeSolution:
    """Solve the normal equations of every response, then again for what is left of the data.

    Ends when the last digits stand still, or when a round improves the weighted sum of squares by less than `enough`.
    """
    course = weight_course(lines.weights, len(participation))
    responses, references, _ = lines.values.shape
    size = 2 * len(participation) + RESIDUAL_COLUMNS * references
    inverse = np.empty((responses, size, size))
    for batch in course.batches(responses, references, len(basis.functions)):
        gram = course.gram(basis.functions, lines.weights[batch])
        inverse[batch] = symmetric_inverse(shape_equations(gram, participation))
    coefficients, residual = _refined(lines, basis, participation, inverse, enough)
    return ShapeSolution(
        coefficients=coefficients, participation=participation, residual=residual, inverse=inverse, basis=basis
    )


def _refined(
    lines: ModelLines, basis: ModalBasis, participation: Complex, inverse: Real, enough: float
) -> tuple[Real, Complex]:
    """Conjugate gradients on each response's equations, preconditioned by their approximate inverse.

    Where the inverse is exact the first round solves, and the second adds the digits that normal equations lose.
    """
    coefficients = np.zeros(inverse.shape[:2])
    residual = np.array(lines.values, dtype=np.complex128)
    direction, gradient, gain = np.zeros_like(coefficients), np.zeros_like(coefficients), np.ones(len(inverse))
    moved = np.ones(len(inverse))
    for _ in range(REFINEMENTS):
        weighted = lines.weights * residual
        # Far from a fit its last digits are of no use.
        worth = max(enough, ROUGH * float(weighted_power(weighted, residual).sum())) if enough else 0.0
        before, gain_before, moved_before = gradient, gain, moved
        gradient = shape_gradient(projections(basis.functions, weighted), participation)
        step = np.einsum("iab,ib->ia", inverse, gradient)
        gain = np.sum(gradient * step, axis=1)
        again = np.maximum(np.sum((gradient - before) * step, axis=1), 0.0)
        again = np.divide(again, gain_before, out=np.zeros_like(gain), where=gain_before > 0)
        direction = step + again[:, np.newaxis] * direction * np.any(before != 0)
        change = synthesis(basis, direction, participation)
        bend = weighted_power(lines.weights * change, change)
        length = np.divide(np.sum(gradient * direction, axis=1), bend, out=np.zeros_like(gain), where=bend > 0)
        taken = length[:, np.newaxis] * direction
        coefficients += taken
        change *= length[:, np.newaxis, np.newaxis]
        residual -= change
        largest = np.abs(coefficients).max(axis=-1)
        moved = np.abs(taken).max(axis=-1) / np.where(largest > 0, largest, 1.0)
        # The next round would move less than this one, in the same proportion.
        ahead = moved * np.minimum(moved / np.maximum(moved_before, SETTLED), 1)
        if gain.sum() < worth or np.all(ahead <= SETTLED):
            break
    return coefficients, residual


def synthesis(basis: ModalBasis, coefficients: Real, participation: Complex) -> Complex:
    """``[response, reference, line]`` that coefficients make."""
    modes, references = participation.shape
    shapes = np.ascontiguousarray(coefficients[:, : 2 * modes]).view(np.complex128)
    residues = np.ascontiguousarray(shapes[:, np.newaxis] * participation.T)
    tails = coefficients[:, 2 * modes :].reshape(len(coefficients), references, RESIDUAL_COLUMNS)
    return combinations(np.concatenate([residues.view(np.float64), tails], axis=-1), basis.functions)


def shape_equations(gram: Real, participation: Complex) -> Real:
    """Normal matrix of each response from the Gram matrices ``[response, reference, column, column]``."""
    modes, references = participation.shape
    head, size = 2 * modes, 2 * modes + RESIDUAL_COLUMNS * references
    matrix = np.zeros((len(gram), size, size))
    for j in range(references):
        vector = participation[:, j]
        tail = slice(head + RESIDUAL_COLUMNS * j, head + RESIDUAL_COLUMNS * (j + 1))
        matrix[:, :head, :head] += rotated_rows(rotated(gram[:, j, :head, :head], vector), vector)
        matrix[:, :head, tail] = rotated_rows(gram[:, j, :head, head:], vector)
        matrix[:, tail, :head] = np.swapaxes(matrix[:, :head, tail], -1, -2)
        matrix[:, tail, tail] = gram[:, j, head:, head:]
    return matrix


def shape_gradient(projected: Real, participation: Complex) -> Real:
    """Right-hand side of each response from projections ``[response, reference, column]``."""
    head = 2 * len(participation)
    shapes = sum(rotated(projected[:, j, :head], vector) for j, vector in enumerate(participation.T))
    return np.concatenate([np.asarray(shapes), projected[:, :, head:].reshape(len(projected), -1)], axis=1)

"""Maximum-likelihood refinement of a modal model (MLMM)."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.modal.fit.fit_covariance import fitted_modes, no_modes
from chladni.modal.fit.fit_inflation import misfit
from chladni.modal.fit.fitted_modes import FittedModes
from chladni.modal.fit.lsfd import ROUGH, ShapeSolution, checked_modes, solve_shapes
from chladni.modal.fit.modal_basis import modal_basis
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.model_lines import ModelLines, model_lines, reweighted
from chladni.modal.fit.reduced_equations import ReducedEquations, reduced_equations
from chladni.signals.arrays import Complex, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.wording import counted

# A step that moves no pole by more than this share of its decay rate ends the iteration, and so does one that
# improves a fit with known variances by less than this: it is a small part of a sigma.
CONVERGED, ENOUGH = 1e-7, 1e-4
# What is left to gain beyond this shifts the modes by a third of one sigma or more, all together.
UNSETTLED = 0.1
FIRST_DAMPING, LARGEST_DAMPING = 1e-6, 1e6
SLOWEST = 0.99
# Distances of poles in units of decay rates, or of half a line where that is more. A mode further from its start
# answers another question than was asked; two modes nearer to each other are one that the data don't split.
LONGEST_WAY = 10.0
NEAREST = 0.02
# A decay rate below this share of the distance of lines hides between them: who began wider has met a line of noise.
NARROWEST = 0.02


def refine(
    response: FrequencyResponse,
    model: ModalModel,
    *,
    band_hz: tuple[float, float] | None = None,
    max_iterations: int = 25,
) -> FittedModes:
    """Fit poles, participation, shapes and residuals together, so that the misfit weighs least against the noise.

    Parameters
    ----------
    response
        As for `least_squares_frequency_domain`. Where no `std` is known, each function is weighted by what the fit
        leaves of it, and a note says so.
    model
        Where to begin: poles and participation; shapes and residuals are solved for.
    band_hz
        Lines to fit, default all.
    max_iterations
        Steps, at least 0.

    Returns
    -------
    FittedModes
        Modes that leave the lines, run away or run into another mode are left out, and a note says so. Where steps
        run out before the misfit is least, error bars are widened by what is left, with a note.

    Raises
    ------
    EstimateError
        As `least_squares_frequency_domain`.

    Notes
    -----
    El-Kafafy, De Troyer, Peeters & Guillaume (2014): Gauss-Newton with Levenberg's damping on poles and participation
    for the cost sum |H - model|^2/var. Shapes and residuals enter linearly and are eliminated (Golub & Pereyra 1973,
    in the approximation of Kaufman 1975).
    """
    lines = model_lines(response, band_hz)
    poles, vectors = checked_modes(response, model.poles, model.participation)
    kept, notes = np.arange(poles.size), list(lines.notes)
    while kept.size:
        lines, state, left = _fitted(lines, poles[kept], _unit_largest(vectors[kept]), max_iterations)
        lost = lost_mode(lines, poles[kept], state.poles, state.solution.strength)
        if lost is None:
            found = misfit(lines, state.solution, response.provenance)
            if left > UNSETTLED + ROUGH * state.cost:
                # A step to the optimum is as long in sigmas as the root of what it gains.
                found = replace(found, excess=found.excess * (1 + left))
                notes.append(_unsettled(max_iterations, left))
            return fitted_modes(
                lines,
                state.poles,
                state.solution,
                found=found,
                provenance=response.provenance,
                kept=kept,
                notes=tuple(notes),
            )
        notes.append(f"{lost[1]} in the refinement and is left out")
        kept = np.delete(kept, lost[0])
    return no_modes(lines, tuple(notes))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _State:
    """A point of the iteration: nonlinear parameters, the best coefficients for them, and the cost."""

    poles: Complex
    participation: Complex
    solution: ShapeSolution
    cost: float

    @classmethod
    def at(cls, lines: ModelLines, poles: Complex, participation: Complex) -> "_State":
        enough = ENOUGH / 100 if lines.weighted else 0.0
        solution = solve_shapes(lines, modal_basis(lines, poles), participation, enough=enough)
        cost = float(np.sum(lines.weights * np.abs(solution.residual) ** 2))
        return cls(poles=poles, participation=participation, solution=solution, cost=cost)


def _fitted(
    lines: ModelLines, poles: Complex, participation: Complex, max_iterations: int
) -> tuple[ModelLines, _State, float]:
    state, left = _minimise(lines, _State.at(lines, poles, participation), max_iterations)
    if lines.weighted:
        return lines, state, left
    lines = reweighted(lines, state.solution.residual, parameters=state.solution.coefficients.shape[1])
    return lines, *_minimise(lines, _State.at(lines, state.poles, state.participation), max_iterations)


def _minimise(lines: ModelLines, state: _State, max_iterations: int) -> tuple[_State, float]:
    """Step until nothing is worth another step; give what more steps would lower the cost by."""
    damping, gains = FIRST_DAMPING, (0.0, 0.0)
    for _ in range(max_iterations):
        equations = reduced_equations(lines, state.solution)
        # Shorter and shorter steps would be tried in vain where there is nothing to gain.
        if lines.weighted and equations.promised() < ENOUGH:
            return state, 0.0
        found = _step(lines, state, equations, damping)
        if found is None:
            # Without noise to compare with, rounding stops the steps.
            return state, equations.promised() if lines.weighted else 0.0
        trial, damping = found
        moved = np.abs(trial.poles - state.poles) / -state.poles.real
        gains = gains[1], state.cost - trial.cost
        state = trial
        if moved.max() < CONVERGED or (lines.weighted and gains[1] < ENOUGH):
            return state, 0.0
    return state, max(reduced_equations(lines, state.solution).promised(), _geometric_rest(*gains))


def _geometric_rest(before: float, last: float) -> float:
    """Sum of all gains to come, when each is to the one before it as the last was."""
    ratio = min(last / before, SLOWEST) if before > 0 else 0.0
    return last * ratio / (1 - ratio)


def _unsettled(steps: int, left: float) -> str:
    return (
        f"the refinement didn't settle within {counted(steps, 'step')}, and the weighted sum of squares may still "
        f"fall by {left:.2g}: error bars are widened for it; fit fewer modes together, or look at a narrower band"
    )


def _step(
    lines: ModelLines, state: _State, equations: ReducedEquations, damping: float
) -> tuple[_State, float] | None:
    """Take a step that lowers the cost, shorter and shorter until one does; None when none does."""
    while damping < LARGEST_DAMPING:
        poles, participation = equations.moved(state.poles, state.participation, damping)
        if np.all(poles.real < 0) and np.all(poles.imag > 0):
            trial = _State.at(lines, poles, participation)
            if trial.cost <= state.cost:
                return trial, max(damping / 10, FIRST_DAMPING**2)
        damping *= 10
    return None


def _unit_largest(vectors: Complex) -> Complex:
    largest = np.argmax(np.abs(vectors), axis=1)[:, np.newaxis]
    return np.asarray(vectors / np.take_along_axis(vectors, largest, axis=1), dtype=np.complex128)


def lost_mode(lines: ModelLines, began: Complex, poles: Complex, strength: Real) -> tuple[int, str] | None:
    """Find the mode that has most certainly been lost, and say why; None when all are where they should be.

    Parameters
    ----------
    lines
        That were fitted.
    began, poles
        ``[mode]`` poles before and after.
    strength
        ``[mode]`` what each mode adds to the functions; of two that have met, the weaker is lost.
    """
    low, high = lines.frequency_hz[[0, -1]]
    frequency_hz = np.abs(poles) / (2 * np.pi)
    for mode in np.flatnonzero((frequency_hz < low) | (frequency_hz > high)):
        return int(mode), f"{_named(began[mode])} left the band from {low:.6g} to {high:.6g} Hz"
    half_line = np.pi * float(np.median(np.diff(lines.frequency_hz))) if lines.frequency_hz.size > 1 else 0.0
    hidden = (-poles.real < NARROWEST * 2 * half_line) & (-began.real > half_line)
    for mode in np.flatnonzero(hidden):
        return int(mode), f"{_named(began[mode])} ran into a peak that is narrower than the lines can tell"
    seen = np.maximum(-poles.real, half_line)
    way = np.abs(poles - began) / np.maximum(seen, -began.real)
    for mode in np.flatnonzero(way > LONGEST_WAY):
        return int(mode), f"{_named(began[mode])} ran away to {frequency_hz[mode]:.6g} Hz"
    apart = np.abs(poles - poles[:, np.newaxis]) / np.minimum(seen, seen[:, np.newaxis])
    met = np.argwhere(np.triu(apart < NEAREST, k=1))
    for pair in met:
        weaker = int(pair[np.argmin(strength[pair])])
        other = int(pair[np.argmax(strength[pair])])
        return weaker, f"{_named(began[weaker])} ran into the one at {frequency_hz[other]:.6g} Hz"
    return None


def _named(pole: complex) -> str:
    return f"the mode at {abs(pole) / (2 * np.pi):.6g} Hz"

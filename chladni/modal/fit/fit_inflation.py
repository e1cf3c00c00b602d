"""What the scatter of a fit is larger than by, against that of independent lines of known variance."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.fit.line_information import line_correlation_factor
from chladni.modal.fit.lsfd import ShapeSolution
from chladni.modal.fit.model_lines import ModelLines
from chladni.signals.arrays import Real
from chladni.signals.provenance import Provenance

# A misfit is told from chance beyond this many of its own sigmas.
SIGNIFICANT = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Misfit:
    """How far the model is off, against what noise explains.

    Attributes
    ----------
    chi_square
        Weighted sum of squares over degrees of freedom, 1 for noise of the stated variance.
    correlation
        Factor on variances for the correlation of neighbouring lines, where errors are noise.
    efficiency
        Factor on variances for weights that are estimates themselves, at least 1.
    excess
        ``[mode]`` factor on variances for misfit, at least 1.
    """

    chi_square: float
    correlation: float
    efficiency: float
    excess: Real


def misfit(lines: ModelLines, solution: ShapeSolution, provenance: Provenance) -> Misfit:
    """Compare what the model leaves with the noise, over all lines and near each mode."""
    correlation = line_correlation_factor(provenance)
    spared, efficiency = _estimated_weights(lines, provenance)
    normalised = lines.weights * np.abs(solution.residual) ** 2 / (2 * spared)
    used = lines.weights > 0
    parameters = solution.coefficients.size + 2 * solution.participation.size
    free = max(used.sum() - parameters / 2, 1.0)
    chi_square = float(normalised.sum() / free)
    overall = _excess(normalised.sum(), used.sum(), used.sum(), correlation)
    local = _excess(*_near_modes(lines, solution, normalised), correlation)
    return Misfit(
        chi_square=chi_square,
        correlation=correlation,
        efficiency=efficiency,
        excess=np.maximum(local, overall),
    )


def _estimated_weights(lines: ModelLines, provenance: Provenance) -> tuple[float, float]:
    """Expected chi-square, and factor on variances, where weights are estimates from few averages.

    With nu = 2 (n - q) degrees of freedom the mean of sigma^2/s^2 is nu/(nu - 2), and the weighted estimate scatters
    by nu/(nu - 4) more than the weights say (Pintelon & Schoukens 2012, section 12.3, with complex n).
    """
    freedom = 2 * (provenance.effective_averages - lines.values.shape[1])
    if not lines.weighted or provenance.effective_averages <= 0 or freedom <= 4:
        return 1.0, 1.0
    return freedom / (freedom - 2), freedom / (freedom - 4)


def _near_modes(lines: ModelLines, solution: ShapeSolution, normalised: Real) -> tuple[Real, Real, Real]:
    """For each mode the sums of share x square, share and share^2 over all lines of all functions.

    A line's share is what it says about the pole: its weight times the square of the model's slope.
    """
    slopes = np.abs(solution.basis.slopes) ** 2
    density = (slopes[0::2] + slopes[1::2]).T
    modal = np.abs(solution.shapes[:, :, np.newaxis] * solution.participation[:, np.newaxis]) ** 2
    squares = np.moveaxis(modal, 0, -1)
    weights = lines.weights
    return (
        np.sum(squares * ((weights * normalised) @ density), axis=(0, 1)),
        np.sum(squares * (weights @ density), axis=(0, 1)),
        np.sum(squares**2 * (weights**2 @ density**2), axis=(0, 1)),
    )


def _excess(weighted: Real, total: Real, squared: Real, correlation: float) -> Real:
    """Mean square where it is more than chance makes of it, else 1."""
    safe = np.where(total > 0, total, 1.0)
    mean = weighted / safe
    # Mean of independent squares with unequal shares: its own sigma tells chance from misfit.
    scatter = np.sqrt(correlation * squared) / safe
    return np.asarray(np.where(mean > 1 + SIGNIFICANT * scatter, mean, 1.0), dtype=np.float64)

"""Scatter of each mode from noise, leakage and misfit together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.modal.fit_inflation import Misfit
from chladni.modal.leakage_scatter import LeakageScatter, leakage_scatter
from chladni.modal.mode_scatter import ModeScatter
from chladni.modal.model_lines import ModelLines
from chladni.modal.parameter_spread import ParameterSpread
from chladni.signals.provenance import Provenance

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]

# Rounds until the noise level beside the leakage settles.
ROUNDS = 12
# Standard deviations from few averages scatter; leakage that seems to explain everything leaves at least this share.
LEAST_NOISE = 1e-4


def mode_scatter(
    lines: ModelLines, spread: ParameterSpread, poles: Complex, mode: int, found: Misfit, provenance: Provenance
) -> ModeScatter:
    """Estimate how one mode scatters.

    The variance of each line near the mode is taken apart into three: leakage, which the model tells; noise of each
    response, which is flat there; and what goes with abs(H)^2 in all responses alike, as noise of the reference and
    unmeasured forces do. Only the second is independent from response to response.
    """
    excess, base = float(found.excess[mode]), spread.poles()[mode, :, mode]
    leakage = leakage_scatter(lines, poles, mode, provenance) if lines.weighted else None
    if leakage is None:
        factor = excess * found.correlation
        ones = np.full(lines.values.shape[0], factor)
        return ModeScatter(pole=factor * base, shared=factor, shares=ones, amplitude=factor)
    parts = _parts(lines, spread, leakage, _estimated(provenance, lines.values.shape[1]))
    largest = int(np.argmax(np.abs(spread.shapes[mode])))
    rows = [spread.theta[2 * mode], spread.theta[2 * mode + 1]]
    fields = [spread.field(leakage.near, row) for row in (*rows, rows[0] + rows[1])]
    leaks = [parts.leak(field) + found.correlation * parts.common(field) for field in fields]
    both = (leaks[2] - leaks[0] - leaks[1]) / 2
    noise = float(np.mean([parts.noise_share(field) for field in fields[:2]]))
    pole = np.array([[leaks[0], both], [both, leaks[1]]]) + noise * found.correlation * base
    return ModeScatter(
        pole=excess * pole,
        shared=excess * found.correlation * noise,
        shares=excess * found.correlation * parts.own_shares(spread, mode),
        amplitude=excess * _amplitude(spread, parts, mode, largest, found.correlation),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Parts:
    """Lines near a mode, with what leakage and noise are of their variance.

    ``weights, noise[response, reference, line]`` 1/variance, and share of the variance that is noise;
    ``functions[response, reference, line]``, and ``relative[reference]`` what their common error is of their squares;
    ``residues[response, reference, other]``; ``levels[reference, reference]`` power of one reference over another.
    """

    near: slice
    weights: Floats
    noise: Floats
    functions: Complex
    relative: Floats
    residues: Complex
    levels: Floats
    leakage: LeakageScatter

    def noise_share(self, field: Complex) -> float:
        """Share of the variance of an output with this field that noise makes."""
        weighted = self.weights * np.abs(field) ** 2
        total = weighted.sum()
        return float((weighted * self.noise).sum() / total) if total > 0 else 1.0

    def common(self, field: Complex) -> float:
        """Variance that errors in proportion to all responses give to an output, for independent lines."""
        drive = np.einsum("ijk,ijk->jk", self.weights * field.conj(), self.functions)
        return float(np.sum(self.relative[:, np.newaxis] * np.abs(drive) ** 2))

    def leak(self, field: Complex) -> float:
        """Variance that leakage gives to an output with this field."""
        # b[reference, source, other, line]: what a unit error by one source does through the lines of one reference.
        drive = np.einsum("ijk,ilr->jlrk", self.weights * field.conj(), self.residues, optimize=True)
        count, lines = len(self.levels), drive.shape[-1]
        power = (drive * np.sqrt(self.levels)[..., np.newaxis, np.newaxis]).reshape(count**2, -1, lines)
        plain = drive.reshape(count**2, -1, lines), drive.swapaxes(0, 1).reshape(count**2, -1, lines)
        return max(self.leakage.variance(power, plain), 0.0)

    def own_shares(self, spread: ParameterSpread, mode: int) -> Floats:
        """``[response]`` share of noise where each response's own component is read."""
        pair = spread.solution.basis.modes[2 * mode : 2 * mode + 2, self.near]
        density = np.sum(np.abs(pair) ** 2, axis=0)
        said = self.weights * density * (np.abs(spread.participation[mode]) ** 2)[:, np.newaxis]
        total = said.sum(axis=(1, 2))
        return np.asarray(
            np.divide((said * self.noise).sum(axis=(1, 2)), total, out=np.ones_like(total), where=total > 0)
        )


def _estimated(provenance: Provenance, references: int) -> float:
    """What estimated variances exceed those of known moments by: one average is spent on each reference."""
    averages = provenance.effective_averages
    return averages / (averages - references) if averages > references else 1.0


def _parts(lines: ModelLines, spread: ParameterSpread, leakage: LeakageScatter, spent: float) -> _Parts:
    near, weights = leakage.near, lines.weights[..., leakage.near]
    residues = spread.shapes.T[:, np.newaxis, leakage.modes] * spread.participation.T[:, leakage.modes]
    levels = _levels(weights)
    power = np.einsum("ilr,ils,rsk->ilk", residues, residues.conj(), leakage.power(), optimize=True).real / 2
    leak = spent * np.einsum("jl,ilk->ijk", levels, power)
    functions = lines.values[..., near] - spread.solution.residual[..., near]
    noise, relative = _noise_parts(weights, leak, np.abs(functions) ** 2)
    return _Parts(
        near=near,
        weights=weights,
        noise=noise,
        functions=functions,
        relative=relative,
        residues=residues,
        levels=levels,
        leakage=leakage,
    )


def _levels(weights: Floats) -> Floats:
    """``[reference, source]`` power of a source over that of a reference: variances go with 1/power."""
    used = weights > 0
    logs = np.where(used, np.log(np.where(used, weights, 1.0)), 0.0)
    means = logs.sum(axis=(0, 2)) / np.maximum(used.sum(axis=(0, 2)), 1)
    # weight is 1/variance and thus goes with the power of its own reference
    return np.asarray(np.exp(means[np.newaxis, :] - means[:, np.newaxis]))


def _noise_parts(weights: Floats, leak: Floats, squares: Floats) -> tuple[Floats, Floats]:
    """Fit variance = leakage + level of each function + relative of each reference x abs(H)^2.

    Least squares, weighted by the fitted variance again and again; gives the level's share ``[..., line]`` of the
    variance, and relative ``[reference]``.
    """
    used = weights > 0
    variance = np.divide(1.0, weights, out=np.zeros_like(weights), where=used)
    least = LEAST_NOISE * np.mean(variance, axis=-1, keepdims=True)
    level = np.maximum(np.min(np.where(used, variance, np.inf), axis=-1, keepdims=True), least)
    relative = np.zeros((1, squares.shape[1], 1))
    left = variance - leak
    for _ in range(ROUNDS):
        trust = np.where(used, (np.maximum(leak, 0) + level + relative * squares) ** -2.0, 0.0)
        total = np.maximum(np.sum(trust, axis=-1, keepdims=True), np.finfo(float).tiny)
        left_mean, square_mean = (np.sum(trust * part, axis=-1, keepdims=True) / total for part in (left, squares))
        aside = trust * (squares - square_mean)
        size = np.sum(aside * squares, axis=(0, 2), keepdims=True)
        slope = np.sum(aside * left, axis=(0, 2), keepdims=True)
        relative = np.maximum(np.divide(slope, size, out=np.zeros_like(slope), where=size > 0), 0.0)
        level = np.maximum(left_mean - relative * square_mean, least)
    return np.where(used, np.minimum(weights * level, 1.0), 0.0), relative[0, :, 0]


def _amplitude(spread: ParameterSpread, parts: _Parts, mode: int, largest: int, correlation: float) -> float:
    theta, own = spread.amplitude(mode, largest)
    total = base = 0.0
    for row, own_row in zip(theta, own, strict=True):
        field = spread.field(parts.near, row, (largest, own_row))
        plain = float((parts.weights * np.abs(field) ** 2).sum())
        total += parts.leak(field) + correlation * (parts.common(field) + parts.noise_share(field) * plain)
        base += plain
    return total / base if base > 0 else correlation

"""What the errors of frequency responses consist of: leakage, noise of each response, noise of the reference."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.fit.leakage_scatter import NEAR_LINES, LeakageScatter
from chladni.modal.fit.model_lines import ModelLines
from chladni.modal.fit.parameter_spread import ParameterSpread
from chladni.signals.arrays import Complex, Real

# Rounds until the noise level beside the leakage settles.
ROUNDS = 12
# Standard deviations from few averages scatter; leakage that seems to explain everything leaves at least this share.
LEAST_NOISE = 1e-4
# An estimated variance is hardly ever less than the true one by more than this.
CERTAIN = 4.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorParts:
    """Errors on a stretch of lines.

    Attributes
    ----------
    near
        The lines.
    weights
        ``[response, reference, line]`` of the fit.
    noise
        ``[response, reference, line]`` variance of the noise of responses.
    functions, relative
        ``[response, reference, line]`` the model, and ``[reference]`` variance of the common error over its square.
    residues, slopes
        ``[response, reference, felt]`` and ``[response, reference, line]``: sizes of the sources of leakage.
    levels
        ``[reference, source]`` power of one reference over another.
    leakage
        Moments of the sources.
    """

    near: slice
    weights: Real
    noise: Real
    functions: Complex
    relative: Real
    residues: Complex
    slopes: Complex
    levels: Real
    leakage: LeakageScatter

    def drives(self, fields: Complex) -> tuple[Complex, Complex]:
        """What common errors do to outputs whose derivative of the model is ``fields[output, i, j, line]``.

        Gives b of leakage ``[output, reference, source reference, source, line]`` and of the common error
        ``[output, reference, line]``.
        """
        weighted = self.weights * fields.conj()
        felt = np.einsum("qijk,ilr->qjlrk", weighted, self.residues, optimize=True)
        rest = np.einsum("qijk,ilk->qjlk", weighted, self.slopes)[..., np.newaxis, :]
        return np.concatenate([felt, rest], axis=-2), np.einsum("qijk,ijk->qjk", weighted, self.functions)

    def each_drives(self, fields: Complex) -> tuple[Complex, Complex]:
        """Give the same through one response only, for outputs ``[i, output, j, line]``, with i as the first axis."""
        weighted = self.weights[:, np.newaxis] * fields.conj()
        felt = np.einsum("iqjk,ilr->iqjlrk", weighted, self.residues, optimize=True)
        rest = np.einsum("iqjk,ilk->iqjlk", weighted, self.slopes)[..., np.newaxis, :]
        return np.concatenate([felt, rest], axis=-2), weighted * self.functions[:, np.newaxis]

    def common_variance(self, leak: Complex, common: Complex) -> Real:
        """``[...]`` variance that errors common to all responses give to outputs."""
        pairs = (*leak.shape[:-4], -1, *leak.shape[-2:])
        power = (leak * np.sqrt(self.levels)[..., np.newaxis, np.newaxis]).reshape(pairs)
        plain = leak.reshape(pairs), leak.swapaxes(-4, -3).reshape(pairs)
        relative = np.sum(self.relative * self.leakage.noise_variance(common), axis=-1)
        return np.asarray(np.maximum(self.leakage.variance(power, plain), 0.0) + relative)

    def noise_variance(self, fields: Complex) -> Real:
        """``[output, response]`` variance by noise of each response, for ``fields[output, i, j, line]``."""
        variances = self.leakage.noise_variance(self.weights * np.sqrt(self.noise) * fields.conj())
        return np.asarray(variances.sum(axis=-1))


def error_parts(
    lines: ModelLines, spread: ParameterSpread, stretches: tuple[LeakageScatter, ...]
) -> tuple[ErrorParts, ...]:
    """Take the variances of all lines apart, stretch by stretch."""
    functions = lines.values - spread.solution.residual
    levels = _levels(lines.weights)
    sources = [_sources(lines, spread, functions, stretch) for stretch in stretches]
    leak = np.concatenate(
        [_leak(stretch, *source, levels) for stretch, source in zip(stretches, sources, strict=True)], axis=-1
    )
    answer = []
    for stretch, (residues, slopes) in zip(stretches, sources, strict=True):
        # Noise is looked at over enough lines to tell its level.
        around = slice(max(stretch.near.start - NEAR_LINES, 0), stretch.near.stop + NEAR_LINES)
        level, relative = _noise_parts(
            lines.weights[..., around], leak[..., around], np.abs(functions[..., around]) ** 2
        )
        weights = lines.weights[..., stretch.near]
        least = np.divide(CERTAIN, weights, out=np.zeros_like(weights), where=weights > 0)
        answer.append(
            ErrorParts(
                near=stretch.near,
                weights=weights,
                noise=np.minimum(level[..., np.newaxis], least),
                functions=functions[..., stretch.near],
                relative=relative,
                residues=residues,
                slopes=slopes,
                levels=levels,
                leakage=stretch,
            )
        )
    return tuple(answer)


def _sources(
    lines: ModelLines, spread: ParameterSpread, functions: Complex, stretch: LeakageScatter
) -> tuple[Complex, Complex]:
    """Residues of the felt modes, and the slope in lines of all else."""
    residues = spread.shapes.T[:, np.newaxis, stretch.modes] * spread.participation.T[:, stretch.modes]
    modes = spread.solution.basis.modes[:, stretch.near]
    direct = (modes[0::2] - 1j * modes[1::2])[stretch.modes] / 2
    rest = functions[..., stretch.near] - np.einsum("ilr,rk->ilk", residues, direct)
    if rest.shape[-1] < 2 or lines.window is None:
        return residues, np.zeros_like(rest)
    return residues, np.gradient(rest, lines.frequency_hz[stretch.near] * lines.window.segment_s, axis=-1)


def _leak(stretch: LeakageScatter, residues: Complex, slopes: Complex, levels: Real) -> Real:
    """``[response, reference, line]`` variance along H that leakage makes."""
    lines = slopes.shape[-1]
    sizes = np.concatenate(
        [np.repeat(residues[..., np.newaxis], lines, axis=-1), slopes[..., np.newaxis, :]], axis=-2
    )
    power = np.einsum("ilrk,ilsk,rsk->ilk", sizes, sizes.conj(), stretch.apparent, optimize=True).real / 2
    return np.asarray(np.einsum("jl,ilk->ijk", levels, power))


def _levels(weights: Real) -> Real:
    """``[reference, source]`` power of a source over that of a reference: variances go with 1/power."""
    used = weights > 0
    logs = np.where(used, np.log(np.where(used, weights, 1.0)), 0.0)
    means = logs.sum(axis=(0, 2)) / np.maximum(used.sum(axis=(0, 2)), 1)
    # weight is 1/variance and thus goes with the power of its own reference
    return np.asarray(np.exp(means[np.newaxis, :] - means[:, np.newaxis]))


def _noise_parts(weights: Real, leak: Real, squares: Real) -> tuple[Real, Real]:
    """Fit variance = leakage + level of each function + relative of each reference x abs(H)^2.

    Least squares, weighted by the fitted variance again and again; gives level ``[response, reference]`` and relative
    ``[reference]``.
    """
    used = weights > 0
    variance = np.divide(1.0, weights, out=np.zeros_like(weights), where=used)
    level = np.min(np.where(used, variance, np.inf), axis=-1, keepdims=True)
    least = LEAST_NOISE * level
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
    return level[..., 0], relative[0, :, 0]

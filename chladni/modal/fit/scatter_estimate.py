"""Scatter of each mode from noise, leakage and misfit together."""

import numpy as np

from chladni.modal.fit.error_parts import ErrorParts, error_parts
from chladni.modal.fit.fit_inflation import Misfit
from chladni.modal.fit.leakage_scatter import leakage_scatter
from chladni.modal.fit.lsfd import synthesis
from chladni.modal.fit.mode_scatter import ModeScatter
from chladni.modal.fit.model_lines import ModelLines
from chladni.modal.fit.parameter_spread import ParameterSpread, real_matrices
from chladni.signals.arrays import Complex, Real
from chladni.signals.provenance import Provenance

Parts = tuple[ErrorParts, ...]

# Some twenty seconds of work. Beyond, lines are taken for independent but for what the window makes of neighbours.
MOST_PRODUCTS = 1 << 24


def mode_scatters(
    lines: ModelLines, spread: ParameterSpread, poles: Complex, found: Misfit, provenance: Provenance
) -> list[ModeScatter]:
    """Estimate how each mode scatters.

    Each output of the fit is a weighted sum of the errors of all lines. Its variance is added up from what the errors
    consist of: leakage, which the model tells; noise of each response; and what goes with H in all responses alike,
    as noise of the reference does. Only the second is independent from response to response; the others hardly move
    ratios of components, but not nothing, since neighbouring modes and residuals have a share in H.
    """
    parted = lines.weighted and not too_many(lines, poles.size)
    stretches = leakage_scatter(lines, poles, provenance) if parted else ()
    if not stretches:
        return [_independent(lines, spread, found, mode) for mode in range(poles.size)]
    parts = error_parts(lines, spread, stretches)
    drives = _parameter_drives(spread, parts)
    return [_scatter(spread, parts, drives, mode, float(found.excess[mode])) for mode in range(poles.size)]


def too_many(lines: ModelLines, modes: int) -> bool:
    """Whether errors of leakage are too many to be followed from line to line, function to function, mode to mode."""
    responses, references, count = lines.values.shape
    return lines.window is not None and modes * responses * references**2 * count > MOST_PRODUCTS


def _independent(lines: ModelLines, spread: ParameterSpread, found: Misfit, mode: int) -> ModeScatter:
    """Lines that are as good as independent, or of one unknown variance."""
    factor = float(found.excess[mode] * found.efficiency * found.correlation)
    responses = lines.values.shape[0]
    return ModeScatter(
        pole=factor * spread.poles()[mode, :, mode],
        shared=factor,
        shares=np.full(responses, factor),
        common=np.zeros((responses, 2)),
        amplitude=factor,
    )


def _scatter(
    spread: ParameterSpread, parts: Parts, drives: list[tuple[Complex, Complex]], mode: int, excess: float
) -> ModeScatter:
    largest = int(np.argmax(np.abs(spread.shapes[mode])))
    base = spread.poles()[mode, :, mode]
    rows = spread.theta[2 * mode], spread.theta[2 * mode + 1]
    totals, noises = np.zeros(3), np.zeros(3)
    for part, (leak, common) in zip(parts, drives, strict=True):
        if mode not in part.leakage.modes:
            continue
        pair = slice(2 * mode, 2 * mode + 2)
        totals += part.common_variance(_with_sum(leak[pair]), _with_sum(common[pair]))
        fields = np.stack([spread.field(part.near, row) for row in (*rows, rows[0] + rows[1])])
        noises += part.noise_variance(fields).sum(axis=-1)
    shares, shapes = _shapes(spread, parts, drives, mode, largest)
    return ModeScatter(
        pole=excess * _matrix(totals + noises),
        shared=excess * float(np.mean(noises[:2] / np.diag(base))),
        shares=excess * shares,
        common=excess * shapes,
        amplitude=excess * _amplitude(spread, parts, mode, largest),
    )


def _felt(parts: Parts, mode: int) -> list[ErrorParts]:
    """Stretches that say something about a pole: those within reach of its mode."""
    return [part for part in parts if mode in part.leakage.modes]


def _with_sum(pair: Complex) -> Complex:
    return np.concatenate([pair, pair.sum(axis=0, keepdims=True)])


def _matrix(variances: Real) -> Real:
    """Covariance of two numbers from the variances of each and of their sum."""
    both = (variances[2] - variances[0] - variances[1]) / 2
    return np.array([[variances[0], both], [both, variances[1]]])


def _parameter_drives(spread: ParameterSpread, parts: Parts) -> list[tuple[Complex, Complex]]:
    """What common errors do through all responses to each parameter, stretch by stretch.

    The parameters of modes that a stretch doesn't feel are left at zero: their lines are elsewhere.
    """
    return [_drives_of(spread, part) for part in parts]


def _drives_of(spread: ParameterSpread, part: ErrorParts) -> tuple[Complex, Complex]:
    rows = _rows(spread, part)
    references, lines = part.functions.shape[1:]
    sources = (references, references, part.residues.shape[2] + 1, lines)
    leak = np.zeros((len(spread.theta), *sources), dtype=np.complex128)
    common = np.zeros((len(spread.theta), references, lines), dtype=np.complex128)
    for row in rows:
        one = part.drives(spread.field(part.near, spread.theta[row])[np.newaxis])
        leak[row], common[row] = one[0][0], one[1][0]
    return leak, common


def _rows(spread: ParameterSpread, part: ErrorParts) -> list[int]:
    """Rows of the parameters of the modes that a stretch feels: Re and Im of poles, then of each participation."""
    modes = len(spread.shapes)
    return [row for row in range(len(spread.theta)) if (row // 2) % modes in part.leakage.modes]


def _shapes(
    spread: ParameterSpread, parts: Parts, drives: list[tuple[Complex, Complex]], mode: int, largest: int
) -> tuple[Real, Real]:
    """``[response]`` factor of own noise; ``[response, 2]`` variance of component over largest by common errors."""
    pair = slice(2 * mode, 2 * mode + 2)
    scale = spread.shapes[mode, largest]
    turned = real_matrices(np.full(spread.shapes[mode].shape, 1 / scale))
    beside = turned @ real_matrices(spread.shapes[mode] / scale)
    coupling = spread.coupling[:, pair]
    through = turned @ coupling - beside @ coupling[largest]
    noise, variance = np.zeros(len(turned)), np.zeros((len(turned), 2))
    # All of them: an error common to all responses reaches ratios of components through residuals and neighbours.
    for part, (leak, common) in zip(parts, drives, strict=True):
        basis = spread.solution.basis.at(part.near)
        own = [synthesis(basis, spread.own[:, row], spread.participation) for row in (2 * mode, 2 * mode + 1)]
        fields = np.stack(own, axis=1)
        noise += part.noise_variance(fields.swapaxes(0, 1)).sum(axis=0)
        mine = part.each_drives(fields)
        total = [
            _combined(turned, one) - np.tensordot(beside, one[largest], axes=1) + np.tensordot(through, other, axes=1)
            for one, other in zip(mine, (leak, common), strict=True)
        ]
        variance += part.common_variance(total[0], total[1])
    variance[largest] = 0
    plain = np.einsum("iaa->i", spread.own[:, pair, pair])
    return np.divide(noise, plain, out=np.ones_like(plain), where=plain > 0), variance


def _combined(matrices: Real, pairs: Complex) -> Complex:
    """Products of ``[response, 2, 2]`` with ``[response, 2, ...]``."""
    flat = pairs.reshape(*pairs.shape[:2], -1)
    return np.asarray(matrices @ flat).reshape(pairs.shape)


def _amplitude(spread: ParameterSpread, parts: Parts, mode: int, largest: int) -> float:
    theta, own = spread.amplitude(mode, largest)
    total = base = 0.0
    for part in _felt(parts, mode):
        for row, own_row in zip(theta, own, strict=True):
            field = spread.field(part.near, row, (largest, own_row))[np.newaxis]
            base += float((part.weights * np.abs(field[0]) ** 2).sum())
            total += float(part.common_variance(*part.drives(field))[0] + part.noise_variance(field).sum())
    return total / base if base > 0 else 1.0

"""What a force of any shape at one place could print of a change, by reciprocity of a modal model."""

import numpy as np
from scipy.optimize import minimize

from chladni.gap.calibration import SIGMAS, SLIGHT
from chladni.gap.location.modal_paths import ModalPaths
from chladni.signals.arrays import Complex, Real


def pattern_losses(paths: ModalPaths, direction: Real, change: Complex) -> Real:
    """Square ``[line]`` of what forces of any shape, one number a line and level, leave of a change.

    The pattern is ``sum_r c_r modal_r + known + sum_t u_t outside_t`` with c within two sigma of what reciprocity
    gives for this place; u, which no measurement gave, is free. Both are fitted, the same for all lines.

    Parameters
    ----------
    paths
        Of the modal model.
    direction
        ``[output]`` of the force over the sensors.
    change
        ``[level, output, line]``.
    """
    expected, std = paths.weights(direction)
    known, outside = paths.outside_of(direction)
    spread = np.maximum(std, SLIGHT * np.abs(expected).max())
    centre = np.tensordot(expected, paths.modal, 1) + known
    # Steps of one sigma, and of the size of the pattern for what nothing is known of.
    size = np.sqrt(np.mean(np.abs(centre) ** 2))
    steps = np.concatenate([spread[:, None, None] * paths.modal, size * outside])
    products = np.einsum("lok,lpk->opk", change, change.conj())
    found = minimize(
        _missed,
        np.zeros(len(steps)),
        args=(centre, steps, products),
        jac=True,
        method="L-BFGS-B",
        bounds=[(-SIGMAS, SIGMAS)] * len(spread) + [(None, None)] * len(outside),
    )
    pattern = centre + np.tensordot(found.x, steps, 1)
    return np.asarray(np.sum(np.abs(_off(pattern, change)) ** 2, axis=(0, 1)))


def _missed(weights: Real, centre: Complex, steps: Complex, products: Complex) -> tuple[float, Real]:
    """Mean over lines of what a pattern misses, ``tr C - g^H C g/(g^H g)``, and its slope over the weights."""
    g = centre + np.tensordot(weights, steps, 1)
    size = np.sum(np.abs(g) ** 2, axis=0) + np.finfo(float).tiny
    met = np.einsum("opk,pk->ok", products, g)
    along = np.sum(g.conj() * met, axis=0).real / size
    slope = -2 * np.einsum("tok,ok->t", steps.conj(), (met - g * along) / size, optimize=True).real
    lines = g.shape[1]
    return float(np.einsum("ook->", products).real - along.sum()) / lines, slope / lines


def one_direction_share(change: Complex) -> float:
    """Share of a change that lies along one direction a line, the same at all levels: what one place could print."""
    values = np.linalg.svd(change.transpose(2, 0, 1), compute_uv=False)
    return float(np.sum(values[:, 0] ** 2) / np.sum(values**2))


def _off(pattern: Complex, change: Complex) -> Complex:
    """Take what lies along ``[output, line]`` from ``[level, output, line]``."""
    size = np.sqrt(np.sum(np.abs(pattern) ** 2, axis=0))
    unit = pattern / np.where(size > 0, size, 1.0)
    along = np.einsum("ok,lok->lk", unit.conj(), change)
    return np.asarray(change - unit * along[:, None])

"""What a force leaves of a change: one that follows a motion along any path, and one of any shape at one place."""

import numpy as np
from scipy.optimize import minimize

from chladni.gap.calibration import MOST_STEPS, SIGMAS, SLIGHT, UNNOTICED
from chladni.gap.location.modal_paths import ModalPaths
from chladni.signals.arrays import Complex, Real


def unseen_losses(blocks: Complex, forces: Complex, change: Complex) -> Real:
    """Square of what a force that follows a motion leaves of a change, on lines that the fit hasn't seen.

    The model is ``change = sum_t p_t blocks_t  sum_f c_f forces_f`` with real p (the path) and c (the law), the same
    at all lines and levels. Every other line is fitted, the rest predicted, and the other way round.

    Parameters
    ----------
    blocks
        ``[block, output, line]``, see `ModalPaths`.
    forces
        ``[level, function, line]``, see `LevelChange.forces_of`.
    change
        ``[level, output, line]``.

    Returns
    -------
    ``[line]``
    """
    losses = np.sum(np.abs(change) ** 2, axis=(0, 1))
    lines = np.arange(change.shape[2])
    if not forces.shape[1]:
        return np.asarray(losses)
    for fold in range(2):
        seen, unseen = lines % 2 != fold, lines % 2 == fold
        path, law = _fitted(*_products(blocks[..., seen], forces[..., seen], change[..., seen]))
        printed = _printed(path, law, blocks[..., unseen], forces[..., unseen])
        losses[unseen] = np.sum(np.abs(change[..., unseen] - printed) ** 2, axis=(0, 1))
    return np.asarray(losses)


def _printed(path: Real, law: Real, blocks: Complex, forces: Complex) -> Complex:
    """``[level, output, line]``."""
    force = np.einsum("f,lfk->lk", law, forces)
    return np.asarray(force[:, None] * np.tensordot(path, blocks, 1))


def _products(blocks: Complex, forces: Complex, change: Complex) -> tuple[Real, Real]:
    """Normal equations of all products of a block of the path and a function of the motion.

    They are ``gram [block, block', function, function']`` and ``right [block, function]``, real.
    """
    along = np.einsum("tok,uok->tuk", blocks.conj(), blocks)
    acting = np.einsum("lfk,lgk->fgk", forces.conj(), forces)
    lines = along.shape[2]
    gram = (along.reshape(-1, lines) @ acting.reshape(-1, lines).T).real
    met = np.einsum("tok,lok->tlk", blocks.conj(), change)
    right = np.einsum("tlk,lfk->tf", met, forces.conj()).real
    return gram.reshape(*along.shape[:2], *acting.shape[:2]), right


def _fitted(gram: Real, right: Real) -> tuple[Real, Real]:
    """Path and law whose product explains most: one after the other, from the best free product's first part."""
    size = right.size
    free = _solved(gram.transpose(0, 2, 1, 3).reshape(size, size), right.ravel(), loading=SLIGHT)
    law = np.linalg.svd(free.reshape(right.shape), full_matrices=False)[2][0]
    path, reached = np.zeros(len(right)), 0.0
    for _ in range(MOST_STEPS):
        path = _solved(np.einsum("tufg,f,g->tu", gram, law, law, optimize=True), right @ law)
        law = _solved(np.einsum("tufg,t,u->fg", gram, path, path, optimize=True), path @ right)
        # At its least-squares law a path explains this much power.
        explained = float(path @ right @ law)
        if explained - reached <= UNNOTICED * explained:
            break
        reached = explained
    return path, law


def _solved(gram: Real, right: Real, *, loading: float = UNNOTICED) -> Real:
    loaded = gram + loading * (np.trace(gram) / len(gram) + np.finfo(float).tiny) * np.eye(len(gram))
    return np.asarray(np.linalg.solve(loaded, right))


def pattern_losses(paths: ModalPaths, direction: Real, change: Complex) -> Real:
    """Square ``[line]`` of what forces of any shape, one number a line and level, leave of a change.

    The pattern is ``sum_r c_r modal_r + known + sum_t u_t outside_t`` with c within two sigma of what reciprocity
    gives for this place; u, which no measurement gave, is free. Both are fitted, the same for all lines. The
    direction is the ``[output]`` of the force over the sensors, the change ``[level, output, line]``.
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

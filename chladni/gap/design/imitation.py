"""How well one candidate can imitate another: what a refit leaves of the difference of their predictions."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import PROFILE_STEPS, ROUNDING
from chladni.gap.design.rival import Prediction, Rival
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.bounded_step import bounded_step
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True)
class Part:
    """One record that is imitated.

    Attributes
    ----------
    sums
        ``[window, output, column, column]`` of products, see `sums_of`.
    scale
        ``[output]`` mean square of the whitened residual that isn't held against a candidate.
    samples
        Of the record.
    """

    sums: Real
    scale: Real
    samples: int


def sums_of(wanted: Real, prediction: Prediction, noise: NoiseFloor, windows: Sequence[tuple[int, int]]) -> Real:
    """Sum products over the samples of each window, ``[window, output, column, column]``.

    Columns are the whitened difference ``[output, sample]`` of what is wanted and predicted, the slopes by the
    unknowns, and those by the initial states; a constant of each output is taken out. Any choice of outputs and
    weights is a sum of these.
    """
    columns = np.concatenate([(wanted - prediction.outputs)[None], prediction.own, prediction.starts])
    white = noise.whitened(columns)
    white -= white.mean(axis=-1, keepdims=True)
    flat = np.swapaxes(white, 0, 1)
    parts = [flat[..., start:stop] for start, stop in windows]
    return np.stack([one @ np.swapaxes(one, 1, 2) for one in parts])


def imitated(rival: Rival, at: Real, parts: Sequence[Part]) -> tuple[Real, list[Real]]:
    """Refit a candidate by one linear step to what another one predicts, to all records at once.

    The step makes ``sum_j N_j/2 ln(v_j + delta_j) + z.z/2`` least, with v_j the scale of output j, N_j its samples,
    and delta_j the mean square of the whitened difference that is left.

    Parameters
    ----------
    at
        ``[unknown]`` where the slopes in `parts` were taken.

    Returns
    -------
    at
        ``[unknown]`` where the step ends.
    left
        delta ``[output]`` of each part.
    """
    left = [part.sums[..., 0, 0].sum(axis=0) / part.samples for part in parts]
    step = np.zeros(rival.unknowns)
    for _ in range(PROFILE_STEPS):
        weighed = [
            np.tensordot(part.sums, 1.0 / (part.scale + one), axes=([1], [0]))
            for part, one in zip(parts, left, strict=True)
        ]
        step, starts = _solved(rival, at, np.concatenate(weighed))
        whole = np.concatenate([np.ones((len(starts), 1)), np.tile(-step, (len(starts), 1)), -starts], axis=1)
        first, left = 0, []
        for part in parts:
            own = whole[first : first + len(part.sums)]
            first += len(part.sums)
            found = np.einsum("wk,wokl,wl->o", own, part.sums, own) / part.samples
            left.append(np.maximum(found, 0.0))
    return at + step, left


def _solved(rival: Rival, at: Real, sums: Real) -> tuple[Real, Real]:
    """Best step and initial states ``[window, state]`` from weighed sums ``[window, column, column]``."""
    known = rival.unknowns
    per = _eliminated(sums, known)
    cross = sums[:, known + 1 :, : known + 1]
    rest = (sums[:, : known + 1, : known + 1] - np.swapaxes(cross, 1, 2) @ per).sum(axis=0)
    curvature = rest[1:, 1:] + np.diag(rival.sure)
    gradient = -rest[1:, 0] + rival.sure * (at - rival.believed)
    low, high = np.minimum(rival.low - at, 0.0), np.maximum(rival.high - at, 0.0)
    step = bounded_step(curvature, gradient, low, high, damping=0.0)
    return step, per[:, :, 0] - per[:, :, 1:] @ step


def _eliminated(sums: Real, known: int) -> Real:
    """Best initial states for the difference and for each unknown, ``[window, state, 1 + unknown]``."""
    local, cross = sums[:, known + 1 :, known + 1 :], sums[:, known + 1 :, : known + 1]
    size = np.einsum("wkk->wk", local)
    # States that print nothing keep a one in the scaled equations.
    root = np.sqrt(np.where(size > 0, size, 1.0))
    scaled = local / root[:, :, None] / root[:, None, :]
    scaled += np.eye(local.shape[-1]) * np.where(size > 0, ROUNDING, 1.0)[:, None, :]
    return np.asarray(np.linalg.solve(scaled, cross / root[:, :, None]) / root[:, :, None], dtype=np.float64)

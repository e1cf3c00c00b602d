"""Tuning of a model: over windows so short that no resonance is missed, then over longer ones."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.fit_problem import Z_LIMIT
from chladni.gap.tuning.output_error import OutputErrorFit, fit_output_error
from chladni.models.effects.attached_effect import AttachedEffect

Matrix = NDArray[np.float64]
#: By how many radians a mode may drift from its measured counterpart within a window, one sigma.
_DRIFT = 0.5
#: The same where laws act: what they do takes longer to show, and they pull the modes along.
_DRIFT_WITH_LAWS = 1.5
#: Change of ln(frequency) at which its slope is taken.
_APART = 1e-4
#: Iterations over each length of window but the last.
_ITERATIONS = 6
#: A step over windows that lowers the misfit by less than two per cent is the last, in nats for each sample.
_ROUGHLY = 0.01
#: Windows grow by this at least and at most.
_LEAST_GROWTH, _MOST_GROWTH = 4.0, 16.0


def tune_linear(
    run: FreeRun,
    noise: NoiseFloor,
    *,
    training: NDArray[np.bool_] | None = None,
    z_limit: float | Mapping[str, float] = Z_LIMIT,
    start_z: Matrix | None = None,
    offsets: bool = True,
    max_iterations: int = 25,
) -> OutputErrorFit:
    """Fit the parameters of a model to a log, from nominal values whose resonances lie elsewhere.

    Where nominal and measured resonances are further apart than they are wide, the error of a free run has a minimum
    at every parameter but the right one. Within a short enough window the two can't drift apart, when the state at
    its start is free (multiple shooting: Bock 1981). What the short windows leave uncertain about the natural
    frequencies says how long the next may be, up to the whole record.

    Arguments, result and errors are those of `fit_output_error`. A model with laws is fitted over the record at once.
    """
    z = np.zeros(len(run.tunables.names)) if start_z is None else np.asarray(start_z, dtype=np.float64)
    covariance = np.eye(z.size)
    if not run.compiled(z).laws:
        longest = max(stop - start for start, stop in run.windows)
        length = _length(run, z, covariance, 0.0, _DRIFT)
        while 2 * length < longest:
            found = fit_output_error(
                _in_windows(run, length), noise, training=training, start_z=z, z_limit=z_limit, offsets=offsets,
                max_iterations=_ITERATIONS, precision=_ROUGHLY * run.measurement.samples * run.rows.size,
            )  # fmt: skip
            z = found.z
            length = _length(run, z, found.covariance, float(length), _DRIFT)
    return fit_output_error(
        run, noise, training=training, start_z=z, z_limit=z_limit, offsets=offsets, max_iterations=max_iterations
    )


def fit_in_windows(
    run: FreeRun,
    noise: NoiseFloor,
    *,
    effects: Sequence[AttachedEffect],
    fitted: Sequence[Sequence[str]] | None = None,
    training: NDArray[np.bool_] | None = None,
    z_limit: float | Mapping[str, float] = Z_LIMIT,
    start_z: Matrix | None = None,
    offsets: bool = True,
    max_iterations: int = 12,
) -> OutputErrorFit:
    """Fit effects and parameters over short windows first, each from its own start, then over the record.

    For laws whose free run jumps between branches or parts from its neighbours (backlash, stops, hardening): over
    short windows the cost is smooth, and a start that is wrong by a factor of three is good enough. Costs about as
    much as another `fit_output_error`, whose arguments, result and errors it has.
    """
    z = np.zeros(len(run.tunables.names)) if start_z is None else np.asarray(start_z, dtype=np.float64)
    length = _length(run, z, np.eye(z.size), 0.0, _DRIFT_WITH_LAWS)
    if 2 * length < max(stop - start for start, stop in run.windows):
        found = fit_output_error(
            _in_windows(run, length), noise, effects=effects, fitted=fitted, training=training, start_z=z,
            z_limit=z_limit, offsets=offsets, max_iterations=_ITERATIONS,
            precision=_ROUGHLY * run.measurement.samples * run.rows.size,
        )  # fmt: skip
        z, effects = found.z, found.effects
    return fit_output_error(
        run, noise, effects=effects, fitted=fitted, training=training, start_z=z,
        z_limit=z_limit, offsets=offsets, max_iterations=max_iterations,
    )  # fmt: skip


def _length(run: FreeRun, z: Matrix, covariance: Matrix, before: float, most: float) -> int:
    """Samples in which no mode drifts by more than `most` radians, as far as the parameters are known."""
    rate = run.measurement.sample_rate_hz
    omega = _frequencies(run, z)
    slopes = np.zeros((omega.size, z.size))
    for place in range(z.size):
        moved = z.copy()
        moved[place] += _APART
        slopes[:, place] = (_frequencies(run, moved) - omega) / _APART
    drift = np.sqrt(np.maximum(np.einsum("mi,ij,mj->m", slopes, covariance, slopes), 0.0))
    # What oscillates faster than a log can show plays no part.
    drift = drift[omega < np.pi * rate]
    length = most * rate / max(drift.max(initial=0.0), 1e-300)
    fewest = 8 + 4 * len(run.compiled(z).states) / run.rows.size
    if before:
        length = np.clip(length, _LEAST_GROWTH * before, _MOST_GROWTH * before)
    return int(np.clip(length, fewest, run.measurement.samples))


def _frequencies(run: FreeRun, z: Matrix) -> Matrix:
    """``[mode]`` natural frequencies in rad/s, by size."""
    poles = np.linalg.eigvals(run.compiled(z).a)
    return np.sort(np.abs(poles[poles.imag > 0]))


def _in_windows(run: FreeRun, length: int) -> FreeRun:
    samples = run.measurement.samples
    edges = np.round(np.linspace(0, samples, max(1, samples // length) + 1)).astype(int).tolist()
    return FreeRun(run.model, run.measurement, tolerance=run.tolerance, windows=list(pairwise(edges)))

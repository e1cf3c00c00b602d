"""Runs of a model on which no law acts: the exact recursion under inputs, and what follows from where it starts."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.plant.laid_inputs import LaidInputs
from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import responses
from chladni.models.integrator.hold import Hold, hold_of
from chladni.models.integrator.march import linear_march
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError


def is_plain(compiled: CompiledModel) -> bool:
    """Whether a model is a recursion from sample to sample, whose runs cost less than slopes along them.

    It has no laws, no dead times in loops and no clocks that read between samples.
    """
    return not (compiled.laws or compiled.delays or any(compiled.output_offsets_s))


def one_step(a: Real, b: Real, hold: Hold, sample_rate_hz: float) -> Real:
    """``[state, state + width]``: one step of the states under signals that enter by b, spread over the hold."""
    return responses(
        a,
        b,
        np.zeros((len(b), 0)),
        hold,
        step_s=1.0 / sample_rate_hz,
        kink_at=hold.kink_at,
        fractions=np.ones(1),
    )[0].state


def linear_outputs(
    laid: LaidInputs, compiled: CompiledModel, rows: Whole, windows: Sequence[tuple[int, int]], initial: Real
) -> Real:
    """Give ``[output, sample]`` of the outputs `rows`, before maps of samples, from ``initial [window, state]``.

    A model that diverges is a `ModelError`.
    """
    hold = hold_of(compiled, laid.sample_rate_hz)
    inputs = laid.rows(compiled, hold)
    advance = np.ascontiguousarray(one_step(compiled.a, hold.spread(compiled.b), hold, laid.sample_rate_hz).T)
    state = np.zeros((len(inputs), len(compiled.states)))
    for (start, stop), first in zip(windows, initial, strict=True):
        state[start] = first
        linear_march(advance, inputs[start:stop], state[start:stop])
    ends = state[[stop - 1 for _, stop in windows]]
    if not np.all(np.isfinite(ends)):
        raise ModelError("the model diverges within the log; a loop is unstable, or a parameter is impossible")
    through = hold.spread(compiled.d[rows])
    return np.asarray(compiled.c[rows] @ state.T + through @ inputs[:, : hold.columns].T)


def decay(compiled: CompiledModel, rows: Whole, sample_rate_hz: float, count: int) -> Real:
    """Give ``[state, output, sample]``: outputs `rows` of the linear part from a unit of each state, ``C e^(A t)``.

    By doubling: what follows after the first samples is the same from the state that is reached there.
    """
    from scipy.linalg import expm

    n = len(compiled.states)
    found = np.zeros((count, rows.size, n))
    if not n or not count:
        return np.ascontiguousarray(found.T)
    balanced, scale = balance(compiled.a)
    power = np.asarray(expm(balanced / sample_rate_hz) * (scale[:, None] / scale), dtype=np.float64)
    found[0], done = compiled.c[rows], 1
    # A free run of an unstable model leaves the numbers; whoever asks for it gets infinity, and refuses the step.
    with np.errstate(over="ignore", invalid="ignore"):
        while done < count:
            more = min(done, count - done)
            found[done : done + more] = found[:more] @ power
            power, done = power @ power, done + more
    return np.ascontiguousarray(found.T)

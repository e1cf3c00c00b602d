"""Runs of a model on which no law acts: the exact recursion under inputs, and what follows from where it starts."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.plant.laid_inputs import LaidInputs
from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import responses
from chladni.models.integrator.hold import hold_of
from chladni.models.integrator.march import linear_march
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError


def is_plain(compiled: CompiledModel) -> bool:
    """Whether a model is a recursion from sample to sample: no laws, nothing that looks back or reads in between."""
    return not (compiled.laws or compiled.delays or any(compiled.output_offsets_s))


def can_run(compiled: CompiledModel) -> bool:
    """Whether slopes along a run are worth it: there are laws, dead times in loops, clocks that read between samples.

    All else is a recursion from sample to sample, whose runs cost less than slopes along them.
    """
    return not is_plain(compiled)


class LinearRuns:
    """Linear free runs under the inputs of one log."""

    def __init__(self, inputs: LaidInputs) -> None:
        self._inputs, self._rate_hz = inputs, inputs.sample_rate_hz

    def outputs(
        self, compiled: CompiledModel, rows: Whole, windows: Sequence[tuple[int, int]], initial: Real
    ) -> Real:
        """Give ``[output, sample]`` of the outputs `rows`, before maps of samples, from ``initial [window, state]``.

        A model that diverges is a `ModelError`.
        """
        hold = hold_of(compiled, self._rate_hz)
        inputs = self._inputs.rows(compiled, hold)
        b, g = hold.spread(compiled.b), np.zeros((len(compiled.states), 0))
        step = responses(
            compiled.a, b, g, hold,
            step_s=1.0 / self._rate_hz, kink_at=hold.kink_at, fractions=np.ones(1),
        )[0].state  # fmt: skip
        advance = np.ascontiguousarray(step.T)
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

"""Force of one law along a motion that is known beforehand: what a press or a test rig measures.

Much faster than a model with a prescribed displacement, and smooth in the law's parameters since its steps are fixed:
both are what a fit needs.
"""

import numpy as np

from chladni.models.core.port_law import PortLaw
from chladni.models.integrator.machine_code import call_law, law_address, machine_code, part_code
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError


def force_along_motion(law: PortLaw, displacement: Real, velocity: Real, times_s: Real, *, substeps: int = 4) -> Real:
    """Force ``[sample]`` of a law whose port moves as given.

    Between samples the velocity runs along a straight line; the law's states are integrated by the classical
    Runge-Kutta method of fourth order (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table
    1.2).
    A law whose rates depend on the displacement sees that on a straight line too.

    Parameters
    ----------
    law
        Starts in its own initial state.
    displacement, velocity
        ``[sample]``, m and m/s.
    times_s
        ``[sample]``, rising; steps may differ.
    substeps
        Steps between two samples.

    Returns
    -------
    NaN from where the law's states grow beyond all numbers, which says that the steps are too long for it.

    Raises
    ------
    ModelError
        When shapes differ, times don't rise, or there's no step.
    """
    d, v, t = (np.ascontiguousarray(each, dtype=np.float64) for each in (displacement, velocity, times_s))
    if not d.shape == v.shape == t.shape or d.ndim != 1:
        raise ModelError(f"known motion: shapes {d.shape}, {v.shape}, {t.shape}; all are [sample]")
    if substeps < 1 or np.any(np.diff(t) <= 0):
        raise ModelError("known motion: times must rise and every interval needs a step")
    state = np.array(law.state, dtype=np.float64)
    # The only memory: kernels allocate nothing.
    work = np.zeros((6, state.size))
    force = np.full(d.size, np.nan)
    numbers = np.array(law.parameters, dtype=np.float64)
    # Laws take addresses; the arrays behind them live until the march has ended.
    address = np.array([law_address(law.function), numbers.ctypes.data, work.ctypes.data], dtype=np.int64)
    _march(address, d, v, t, substeps, state, work, force)
    return force


@machine_code
def _march(address: Whole, d: Real, v: Real, t: Real, substeps: int, state: Real, work: Real, force: Real) -> None:
    # work: trial state, rates of the four stages, rates that only a force is asked with.
    for sample in range(t.size):
        if sample > 0:
            _advance(address, d, v, t, sample, substeps, state, work)
        for place in range(state.size):
            if not np.isfinite(state[place]):
                return
            work[0, place] = state[place]
        force[sample] = _asked(address, d[sample], v[sample], t[sample], work.shape[1], 5)


@part_code
def _advance(address: Whole, d: Real, v: Real, t: Real, sample: int, substeps: int, state: Real, work: Real) -> None:
    span = t[sample] - t[sample - 1]
    step, rise, go = span / substeps, v[sample] - v[sample - 1], d[sample] - d[sample - 1]
    for substep in range(substeps):
        for stage in range(4):
            reach = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for place in range(state.size):
                work[0, place] = state[place] + (reach * step * work[stage, place] if stage > 0 else 0.0)
            at = (substep + reach) / substeps
            here, now = d[sample - 1] + at * go, v[sample - 1] + at * rise
            _asked(address, here, now, t[sample - 1] + at * span, work.shape[1], 1 + stage)
        for place in range(state.size):
            slope = work[1, place] + 2.0 * (work[2, place] + work[3, place]) + work[4, place]
            state[place] += step / 6.0 * slope


@part_code
def _asked(address: Whole, d: float, s: float, t: float, width: int, row: int) -> float:
    """Force of the law in the trial state; its rates go to a row of the work memory."""
    return call_law(address[0], d, s, t, address[1], address[2], address[2] + 8 * row * width)

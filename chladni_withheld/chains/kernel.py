"""The integrator of the hidden physics.

Classical Runge-Kutta of fourth order at many steps a sample, on ``x' = A x + B e``, where e holds the driving signals
and then what each law gives. A law sees ``d = Dx x + De e`` and ``s = Sx x + Se e`` with the e of the laws before it.
"""

from typing import Any

import numpy as np

from chladni_withheld.chains.equations import DELAY
from chladni_withheld.chains.laws import any_law, compiled


@compiled
def dot(row: Any, x: Any, count: int) -> float:
    """Scalar product of the first `count` numbers."""
    total = 0.0
    for k in range(count):
        total += row[k] * x[k]
    return total


@compiled
def delayed(history: Any, step: float) -> float:
    """What a signal was at a step, which may lie between two; nothing before the start."""
    if step < 0.0:
        return 0.0
    before = int(step)
    share = step - before
    return float((1.0 - share) * history[before] + share * history[before + 1])


@compiled
def rates(x: Any, t: float, step: float, h: float, e: Any, system: Any, law: Any, history: Any, out: Any) -> None:
    """Write the rates of all states to `out`, and what the laws give to `e`."""
    a, b, inputs = system
    number, first, numbers, d_x, d_e, s_x, s_e = law
    states = a.shape[0]
    for k in range(number.size):
        d = dot(d_x[k], x, states) + dot(d_e[k], e, inputs + k)
        if number[k] == DELAY:
            e[inputs + k] = delayed(history[k], step - numbers[k, 0] / h)
            continue
        s = dot(s_x[k], x, states) + dot(s_e[k], e, inputs + k)
        own = slice(states + first[k], x.size)
        e[inputs + k] = any_law(number[k], d, s, t, numbers[k], x[own], out[own])
    for i in range(states):
        out[i] = dot(a[i], x, states) + dot(b[i], e, e.size)


@compiled
def remember(x: Any, e: Any, step: int, system: Any, law: Any, history: Any) -> None:
    """Write down what delays will give later."""
    a, _, inputs = system
    number, _, _, d_x, d_e, _, _ = law
    for k in range(number.size):
        if number[k] == DELAY:
            history[k, step] = dot(d_x[k], x, a.shape[0]) + dot(d_e[k], e, inputs + k)


@compiled
def record(x: Any, e: Any, step: int, steps: int, observed: Any, y: Any) -> None:
    """Write outputs whose sample falls on this step; an output may be read a few steps early or late."""
    c, d, shift = observed
    for r in range(c.shape[0]):
        place = step + shift[r]
        if place % steps == 0 and 0 <= place // steps < y.shape[1]:
            y[r, place // steps] = dot(c[r], x, c.shape[1]) + dot(d[r], e, e.size)


@compiled
def march(signals: Any, interval: float, steps: int, start: Any, system: Any, law: Any, observed: Any,
          start_s: float, y: Any) -> bool:  # fmt: skip
    """Integrate from the first sample to the last; False when the states leave all bounds.

    Parameters
    ----------
    signals
        ``[input, sample]``, joined by straight lines.
    interval, steps
        Seconds of a sample, and steps in it.
    start
        All states at the first sample, those of laws behind those of the equations.
    system
        ``(A, B, number of inputs)``.
    law
        ``(number, first own state, numbers, Dx, De, Sx, Se)``, a row for each law.
    observed
        ``(C, D, shift in steps)``; outputs go to `y`, ``[output, sample]``.
    start_s
        Time of the first sample.
    """
    inputs, count = signals.shape
    size = start.size
    h = interval / steps
    x, stage = start.copy(), np.empty(size)
    k1, k2, k3, k4 = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    e = np.zeros(inputs + law[0].size)
    delays = law[0].size if np.any(law[0] == DELAY) else 0
    history = np.zeros((delays, (count - 1) * steps + 2 if delays else 1))
    for step in range((count - 1) * steps + 1):
        sample, inside = step // steps, (step % steps) / steps
        after = min(sample + 1, count - 1)
        t = start_s + step * h
        for i in range(inputs):
            e[i] = signals[i, sample] + (signals[i, after] - signals[i, sample]) * inside
        rates(x, t, float(step), h, e, system, law, history, k1)
        if delays:
            remember(x, e, step, system, law, history)
        record(x, e, step, steps, observed, y)
        for i in range(inputs):
            e[i] += (signals[i, after] - signals[i, sample]) * 0.5 / steps
        for i in range(size):
            stage[i] = x[i] + 0.5 * h * k1[i]
        rates(stage, t + 0.5 * h, step + 0.5, h, e, system, law, history, k2)
        for i in range(size):
            stage[i] = x[i] + 0.5 * h * k2[i]
        rates(stage, t + 0.5 * h, step + 0.5, h, e, system, law, history, k3)
        for i in range(inputs):
            e[i] += (signals[i, after] - signals[i, sample]) * 0.5 / steps
        for i in range(size):
            stage[i] = x[i] + h * k3[i]
        rates(stage, t + h, step + 1.0, h, e, system, law, history, k4)
        largest = 0.0
        for i in range(size):
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
            largest = max(largest, abs(x[i]))
        if not largest < 1e12:
            return False
    return True


@compiled
def recur(transition: Any, now: Any, after: Any, signals: Any, states: Any) -> None:
    """Write ``x[k+1] = T x[k] + N u[k] + A u[k+1]`` to `states`, ``[sample, state]``; its first row is given."""
    for k in range(states.shape[0] - 1):
        for i in range(states.shape[1]):
            total = 0.0
            for j in range(states.shape[1]):
                total += transition[i, j] * states[k, j]
            for j in range(signals.shape[0]):
                total += now[i, j] * signals[j, k] + after[i, j] * signals[j, k + 1]
            states[k + 1, i] = total

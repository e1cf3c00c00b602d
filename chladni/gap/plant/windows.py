"""Windows for models that a free run leaves behind: free axes drift, unstable ones run away."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from chladni.gap.calibration import QUARTER, ROUNDING, SHORTEST_WINDOW, THIRDS, TIMES, USUAL_S, ZERO
from chladni.gap.records.measurement import Measurement
from chladni.models.core.model import Model
from chladni.signals.arrays import Complex, Mask


def windows_for(model: Model, measurement: Measurement) -> tuple[tuple[int, int], ...] | None:
    """Give windows ``(start, stop)`` in samples that together are the record, or None when one free run will do.

    A pole that is not damped within the record (a rigid-body motion, an integrator, one that grows) makes a free run
    depend on its start for ever: what is predicted then is a window, from an estimated initial state. It lasts three
    times the slowest of the model's other times, at most three times that in which a growing motion grows by e.
    """
    return short_windows(model, measurement) if _lasting(_poles(model), measurement.duration_s).any() else None


def short_windows(model: Model, measurement: Measurement) -> tuple[tuple[int, int], ...]:
    """Give windows as `windows_for` does, for any model."""
    rate, samples = measurement.sample_rate_hz, measurement.samples
    length = np.clip(_longest_s(model, measurement) * rate, SHORTEST_WINDOW, max(SHORTEST_WINDOW, QUARTER * samples))
    count = max(1, round(samples / float(length)))
    edges = np.round(np.linspace(0, samples, count + 1)).astype(int).tolist()
    return tuple(pairwise(edges))


def nested_windows(
    model: Model, measurement: Measurement, windows: Sequence[tuple[int, int]]
) -> list[tuple[tuple[int, int], ...]]:
    """Give parts of windows, as long as the slowest of the model's own times, and what they grow to by threes.

    The last before the windows themselves is the last that's given; there's none when they are as short already.
    """
    length = max(_longest_s(model, measurement) / TIMES * measurement.sample_rate_hz, SHORTEST_WINDOW)
    parts = max(max(1, round((stop - start) / length)) for start, stop in windows)
    finest = [np.round(np.linspace(start, stop, parts + 1)).astype(int).tolist() for start, stop in windows]
    found = []
    while parts > 1:
        found.append(tuple(pair for edges in finest for pair in pairwise(edges)))
        finest = [[*edges[:-1:THIRDS], edges[-1]] for edges in finest]
        parts = len(finest[0]) - 1
    return found


def training_in_windows(windows: Sequence[tuple[int, int]]) -> Mask:
    """Give ``[sample]``: True where fits may look, False in the middle third of every window.

    Each window begins at a state of its own, which only its own samples tell. A window that a fit hardly sees would
    be predicted from a start that nothing determines; what comes before and after the middle does.

    Examples
    --------
    >>> training_in_windows([(0, 6), (6, 9)]).astype(int)
    array([1, 1, 0, 0, 1, 1, 1, 0, 1])
    """
    training = np.ones(windows[-1][1], dtype=np.bool_)
    for start, stop in windows:
        third = (stop - start) // THIRDS
        training[start + third : stop - third] = False
    return training


def _poles(model: Model) -> Complex:
    return np.asarray(np.linalg.eigvals(model.compile().a), dtype=np.complex128)


def _lasting(poles: Complex, duration_s: float) -> Mask:
    """Poles that stay still within the record, or grow; a mode that rings as long is damped all the same."""
    slow = np.abs(poles) * duration_s < 1.0
    grows = poles.real > ROUNDING * np.maximum(np.abs(poles), 1.0 / duration_s)
    return np.asarray(slow | grows)


def _longest_s(model: Model, measurement: Measurement) -> float:
    """Seconds of a window that shows all that the model does of itself."""
    poles = _poles(model)
    return _horizon_s(poles, _lasting(poles, measurement.duration_s))


def _horizon_s(poles: Complex, lasting: Mask) -> float:
    own = poles[~lasting]
    times = np.maximum(-1.0 / np.minimum(own.real, -ZERO), 0.0)
    # Of what oscillates a few cycles show all there is, however long it rings.
    times = np.where(
        np.abs(own.imag) > 0,
        np.minimum(times, 2 * np.pi / np.maximum(np.abs(own.imag), ZERO)),
        times,
    )
    horizon = TIMES * float(times.max()) if own.size else USUAL_S
    growth = float(poles.real.max(initial=-np.inf))
    return min(horizon, TIMES / growth) if growth > 0 and lasting.any() else horizon

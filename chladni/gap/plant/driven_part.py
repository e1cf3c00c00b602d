"""What only the inputs can have driven: signals less all that the starts of windows could give."""

import numpy as np

from chladni.gap.calibration import ROUNDING
from chladni.gap.plant.free_run import FreeRun
from chladni.signals.arrays import Real


def driven_parts(run: FreeRun) -> tuple[Real, Real]:
    """Give ``[output, sample]`` of the log, and of the linear model from rest, without what a start can give.

    A free axis is where it began to be: most of its position is its start. What is left of both signals, once every
    pattern that an initial state of the window prints is taken off (least squares, output by output), only the
    inputs can have driven; its scale is the model's.

    Raises
    ------
    ModelError
        When the model diverges.
    """
    # Laws would make the patterns depend on one another; friction from rest isn't friction of a machine in motion.
    linear = FreeRun(run.model.with_effects(()), run.measurement, windows=run.windows)
    driven = linear.outputs()
    patterns = [linear.outputs(initial=start) - driven for start in np.eye(len(linear.compiled().states))]
    # A sensor's offset is no motion.
    patterns.append(np.ones_like(driven))
    return _without(run.measurement.outputs, patterns, run.windows), _without(driven, patterns, run.windows)


def _without(signals: Real, patterns: list[Real], windows: tuple[tuple[int, int], ...]) -> Real:
    left = signals.copy()
    for start, stop in windows:
        for row, signal in enumerate(left[:, start:stop]):
            basis = _basis(np.array([pattern[row, start:stop] for pattern in patterns]))
            left[row, start:stop] = signal - (signal @ basis) @ basis.T
    return left


def _basis(patterns: Real) -> Real:
    """Orthonormal ``[sample, direction]`` of ``[pattern, sample]``, whatever their sizes."""
    size = np.linalg.norm(patterns, axis=1, keepdims=True)
    shapes = np.divide(patterns, size, out=np.zeros_like(patterns), where=size > 0)
    directions, share, _ = np.linalg.svd(shapes.T, full_matrices=False)
    return np.asarray(directions[:, share > ROUNDING * share[0]])

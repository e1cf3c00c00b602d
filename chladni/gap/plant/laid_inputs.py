"""Inputs of one log as rows of steps, laid out once for all models that take them alike."""

from math import factorial

import numpy as np

from chladni.gap.calibration import KEPT
from chladni.gap.plant.kept import Kept
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.hold import Hold
from chladni.models.integrator.input_rows import input_rows
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


class LaidInputs:
    """Rows of steps, see `Hold`, of ``signals [input, sample]`` of a whole record.

    Most effects and all parameters leave the inputs as they are.
    """

    def __init__(self, signals: Real, sample_rate_hz: float) -> None:
        self._signals, self.sample_rate_hz = signals, sample_rate_hz
        self._kept: Kept[Real] = Kept(KEPT)

    def rows(self, compiled: CompiledModel, hold: Hold, parts: int = 1) -> Real:
        """Give ``[step, width]``; the same array for models that take the inputs alike.

        Parameters
        ----------
        parts
            Steps between samples.

        Raises
        ------
        ModelError
            When an input can't be late by less than nothing, or has a kink that parts can't hold.
        """
        key = (
            compiled.inputs, compiled.input_maps, compiled.input_delays_s, compiled.generated, hold.width, parts,
        )  # fmt: skip
        return self._kept.get(key, lambda: self._laid(compiled, hold, parts))

    def _laid(self, compiled: CompiledModel, hold: Hold, parts: int) -> Real:
        rows = input_rows(compiled, hold, self._signals, self.sample_rate_hz, extra=0)
        return _finer(rows, hold, parts, 1.0 / self.sample_rate_hz)


def _finer(rows: Real, hold: Hold, parts: int, step_s: float) -> Real:
    """Rows of steps that are a part of the interval between samples."""
    if parts == 1:
        return rows
    if hold.kinked.size:
        raise ModelError("an input with a kink can't be divided")
    finer = np.repeat(rows, parts, axis=0).reshape(len(rows), parts, -1)
    share = np.arange(parts) / parts
    for column in range(hold.columns):
        # Taylor's series along the rates up to the rise of the last: of a plain input it's a straight line.
        *chain, rise = hold.places(column)
        terms = [rows[:, place] * step_s**power / factorial(power) for power, place in enumerate(chain)]
        terms.append(rows[:, rise] * step_s ** (len(chain) - 1) / factorial(len(chain)))
        finer[:, :, column] = np.einsum("tn,ts->ns", terms, share ** np.arange(len(terms))[:, None])
    finer[:, :, hold.columns :] /= parts
    # The last row is the value at the end, with nothing after it.
    return np.asarray(finer.reshape(len(rows) * parts, -1)[: (len(rows) - 1) * parts + 1])

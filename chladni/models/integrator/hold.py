"""How inputs run between two samples: straight lines, splines of prescribed motions, kinks of delayed signals."""

from dataclasses import dataclass

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Real, Whole

#: A prescribed motion is a spline of degree 5: the signal and four rates, the last of which is a straight line.
CHAIN = 5
#: A dead time this close to a whole number of samples, in samples, is a whole number.
_WHOLE = 1e-9


@dataclass(frozen=True, slots=True)
class Hold:
    """Internal columns of u and how they run inside a step.

    A row of a step is ``[start, rise, kink, jump]``: the value of each column at the start of the step, the rise over
    the step of each straight column, and for each delayed input the change of its rise and of its value where the
    delayed sample falls.

    Attributes
    ----------
    source
        ``[column]`` column of the compiled model, -1 for one that only the spline needs.
    rate
        ``[column]`` place of the column that holds its rate, -1 for a straight line.
    straight
        ``[straight]`` columns that run along straight lines.
    kinked
        ``[kink]`` columns whose delayed samples fall inside the steps.
    kink_at
        ``[kink]`` where, as a fraction of the step between two samples, above 0 and below 1.
    """

    source: Whole
    rate: Whole
    straight: Whole
    kinked: Whole
    kink_at: Real

    @property
    def columns(self) -> int:
        """Internal columns."""
        return int(self.source.size)

    @property
    def width(self) -> int:
        """Length of the row of a step."""
        return self.columns + self.straight.size + 2 * self.kinked.size

    def spread(self, matrix: Real) -> Real:
        """Give ``[row, internal column]`` of a matrix ``[row, column]`` that multiplies u."""
        padded = np.hstack([matrix, np.zeros((matrix.shape[0], 1))])
        return padded[:, self.source]

    def generator(self, step_s: float) -> Real:
        """``[column + straight, column + straight]``: rates of the columns and of the rises (none) of one step."""
        size = self.columns + self.straight.size
        matrix = np.zeros((size, size))
        chained = np.flatnonzero(self.rate >= 0)
        matrix[chained, self.rate[chained]] = 1.0
        matrix[self.straight, self.columns + np.arange(self.straight.size)] = 1.0 / step_s
        return matrix


def split_delay(delay_s: float, sample_rate_hz: float) -> tuple[int, float]:
    """Whole samples and the rest, a fraction from 0 to below 1, of a dead time.

    Examples
    --------
    >>> split_delay(0.0025, 1000.0)
    (2, 0.5)
    """
    samples = delay_s * sample_rate_hz
    nearest = round(samples)
    if abs(samples - nearest) <= _WHOLE * max(1.0, abs(samples)):
        return nearest, 0.0
    whole = int(np.floor(samples))
    return whole, samples - whole


def hold_of(compiled: CompiledModel, sample_rate_hz: float) -> Hold:
    """Lay out the internal columns of a compiled model."""
    source: list[int] = []
    rate: list[int] = []
    kinked: list[int] = []
    kink_at: list[float] = []
    for place, terminal in enumerate(compiled.inputs):
        first, taken = compiled.column_of(terminal.name), 1 + terminal.derivatives
        if terminal.derivatives:
            rate += [len(source) + order + 1 for order in range(CHAIN - 1)] + [-1]
            source += [first + order if order < taken else -1 for order in range(CHAIN)]
            continue
        fraction = split_delay(compiled.input_delays_s[place], sample_rate_hz)[1]
        if fraction:
            kinked.append(len(source))
            kink_at.append(fraction)
        source.append(first)
        rate.append(-1)
    for extra in range(len(compiled.generated)):
        source.append(compiled.columns - len(compiled.generated) + extra)
        rate.append(-1)
    rates = np.asarray(rate, dtype=np.int64)
    return Hold(
        source=np.asarray(source, dtype=np.int64),
        rate=rates,
        straight=np.flatnonzero(rates < 0).astype(np.int64),
        kinked=np.asarray(kinked, dtype=np.int64),
        kink_at=np.asarray(kink_at),
    )

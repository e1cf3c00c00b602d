"""How inputs run between two samples: held, straight, band-limited; splines of prescribed motions; dead time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import HoldKind, Terminal
from chladni.models.integrator.band_limited import nodes, rates, through_nodes
from chladni.signals.arrays import Complex, Real, Whole
from chladni.signals.errors import ModelError

#: A prescribed motion is a spline of degree 5: the signal and four rates, the last of which is a straight line. A
#: band-limited signal is a polynomial of this degree in each step, of a higher one where its derivatives act too.
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
    held
        ``[column]`` straight columns that keep their value over a step.
    """

    source: Whole
    rate: Whole
    straight: Whole
    kinked: Whole
    kink_at: Real
    held: Whole = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

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

    def inner(self, column: int) -> int:
        """Internal column of a column of u."""
        return int(np.flatnonzero(self.source == column)[0])

    def chain(self, column: int) -> list[int]:
        """Give a column and those of its rates, one after another."""
        found = [column]
        while self.rate[found[-1]] >= 0:
            found.append(int(self.rate[found[-1]]))
        return found

    def rise_of(self, column: int) -> int:
        """Place of the rise of a straight column in the row of a step."""
        return self.columns + int(np.searchsorted(self.straight, column))

    def places(self, column: int) -> Whole:
        """Places in the row of a step of all that makes up one input: value, rates, rise of the last of them."""
        chain = self.chain(column)
        return np.array([*chain, self.rise_of(chain[-1])], dtype=np.int64)

    def carried(self, column: int, cycles: Real, sample_rate_hz: float) -> Complex:
        """``[place, line]``: what stands at the `places` of an input whose samples are ``exp(2j pi cycles k)``."""
        degree = len(self.chain(column))
        if column in self.held:
            return np.stack([np.ones(cycles.size), np.zeros(cycles.size)]).astype(np.complex128)
        wave = np.exp(2j * np.pi * nodes(degree)[:, None] * cycles)
        return np.asarray(rates(through_nodes(degree) @ wave, sample_rate_hz), dtype=np.complex128)

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
    held: list[int] = []
    for place, (terminal, kind) in enumerate(zip(compiled.inputs, compiled.holds, strict=True)):
        first, taken, length = compiled.column_of(terminal.name), 1 + terminal.derivatives, chained(terminal, kind)
        if length > 1:
            rate += [len(source) + order + 1 for order in range(length - 1)] + [-1]
            source += [first + order if order < taken else -1 for order in range(length)]
            continue
        if kind == "zoh":
            held.append(len(source))
        fraction = split_delay(compiled.input_delays_s[place], sample_rate_hz)[1]
        if fraction:
            kinked.append(len(source))
            kink_at.append(fraction)
        source.append(first)
        rate.append(-1)
    for extra in range(len(compiled.generated)):
        source.append(compiled.columns - len(compiled.generated) + extra)
        rate.append(-1)
    return _laid_out(source, rate, kinked, kink_at, held)


def free_hold(count: int) -> Hold:
    """Lay out signals that nobody sampled, such as forces: band-limited, one after another."""
    last = np.tile([1] * (CHAIN - 1) + [0], count)
    places = np.arange(count * CHAIN)
    return _laid_out(np.where(places % CHAIN, -1, places // CHAIN), np.where(last, places + 1, -1), [], [], [])


def chained(terminal: Terminal, kind: HoldKind) -> int:
    """Columns that one input takes inside: itself and its rates.

    Raises
    ------
    ModelError
        When an input whose rate acts too is held.
    """
    if kind == "band_limited":
        return CHAIN + terminal.derivatives
    if not terminal.derivatives:
        return 1
    if kind == "zoh":
        raise ModelError(
            f"input {terminal.name!r} is held (zoh), and its rate acts too, which is infinite where it jumps; "
            'write hold = "foh" or "band_limited"'
        )
    return CHAIN


def _laid_out(source: ArrayLike, rate: ArrayLike, kinked: ArrayLike, kink_at: ArrayLike, held: ArrayLike) -> Hold:
    rates_at = np.asarray(rate, dtype=np.int64)
    return Hold(
        source=np.asarray(source, dtype=np.int64),
        rate=rates_at,
        straight=np.flatnonzero(rates_at < 0).astype(np.int64),
        kinked=np.asarray(kinked, dtype=np.int64),
        kink_at=np.asarray(kink_at, dtype=np.float64),
        held=np.asarray(held, dtype=np.int64),
    )

"""The linear part of a model on the lines of a record: forced response, patterns of port forces, transients."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import schur

from chladni.gap.calibration import ROUNDING
from chladni.gap.plant.linear_run import one_step
from chladni.gap.plant.record_lines import RecordLines
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.hold import free_hold, hold_of
from chladni.models.integrator.input_rows import input_rows
from chladni.signals.arrays import Complex, Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """How a force at a port (a change of an input, an error of an output) enters the equations, line by line.

    Attributes
    ----------
    states
        ``[state, line]``.
    outputs
        ``[output, line]`` what passes at once.
    carried
        ``[place, line]``: what stands in the row of a step, see `Hold.places`, of a force (change) of one; no places
        for an error of an output.
    port
        Index of the port, None for an input's or output's own samples.
    column
        Column of u of an input's own samples, None for all else.
    """

    states: Complex
    outputs: Complex
    carried: Complex
    port: int | None = None
    column: int | None = None


class View(Protocol):
    """A plant on the lines of a record, linear in forces; see `LinearView`."""

    compiled: CompiledModel
    lines: RecordLines
    #: Share of their power by which patterns of one place may differ.
    rounding: float

    def forced(self) -> Complex:
        """``[output, segment, line]`` under the log's inputs."""

    def response(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[output, segment, line]`` under inputs, transients and forces."""

    def states(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[state, segment, line]`` under the same."""

    def motion(
        self, port: int, transient: Real | None, forces: Sequence[tuple[Way, Complex]]
    ) -> tuple[Complex, Complex]:
        """Displacement and velocity ``[segment, line]`` at a port, under the same."""

    def transients(self) -> Complex:
        """``[state, output, line]``: what one of each state more at the start prints."""

    def pattern(self, way: Way) -> Complex:
        """``[output, line]`` that a force of one prints."""

    def way_of_port(self, port: int) -> Way:
        """Way of a force at a port."""

    def way_of_input(self, name: str) -> Way:
        """Way of a change of an input."""

    def way_of_output(self, place: int) -> Way:
        """Way of an error of the sensor in row `place` of the measured outputs."""


class LinearView:
    """Linear equations of a compiled model, sampled, on the lines of a record.

    With ``x[k+1] = Phi x[k] + Gamma r[k]``, exact for inputs that run between samples as their holds say, the
    transform of a record of N samples satisfies ``z X = Phi X + Gamma R + z delta`` on every line, with
    ``delta = x[N] - x[0]`` negated: a start in motion and the cut-off end are n unknown numbers, not leakage
    (Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., section 6.3.2, in discrete
    time). Of a band-limited input the rows are such that ``(z I - Phi)^-1 Gamma R = (j omega I - A)^-1 B U`` (chapter
    13), but for the polynomials' share, see `band_limited`: and a record needs no periods for it.

    Parameters
    ----------
    compiled
        The model; laws and maps of samples are left out.
    signals
        ``[input, sample]`` of the log.
    rows
        Places of the outputs that are wanted.
    known
        Spectra of the inputs by dead times and holds, shared by views of one record: they are the same for all
        parameters.
    """

    #: But for this, patterns of one place are the same.
    rounding = ROUNDING

    def __init__(
        self,
        compiled: CompiledModel,
        lines: RecordLines,
        signals: Real,
        rows: tuple[int, ...],
        *,
        known: dict[tuple[object, ...], Complex] | None = None,
    ) -> None:
        self.compiled, self.lines, self.rows = compiled, lines, list(rows)
        self.hold = hold_of(compiled, lines.sample_rate_hz)
        n = len(compiled.states)
        step = one_step(compiled.a, self.hold.spread(compiled.b), self.hold, lines.sample_rate_hz)
        self._gamma = step[:, n:]
        # Triangular form once: then each line costs a substitution, defective matrices (a free body) included.
        self._triangle, self._unitary = schur(step[:, :n], output="complex")
        self._z = lines.z
        self.shift = np.exp(
            -2j * np.pi * lines.frequency_hz * np.asarray(compiled.output_offsets_s)[self.rows][:, None]
        )
        self._kick = self._z / np.sqrt(lines.samples)
        self._signals = signals
        self._known: dict[tuple[object, ...], Complex] = {} if known is None else known
        self._forces: dict[int, Real] = {}

    def forced(self) -> Complex:
        """``[output, segment, line]`` response to the log's inputs, but for the transients of the segments."""
        return self.response(None, ())

    def response(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[output, segment, line]`` response to the log's inputs, transients and forces.

        Parameters
        ----------
        transient
            ``[state, segment]``: the state at the start of each segment less that at its end, times a number that
            `transients` shares.
        forces
            Where each acts, and its spectrum ``[segment, line]``.
        """
        spectrum = self.inputs()
        through = self.hold.spread(self.compiled.d[self.rows])
        outputs = along(through, spectrum[: self.hold.columns])
        for way, force in forces:
            outputs += way.outputs[:, None] * force
        outputs += np.einsum("nol,nsl->osl", self.printed, self._drive(transient, forces))
        return np.asarray(outputs * self.shift[:, None], dtype=np.complex128)

    def states(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[state, segment, line]`` under the same as `response`."""
        return self._solved(self._drive(transient, forces))

    def transients(self) -> Complex:
        """``[state, output, line]``: what one of each state more at the start (or less at the end) prints."""
        return np.asarray(self.printed * (self._kick * self.shift), dtype=np.complex128)

    def way_of_port(self, port: int) -> Way:
        """Way of a force at a port: band-limited, since nobody holds a force that a machine makes."""
        carried = free_hold(1).carried(0, self.lines.cycles, self.lines.sample_rate_hz)
        through = self._constant(self.compiled.h[self.rows, port])
        return Way(states=along(self.force(port), carried), outputs=through, port=port, carried=carried)

    def way_of_input(self, name: str) -> Way:
        """Way of a change of an input, which runs between samples as the input does."""
        column = self.compiled.column_of(name)
        inner = self.hold.inner(column)
        carried = self.hold.carried(inner, self.lines.cycles, self.lines.sample_rate_hz)
        drive, through = self._gamma[:, self.hold.places(inner)], self._constant(self.compiled.d[self.rows, column])
        return Way(states=along(drive, carried), outputs=through, column=column, carried=carried)

    def way_of_output(self, place: int) -> Way:
        """Way of an error of the sensor in row `place` of the outputs that are wanted."""
        count = self.lines.index.size
        through = np.zeros((len(self.rows), count), dtype=np.complex128)
        # An error of what is recorded comes behind a clock that is late.
        through[place] = 1.0 / self.shift[place]
        still, none = (np.zeros((size, count), dtype=np.complex128) for size in (len(self._triangle), 0))
        return Way(states=still, outputs=through, carried=none)

    def pattern(self, way: Way) -> Complex:
        """``[output, line]`` that a force of one prints."""
        found = np.einsum("nol,nl->ol", self.printed, way.states) + way.outputs
        return np.asarray(found * self.shift, dtype=np.complex128)

    def motion(
        self, port: int, transient: Real | None, forces: Sequence[tuple[Way, Complex]]
    ) -> tuple[Complex, Complex]:
        """Displacement and velocity ``[segment, line]`` at a port, under the same as `response`."""
        compiled, spectrum = self.compiled, self.inputs()
        state = np.stack([compiled.displacement_state[port], compiled.velocity_state[port]])
        column = self.hold.spread(np.stack([compiled.displacement_column[port], compiled.velocity_column[port]]))
        through = np.stack([compiled.displacement_port[port], compiled.velocity_port[port]])
        found = along(column, spectrum[: self.hold.columns])
        for way, force in forces:
            if way.port is not None:
                found = found + through[:, way.port][:, None, None] * force
        found = found + along(state, self.states(transient, forces))
        return found[0], found[1]

    def inputs(self) -> Complex:
        """``[internal column, segment, line]`` of the rows that drive each step."""
        key = (self.compiled.input_delays_s, self.compiled.holds)
        if key not in self._known:
            rows = input_rows(self.compiled, self.hold, self._signals, self.lines.sample_rate_hz, 1)
            self._known[key] = self.lines.spectrum(np.ascontiguousarray(rows[:-1].T))
        return self._known[key]

    def force(self, port: int) -> Real:
        """``[state, place]``: what a force at a port does to the states within a step, see `Way.carried`."""
        # Asked for port by port: few are ever looked at, and each makes the exponential larger.
        if port not in self._forces:
            one = free_hold(1)
            step = one_step(self.compiled.a, one.spread(self.compiled.g[:, [port]]), one, self.lines.sample_rate_hz)
            self._forces[port] = step[:, len(self._triangle) :]
        return self._forces[port]

    @cached_property
    def printed(self) -> Complex:
        """``[state, output, line]``: ``C (z I - Phi)^-1``, what a kick of each state prints, by substitution."""
        upper, outputs = self._triangle, len(self.rows)
        wanted = self.compiled.c[self.rows] @ self._unitary
        shape = (len(upper), outputs, self._z.size)
        found = np.empty(shape, dtype=np.complex128)
        for place in range(len(upper)):
            ahead = along(upper[None, :place, place], found[:place])[0]
            found[place] = (wanted[:, place, None] + ahead) / (self._z - upper[place, place])
        return along(self._unitary.conj(), found)

    def _drive(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[state, segment, line]`` of all that drives the states."""
        drive = along(self._gamma, self.inputs())
        if transient is not None:
            drive += transient[:, :, None] * self._kick
        for way, force in forces:
            drive += way.states[:, None] * force
        return drive

    def _constant(self, through: Real) -> Complex:
        return np.asarray(np.repeat(through[:, None], self._z.size, axis=1), dtype=np.complex128)

    def _solved(self, drive: Complex) -> Complex:
        """``(z I - Phi)^-1 drive`` for ``[state, ..., line]``, by substitution in the triangular form."""
        upper = self._triangle
        wanted = along(self._unitary.conj().T, drive)
        found = np.empty_like(wanted)
        for row in range(len(upper) - 1, -1, -1):
            behind = along(upper[row : row + 1, row + 1 :], found[row + 1 :])[0]
            found[row] = (wanted[row] + behind) / (self._z - upper[row, row])
        return along(self._unitary, found)


def along(matrix: Real | Complex, spectra: Complex) -> Complex:
    """``matrix @ spectra`` over the first axis of ``[row, ...]``; much faster on a flat array."""
    rows = np.ascontiguousarray(spectra).reshape(len(spectra), int(np.prod(spectra.shape[1:])))
    if np.isrealobj(matrix):
        # Half the work: real and imaginary parts are columns of their own.
        flat = (matrix @ rows.view(np.float64)).view(np.complex128)
    else:
        flat = matrix @ rows
    return np.asarray(flat.reshape(len(matrix), *spectra.shape[1:]), dtype=np.complex128)

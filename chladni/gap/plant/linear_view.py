"""The linear part of a model on the lines of a record: forced response, patterns of port forces, transients."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from chladni.gap.plant.record_lines import RecordLines
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.integrator.exponential import responses
from chladni.models.integrator.hold import hold_of
from chladni.models.integrator.input_rows import input_rows

Matrix = NDArray[np.float64]
Spectrum = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """How a force at a port (a change of an input, an error of an output) enters the equations, line by line.

    Attributes
    ----------
    states
        ``[state, line]``.
    outputs
        ``[output, line]`` what passes at once.
    port
        Index of the port, None for an input's or output's own samples.
    """

    states: Spectrum
    outputs: Spectrum
    port: int | None = None


class LinearView:
    """Linear equations of a compiled model, sampled, on the lines of a record.

    With ``x[k+1] = Phi x[k] + Gamma r[k]``, exact for inputs that run along straight lines, the transform of a
    record of N samples satisfies ``z X = Phi X + Gamma R + z delta`` on every line, with ``delta = x[N] - x[0]``
    negated: a start in motion and the cut-off end are n unknown numbers, not leakage (Pintelon and Schoukens,
    *System Identification: A Frequency Domain Approach*, 2nd ed., section 6.3.2, in discrete time).

    Parameters
    ----------
    compiled
        The model; laws and maps of samples are left out.
    lines
        Where.
    signals
        ``[input, sample]`` of the log.
    rows
        Places of the outputs that are wanted.
    known
        Spectra of the inputs by dead times, shared by views of one record: they are the same for all parameters.
    """

    def __init__(
        self,
        compiled: CompiledModel,
        lines: RecordLines,
        signals: Matrix,
        rows: tuple[int, ...],
        *,
        known: dict[tuple[float, ...], Spectrum] | None = None,
    ) -> None:
        self.compiled, self.lines, self._rows = compiled, lines, list(rows)
        self._hold = hold_of(compiled, lines.sample_rate_hz)
        step = responses(
            compiled.a,
            self._hold.spread(compiled.b),
            compiled.g,
            self._hold,
            step_s=1.0 / lines.sample_rate_hz,
            kink_at=self._hold.kink_at,
            fractions=np.array([1.0]),
        )[0]
        n = len(compiled.states)
        self._gamma, self._force = step.state[:, n:], step.force
        # Triangular form once: then each line costs a substitution, defective matrices (a free body) included.
        self._triangle, self._unitary = schur(step.state[:, :n], output="complex")
        self._shift = np.exp(
            -2j * np.pi * lines.frequency_hz * np.asarray(compiled.output_offsets_s)[self._rows][:, None]
        )
        self._kick = lines.z / np.sqrt(lines.samples)
        self._signals = signals
        self._known: dict[tuple[float, ...], Spectrum] = {} if known is None else known

    def forced(self) -> Spectrum:
        """``[output, segment, line]`` response to the log's inputs, but for the transients of the segments."""
        return self.response(None, ())

    def response(self, transient: Matrix | None, forces: Sequence[tuple[Way, Spectrum]]) -> Spectrum:
        """``[output, segment, line]`` response to the log's inputs, transients and forces.

        Parameters
        ----------
        transient
            ``[state, segment]``: the state at the start of each segment less that at its end, times a number that
            `transients` shares.
        forces
            Where each acts, and its spectrum ``[segment, line]``.
        """
        compiled, spectrum = self.compiled, self._inputs()
        shape = (len(self.lines.starts), self.lines.index.size)
        drive = _along(self._gamma, spectrum).reshape(-1, *shape)
        outputs = _along(self._hold.spread(compiled.d[self._rows]), spectrum[: self._hold.columns]).reshape(
            -1, *shape
        )
        if transient is not None:
            drive = drive + transient[:, :, None] * self._kick
        for way, force in forces:
            drive = drive + way.states[:, None] * force
            outputs = outputs + way.outputs[:, None] * force
        found = outputs + _along(compiled.c[self._rows], self._solved(drive))
        return np.asarray(found * self._shift[:, None], dtype=np.complex128)

    def transients(self) -> Spectrum:
        """``[state, output, line]``: what one of each state more at the start (or less at the end) prints."""
        n = len(self._triangle)
        found = np.empty((n, len(self._rows), self.lines.index.size), dtype=np.complex128)
        for place in range(n):
            drive = np.zeros((n, self.lines.index.size), dtype=np.complex128)
            drive[place] = self._kick
            found[place] = self.compiled.c[self._rows] @ self._solved(drive) * self._shift
        return found

    def way_of_port(self, port: int) -> Way:
        """Way of a force at a port that runs along straight lines between samples."""
        drive = self._force[0][:, port, None] + (self.lines.z - 1.0) * self._force[1][:, port, None]
        through = np.broadcast_to(self.compiled.h[self._rows, port][:, None], (len(self._rows), drive.shape[1]))
        return Way(states=drive, outputs=np.asarray(through, dtype=np.complex128), port=port)

    def way_of_input(self, name: str) -> Way:
        """Way of a change of an input, straight between samples."""
        column = self.compiled.column_of(name)
        inner = int(np.flatnonzero(self._hold.source == column)[0])
        straight = self._hold.columns + int(np.flatnonzero(self._hold.straight == inner)[0])
        drive = self._gamma[:, inner, None] + (self.lines.z - 1.0) * self._gamma[:, straight, None]
        through = np.broadcast_to(self.compiled.d[self._rows, column][:, None], (len(self._rows), drive.shape[1]))
        return Way(states=drive, outputs=np.asarray(through, dtype=np.complex128))

    def way_of_output(self, place: int) -> Way:
        """Way of an error of the sensor in row `place` of the outputs that are wanted."""
        count = self.lines.index.size
        through = np.zeros((len(self._rows), count), dtype=np.complex128)
        # An error of what is recorded comes behind a clock that is late.
        through[place] = 1.0 / self._shift[place]
        return Way(states=np.zeros((len(self._triangle), count), dtype=np.complex128), outputs=through)

    def pattern(self, way: Way) -> Spectrum:
        """``[output, line]`` that a force of one prints."""
        found = self.compiled.c[self._rows] @ self._solved(way.states) + way.outputs
        return np.asarray(found * self._shift, dtype=np.complex128)

    def motion(
        self, port: int, transient: Matrix | None, forces: Sequence[tuple[Way, Spectrum]]
    ) -> tuple[Spectrum, Spectrum]:
        """Displacement and velocity ``[segment, line]`` at a port, under the same as `response`."""
        compiled, spectrum = self.compiled, self._inputs()
        shape = (len(self.lines.starts), self.lines.index.size)
        drive = _along(self._gamma, spectrum).reshape(-1, *shape)
        state = np.stack([compiled.displacement_state[port], compiled.velocity_state[port]])
        column = self._hold.spread(np.stack([compiled.displacement_column[port], compiled.velocity_column[port]]))
        through = np.stack([compiled.displacement_port[port], compiled.velocity_port[port]])
        found = _along(column, spectrum[: self._hold.columns]).reshape(-1, *shape)
        if transient is not None:
            drive = drive + transient[:, :, None] * self._kick
        for way, force in forces:
            drive = drive + way.states[:, None] * force
            if way.port is not None:
                found = found + through[:, way.port][:, None, None] * force
        found = found + _along(state, self._solved(drive))
        return found[0], found[1]

    def _inputs(self) -> Spectrum:
        """``[internal column, segment, line]`` of the rows that drive each step."""
        key = self.compiled.input_delays_s
        if key not in self._known:
            rows = input_rows(self.compiled, self._hold, self._signals, self.lines.sample_rate_hz, 1)
            self._known[key] = self.lines.spectrum(np.ascontiguousarray(rows[:-1].T))
        return self._known[key]

    def _solved(self, drive: Spectrum) -> Spectrum:
        """``(z I - Phi)^-1 drive`` for ``[state, ..., line]``, by substitution in the triangular form."""
        z, upper = self.lines.z, self._triangle
        wanted = _along(self._unitary.conj().T, drive)
        found = np.empty_like(wanted)
        for row in range(len(upper) - 1, -1, -1):
            behind = _along(upper[row : row + 1, row + 1 :], found[row + 1 :])[0]
            found[row] = (wanted[row] + behind) / (z - upper[row, row])
        return _along(self._unitary, found)


def _along(matrix: Matrix | Spectrum, spectra: Spectrum) -> Spectrum:
    """``matrix @ spectra`` over the first axis of ``[row, ...]``; much faster on a flat array."""
    flat = matrix @ spectra.reshape(len(spectra), int(np.prod(spectra.shape[1:])))
    return np.asarray(flat.reshape(len(matrix), *spectra.shape[1:]), dtype=np.complex128)

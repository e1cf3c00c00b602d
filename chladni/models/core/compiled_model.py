"""A model ready to simulate: linear equations, ports, and what is attached to them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Self

import numpy as np

from chladni.models.core.port import HoldKind, Port, PortKind, Terminal, require_named
from chladni.models.core.port_law import PortLaw
from chladni.models.core.resolvent import resolvent
from chladni.models.core.state_space import StateSpace
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError
from chladni.signals.number_range import LARGEST_OF_MODEL
from chladni.signals.value import Value

#: ``map(samples, sample_rate_hz) -> samples``: what acts on the samples of one input or output.
SampleMap = Callable[[Real, float], Real]


@dataclass(frozen=True, slots=True, kw_only=True)
class DelayLine:
    """Dead time inside a loop: ``f(t) = d(t - delay_s) - d(t)`` at a port whose undelayed signal is in A, B, C, D.

    With nothing before the start: d is 0 for t < 0.
    """

    port: int
    delay_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class IdealDerivative:
    """A derivative that no equations in time can hold, known exactly in frequency.

    A, B, C, D hold ``(s/(T s + 1))^order d`` in its place, T the filter time; in a frequency response the port adds
    the difference ``f = (s^order - (s/(T s + 1))^order) d``. In time the filter stays.
    """

    port: int
    order: int
    filter_time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneratedInput:
    """An input that no log holds (a floor that shakes): its samples are computed from the sample times in seconds."""

    terminal: Terminal
    samples: Callable[[Real], Real]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CompiledModel(Value):
    """Linear equations with ports, and the laws, maps and delays attached to them.

    ::

        x' = A  x + B  u + G  f          states
        d  = Pd x + Qd u + Rd f          displacement at each port
        s  = Ps x + Qs u + Rs f          velocity at each port
        y  = C  x + D  u + H  f          outputs

    f is what the laws and delay lines add at each port. Without any, the model is linear: f = 0.

    Attributes
    ----------
    a, b, c, d
        ``[state, state]``, ``[state, column]``, ``[output, state]``, ``[output, column]``.
    g, h
        ``[state, port]``, ``[output, port]``.
    displacement_state, displacement_column, displacement_port
        Pd ``[port, state]``, Qd ``[port, column]``, Rd ``[port, port]``.
    velocity_state, velocity_column, velocity_port
        Ps, Qs, Rs, likewise.
    inputs
        Each takes ``1 + derivatives`` columns of u, one after another: the signal, its rate, its second derivative.
    generated
        Inputs that are computed; one column each, after those of `inputs`.
    outputs, states, ports
        Names of rows.
    laws, delays
        At ports; several laws at one port add up.
    derivatives
        At ports: what only a frequency response holds exactly.
    input_maps, output_maps
        ``(index, map)``, applied in order to the samples of an input before, of an output after, the integration.
        Only for inputs and outputs outside of every loop: inside a loop a law at the port does it.
    input_delays_s
        Dead time of each input outside a loop, exact for the signal between the samples that its hold says.
    output_offsets_s
        How late the clock of each output is: ``y_sampled(t) = y(t - offset)``.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    g: Real
    h: Real
    displacement_state: Real
    displacement_column: Real
    displacement_port: Real
    velocity_state: Real
    velocity_column: Real
    velocity_port: Real
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    states: tuple[str, ...]
    ports: tuple[Port, ...]
    generated: tuple[GeneratedInput, ...] = ()
    laws: tuple[PortLaw, ...] = ()
    delays: tuple[DelayLine, ...] = ()
    derivatives: tuple[IdealDerivative, ...] = ()
    input_maps: tuple[tuple[int, SampleMap], ...] = ()
    output_maps: tuple[tuple[int, SampleMap], ...] = ()
    input_delays_s: tuple[float, ...] = ()
    output_offsets_s: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.input_delays_s:
            object.__setattr__(self, "input_delays_s", (0.0,) * len(self.inputs))
        if not self.output_offsets_s:
            object.__setattr__(self, "output_offsets_s", (0.0,) * len(self.outputs))
        self._require_shapes()
        self._freeze()

    @property
    def columns(self) -> int:
        """Columns of u: of the inputs with their derivatives, and of the generated ones."""
        return sum(1 + terminal.derivatives for terminal in self.inputs) + len(self.generated)

    def column_of(self, name: str) -> int:
        """First column of the named input; `ModelError` naming those there are when it's missing."""
        column = 0
        for terminal in self.inputs:
            if terminal.name == name:
                return column
            column += 1 + terminal.derivatives
        raise ModelError(f"no input {name!r}; inputs: {', '.join(terminal.name for terminal in self.inputs)}")

    @property
    def holds(self) -> tuple[HoldKind, ...]:
        """How each input runs between its samples: straight where nobody has said."""
        return tuple(terminal.hold or "foh" for terminal in self.inputs)

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:
        """Give the model with other holds of the named inputs and outputs; `ModelError` when there's no such name."""
        require_named(holds, (terminal.name for terminal in (*self.inputs, *self.outputs)))
        inputs, outputs = (
            tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in terminals)
            for terminals in (self.inputs, self.outputs)
        )
        return replace(self, inputs=inputs, outputs=outputs)

    def port_index(self, name: str, kind: PortKind | None = None) -> int:
        """Row of the named port; of the first that isn't an ``actuation`` when no kind is given.

        Raises
        ------
        ModelError
            When there is none; names those there are.
        """
        for place, port in enumerate(self.ports):
            if port.name == name and (port.kind == kind or (kind is None and port.kind != "actuation")):
                return place
        known = ", ".join(dict.fromkeys(port.name for port in self.ports if kind in (None, port.kind)))
        raise ModelError(f"no {kind or 'site'} {name!r}; there are: {known or 'none'}")

    def is_linear(self) -> bool:
        """Whether nothing but the linear equations, delays, gains and offsets acts."""
        return not self.laws and not self.input_maps and not self.output_maps

    def state_space(self) -> StateSpace:
        """Linear equations from the inputs to the outputs; laws, maps, delays and offsets are left out.

        Raises
        ------
        ModelError
            When an input needs its derivatives (a prescribed displacement), which a state space can't take.
        """
        for terminal in self.inputs:
            if terminal.derivatives:
                raise ModelError(
                    f"input {terminal.name!r} prescribes a motion whose derivatives act too: "
                    "it has a frequency response, but no state space"
                )
        count = len(self.inputs)
        return StateSpace(
            a=self.a,
            b=self.b[:, :count],
            c=self.c,
            d=self.d[:, :count],
            inputs=self.inputs,
            outputs=self.outputs,
            states=self.states,
        )

    def frequency_response(self, frequency_hz: Real) -> Complex:
        """Response of each output to each input, ``[output, input, frequency]``, dead times and offsets included.

        Ideal derivatives are included too. Laws and sample maps are left out: it's the response of the linear part.
        e^{+j omega t}: a dead time tau has the phase -omega tau.
        """
        frequency_hz = np.asarray(frequency_hz, dtype=np.float64)
        s = np.asarray(2j * pi * frequency_hz, dtype=np.complex128)
        signals = self._signal_matrix(s)
        delayed = sorted({line.port for line in self.delays} | {ideal.port for ideal in self.derivatives})
        count = len(self.outputs)
        rows = np.vstack([self.c, self.displacement_state[delayed]])
        through = np.vstack([self.d, self.displacement_column[delayed]])
        port_through = np.vstack([self.h[:, delayed], self.displacement_port[np.ix_(delayed, delayed)]])
        inverse = resolvent(self.a, s)
        to_u = (rows @ inverse @ self.b + through) @ signals
        if delayed:
            to_f = rows @ inverse @ self.g[:, delayed] + port_through
            factor = self._delay_factors(s, delayed)
            # f = W d, d = Hu u + Hf f  =>  f = (I - W Hf)^-1 W Hu u
            eye = np.eye(len(delayed))
            f = np.linalg.solve(eye - factor[:, :, None] * to_f[:, count:], factor[:, :, None] * to_u[:, count:])
            to_u = to_u[:, :count] + to_f[:, :count] @ f
        shift = np.exp(-np.multiply.outer(s, np.asarray(self.output_offsets_s)))
        return np.moveaxis(np.asarray(to_u * shift[:, :, None], dtype=np.complex128), 0, -1)

    def _signal_matrix(self, s: Complex) -> Complex:
        """``[frequency, column, input]``: the columns that one input of unit amplitude makes."""
        matrix = np.zeros((s.size, self.columns, len(self.inputs)), dtype=complex)
        for place, terminal in enumerate(self.inputs):
            first = self.column_of(terminal.name)
            for order in range(1 + terminal.derivatives):
                matrix[:, first + order, place] = s**order * np.exp(-s * self.input_delays_s[place])
        return matrix

    def _delay_factors(self, s: Complex, ports: list[int]) -> Complex:
        factors = np.zeros((s.size, len(ports)), dtype=complex)
        for line in self.delays:
            factors[:, ports.index(line.port)] += np.exp(-s * line.delay_s) - 1
        for ideal in self.derivatives:
            filtered = (s / (ideal.filter_time_s * s + 1)) ** ideal.order
            factors[:, ports.index(ideal.port)] += s**ideal.order - filtered
        return factors

    def _require_shapes(self) -> None:
        n, m, p, q = len(self.states), self.columns, len(self.outputs), len(self.ports)
        expected = {
            "a": (n, n), "b": (n, m), "c": (p, n), "d": (p, m), "g": (n, q), "h": (p, q),
            "displacement_state": (q, n), "displacement_column": (q, m), "displacement_port": (q, q),
            "velocity_state": (q, n), "velocity_column": (q, m), "velocity_port": (q, q),
        }  # fmt: skip
        for name, shape in expected.items():
            matrix = getattr(self, name)
            if matrix.shape != shape:
                raise ModelError(f"compiled model: {name} has shape {matrix.shape}, {shape} was expected")
        # All at once: a model is compiled thousands of times.
        together = np.concatenate([getattr(self, name).ravel() for name in expected])
        if not (np.abs(together) <= LARGEST_OF_MODEL).all():
            name = next(name for name in expected if not (np.abs(getattr(self, name)) <= LARGEST_OF_MODEL).all())
            raise ModelError(
                f"compiled model: {name} holds a number that is not finite, or above {LARGEST_OF_MODEL:.1g}; one of "
                "the model's numbers is far too large or far too small beside the others, check their units"
            )
        for name, values, count in (
            ("input_delays_s", self.input_delays_s, len(self.inputs)),
            ("output_offsets_s", self.output_offsets_s, p),
        ):
            if len(values) != count:
                raise ModelError(f"compiled model: {name} has {len(values)} values, {count} were expected")

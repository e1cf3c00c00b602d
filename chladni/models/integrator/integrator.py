"""The integrator: a compiled model at one sample rate, made ready to run as often as wanted."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port_law import PortLaw
from chladni.models.integrator.hold import Hold, hold_of, split_delay
from chladni.models.integrator.input_rows import input_rows
from chladni.models.integrator.march import linear_march
from chladni.models.integrator.port_plan import LawTable, PortPlan, law_table, port_plan
from chladni.models.integrator.run import Run, RunResult
from chladni.models.integrator.step_tables import StepTables
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.number_range import LARGEST, largest_magnitudes
from chladni.signals.value import Value

Scheme = Literal["automatic", "explicit", "implicit"]
#: What one run may keep in memory.
MEMORY_BYTES = 4_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Integration(Value):
    """What a run gives, sample by sample.

    Attributes
    ----------
    states
        ``[state, sample]`` of the linear part.
    outputs
        ``[output, sample]``, offsets and output maps applied.
    ports
        Indices of the ports at which laws or delay lines act.
    displacement, velocity, force
        ``[port, sample]`` of those.
    refined_steps
        Intervals between samples in which the step was shortened.
    steps
        Steps in all.
    """

    states: Real
    outputs: Real
    ports: tuple[int, ...]
    displacement: Real
    velocity: Real
    force: Real
    refined_steps: int
    steps: int

    def __post_init__(self) -> None:
        self._freeze()


class Integrator:
    """A compiled model at one sample rate: matrices are computed once, `run` is called as often as wanted.

    Parameters
    ----------
    compiled
        The model.
    sample_rate_hz
        Of the inputs and outputs. Between samples inputs run as their `hold` says.
    tolerance
        Largest error of one step, beside the largest magnitude of each state so far.
    scheme
        ``automatic``, or one of the two schemes alone (to study it).

    Raises
    ------
    ModelError
        When a law can't be compiled or a delay is too short for the sample rate.
    """

    def __init__(
        self,
        compiled: CompiledModel,
        sample_rate_hz: float,
        *,
        tolerance: float = 1e-7,
        scheme: Scheme = "automatic",
    ) -> None:
        if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
            raise ModelError(f"sample rate {sample_rate_hz} Hz must be finite and positive")
        if not tolerance > 0:
            raise ModelError(f"tolerance {tolerance} must be positive; 1e-7 is usual")
        self._compiled = compiled
        self._sample_rate_hz = float(sample_rate_hz)
        self._tolerance = float(tolerance)
        self._scheme: Scheme = scheme
        self._hold: Hold = hold_of(compiled, sample_rate_hz)
        self._plan: PortPlan = port_plan(compiled, self._hold)
        self._laws: LawTable = law_table(compiled, self._plan)
        self._late = [split_delay(offset_s, sample_rate_hz) for offset_s in compiled.output_offsets_s]
        # A clock that is late by a fraction reads the step before at what is left of it.
        self._instants = np.unique([1.0 - fraction for _, fraction in self._late if fraction])
        self._tables = StepTables(
            plan=self._plan, hold=self._hold, step_s=1.0 / self._sample_rate_hz, instants=self._instants
        )

    def with_laws(self, laws: tuple[PortLaw, ...]) -> "Integrator":
        """Give an integrator with other laws at the same ports; the matrices are shared.

        Raises
        ------
        ModelError
            When the laws act at other ports.
        """
        taken = {law.port for law in laws} | {self._plan.ports[place] for place in self._plan.delay_port}
        if taken != set(self._plan.ports):
            raise ModelError(f"laws act at ports {sorted(taken)}, the integrator was made for {self._plan.ports}")
        other = object.__new__(Integrator)
        other.__dict__.update(self.__dict__)
        other._laws = law_table(self._compiled, self._plan, laws)
        return other

    def run(self, signals: Real, *, initial: Mapping[str, float] | Real | None = None) -> Integration:
        """Simulate.

        Parameters
        ----------
        signals
            ``[input, sample]`` in the order of the model's inputs, as commanded.
        initial
            State at the start: values by name (the others 0), or ``[state]``; at rest by default. States of laws
            start as their law says.

        Raises
        ------
        ModelError
            When shapes don't fit, a sample isn't finite, memory wouldn't do, or the model diverges: a state or an
            output leaves the numbers that can be squared (`chladni.signals.number_range`).
        """
        signals = self._checked(signals)
        count = signals.shape[1]
        extra = max([0, *(-whole for whole, fraction in self._late)]) + 1
        rows = input_rows(self._compiled, self._hold, signals, self._sample_rate_hz, extra)
        start = initial_state(self._compiled, initial)
        # What grows beyond all numbers is told in words once the run is over, with its name and time.
        with np.errstate(over="ignore", invalid="ignore"):
            result = self._run_laws(rows, start) if self._plan.ports else self._run_linear(rows, start)
            found = self._integration(result, rows, count)
            _require_in_range(result, found.outputs, self._compiled, self._sample_rate_hz)
        return found

    def _checked(self, signals: Real) -> Real:
        signals = np.asarray(signals, dtype=np.float64)
        inputs = self._compiled.inputs
        if signals.ndim != 2 or signals.shape[0] != len(inputs) or signals.shape[1] < 1:
            raise ModelError(f"signals have shape {signals.shape}; [{len(inputs)} inputs, samples] was expected")
        if not np.all(largest_magnitudes(signals) <= LARGEST):
            row, sample = np.argwhere(~(np.abs(signals) <= LARGEST))[0]
            raise ModelError(
                f"input {inputs[row].name!r}: sample {sample} is {signals[row, sample]:.3g}; a simulation needs "
                f"finite numbers of {LARGEST:.2g} at most, take a window without gaps or a smaller excitation"
            )
        require_memory(self._compiled, signals.shape[1], self._sample_rate_hz)
        return signals

    def _run_linear(self, rows: Real, start: Real) -> RunResult:
        state = np.zeros((len(rows), start.size))
        state[0] = start
        n = start.size
        linear_march(np.ascontiguousarray(self._tables.implicit.advance[0][:, :n]), rows, state)
        before = np.hstack([state[:-1], rows[:-1]])
        dense = np.einsum("ick,sc->iks", self._tables.dense.advance[0][: self._instants.size], before)
        empty = np.zeros((len(rows), 0))
        return RunResult(state=state, motion=empty, force=empty, dense=dense, refined=0, steps=len(rows) - 1)

    def _run_laws(self, rows: Real, start: Real) -> RunResult:
        run = Run(
            self._compiled,
            self._plan,
            self._hold,
            self._laws,
            self._tables,
            tolerance=self._tolerance,
            scheme=self._scheme,
        )
        return run.march(rows, start)

    def _integration(self, result: RunResult, rows: Real, count: int) -> Integration:
        plan, m, p = self._plan, self._hold.columns, len(self._plan.ports)
        outputs = result.state @ plan.c.T + rows[:, :m] @ plan.d.T + result.force @ plan.h.T
        outputs = self._sampled(np.ascontiguousarray(outputs.T), result.dense, count)
        for place, sample_map in self._compiled.output_maps:
            outputs[place] = sample_map(outputs[place], self._sample_rate_hz)
        motion = result.motion[:count].T
        return Integration(
            states=result.state[:count].T,
            outputs=outputs,
            ports=plan.ports,
            displacement=motion[:p],
            velocity=motion[p:],
            force=result.force[:count].T,
            refined_steps=result.refined,
            steps=result.steps,
        )

    def _sampled(self, outputs: Real, dense: Real, count: int) -> Real:
        """Outputs as late as each clock is; before the start they are as at the start."""
        sampled = outputs[:, :count].copy()
        for place, (whole, fraction) in enumerate(self._late):
            if whole == 0 and not fraction:
                continue
            if not fraction:
                sampled[place] = outputs[place, np.maximum(np.arange(count) - whole, 0)]
                continue
            instant = int(np.searchsorted(self._instants, 1.0 - fraction))
            steps = np.arange(count) - whole - 1
            inside = dense[instant, place, np.clip(steps, 0, dense.shape[2] - 1)]
            sampled[place] = np.where(steps < 0, outputs[place, 0], inside)
        return sampled


def integrate(
    compiled: CompiledModel,
    signals: Real,
    sample_rate_hz: float,
    *,
    initial: Mapping[str, float] | Real | None = None,
    tolerance: float = 1e-7,
) -> Integration:
    """Simulate a compiled model once; see `Integrator` for many runs of one model.

    Parameters
    ----------
    compiled
        The model.
    signals
        ``[input, sample]`` in the order of the model's inputs.
    sample_rate_hz
        Of `signals` and of the result.
    initial
        See `Integrator.run`.
    tolerance
        See `Integrator`.
    """
    return Integrator(compiled, sample_rate_hz, tolerance=tolerance).run(signals, initial=initial)


def require_memory(compiled: CompiledModel, samples: int, sample_rate_hz: float) -> None:
    """Refuse a run that would not fit in memory, before anything is allocated."""
    numbers = 2 * len(compiled.states) + 3 * compiled.columns + 3 * len(compiled.outputs) + 5 * len(compiled.ports)
    needed = 8 * (numbers + 10) * samples
    if needed > MEMORY_BYTES:
        raise ModelError(
            f"{samples / sample_rate_hz:g} s at {sample_rate_hz:g} Hz with {len(compiled.states)} states need "
            f"{needed / 1e9:.3g} GB; at most {MEMORY_BYTES / 1e9:g} GB are used: simulate less time or a lower rate"
        )


def initial_state(compiled: CompiledModel, initial: Mapping[str, float] | Real | None) -> Real:
    """``[state]`` from values by name, from an array, or at rest."""
    start = np.zeros(len(compiled.states))
    if isinstance(initial, Mapping):
        for name, value in initial.items():
            if name not in compiled.states:
                raise ModelError(f"no state {name!r}; states: {', '.join(compiled.states) or 'none'}")
            start[compiled.states.index(name)] = value
    elif initial is not None:
        given = np.asarray(initial, dtype=np.float64)
        if given.shape != start.shape:
            raise ModelError(f"initial state has shape {given.shape}, {start.shape} was expected")
        start = given.copy()
    if not np.all(np.isfinite(start)):
        raise ModelError("initial state must be finite numbers")
    return start


def _require_in_range(result: RunResult, outputs: Real, compiled: CompiledModel, sample_rate_hz: float) -> None:
    """Refuse a run that leaves the numbers which can be squared, naming what did so first, and when."""
    outputs = outputs.T
    for kind, names, signals in (
        ("state", compiled.states, result.state),
        ("output", [one.name for one in compiled.outputs], outputs),
    ):
        if np.all(largest_magnitudes(signals.T) <= LARGEST):
            continue
        sample, place = np.argwhere(~(np.abs(signals) <= LARGEST))[0]
        if sample == 0:
            raise ModelError(
                f"{kind} {names[place]!r} is {signals[0, place]:.3g} at 0 s, and {LARGEST:.2g} is the most that can "
                "be worked with; a parameter, the start or the excitation is too large, check their units"
            )
        raise ModelError(
            f"the model diverges: {kind} {names[place]!r} grows beyond {LARGEST:.2g} at "
            f"{sample / sample_rate_hz:g} s; a loop is unstable, lower its gain or simulate less time"
        )

"""Free simulation of a model with a log's own inputs, as often as a fit wants it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from chladni.gap.calibration import KEPT, PARTS, UNNOTICED
from chladni.gap.plant.black_box import BlackBox
from chladni.gap.plant.kept import Kept
from chladni.gap.plant.laid_inputs import LaidInputs
from chladni.gap.plant.linear_run import is_plain, linear_outputs
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, Model
from chladni.models.core.simulation import PortMotion
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.integrator.hold import hold_of
from chladni.models.integrator.input_rows import input_rows
from chladni.models.integrator.integrator import Integration, Integrator
from chladni.models.integrator.trapezoid_march import Equations, Marched, equations, run_laws
from chladni.models.simulators.simulator import SimulatorResponse
from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import ModelError

Windows = Sequence[tuple[int, int]]


class FreeRun:
    """A model that is driven by the inputs of one log, for any parameters and effects.

    Parameters
    ----------
    model
        Nominal model; effects that it already has stay.
    measurement
        Inputs in the order of the model's, and the outputs that the log holds.
    tolerance
        Largest error of a step, see `Integrator`.
    windows
        ``(start, stop)`` samples, one after another; each begins at its own initial state. None for the whole record.

    Raises
    ------
    ModelError
        When the inputs aren't the model's, an output is missing in the model, or windows overlap or leave the record.
    """

    def __init__(
        self,
        model: Model,
        measurement: Measurement,
        *,
        tolerance: float = UNNOTICED,
        windows: Windows | None = None,
    ) -> None:
        self.model = model
        self.measurement = measurement
        self.tolerance = tolerance
        self.windows: tuple[tuple[int, int], ...] = _checked(windows, measurement.samples)
        self.tunables = Tunables.of(model)
        compiled = model.compile()
        self.rows = _rows(compiled, measurement)
        self.inputs = LaidInputs(measurement.inputs, measurement.sample_rate_hz)
        self._integrators: Kept[Integrator] = Kept(KEPT)

    def compiled(self, z: Real | None = None, effects: Sequence[Effect] = ()) -> CompiledModel:
        """Equations of the model at some parameters, with these effects behind those that it has."""
        return _at(self.model, self.tunables, z, effects).compile()

    @property
    def is_black_box(self) -> bool:
        """Whether the model only responds, from its own start: it's run for every slope."""
        return isinstance(self.model, BlackBox)

    def refined(self) -> "FreeRun | None":
        """Give the runs with half the steps of a simulator that isn't ours; None where it can't, or needn't."""
        finer = self.model.refined() if isinstance(self.model, BlackBox) else None
        return None if finer is None else FreeRun(finer, self.measurement)

    def _responded(self, box: BlackBox, z: Real | None, effects: Sequence[Effect]) -> SimulatorResponse:
        return _at(box, self.tunables, z, effects).respond(self.measurement.inputs, self.measurement.sample_rate_hz)

    def outputs(
        self, z: Real | None = None, effects: Sequence[AttachedEffect] = (), initial: Real | None = None
    ) -> Real:
        """Give ``[output, sample]`` of the measured outputs as the model would have them.

        Parameters
        ----------
        z
            ``[parameter]`` of `tunables`, nominal by default.
        effects
            Appended to those that the model has.
        initial
            ``[state]`` or ``[window, state]`` in the order of the compiled model's states; at rest by default.

        Raises
        ------
        ModelError
            When parameters are impossible or the model diverges.
        """
        if isinstance(self.model, BlackBox):
            return self._responded(self.model, z, effects).outputs[self.rows]
        compiled, rate = self.compiled(z, effects), self.measurement.sample_rate_hz
        late_s = self.late_s(compiled)
        if len(self.windows) == 1 or not np.any(late_s):
            return self._run(compiled, _key(z, effects), initial)
        # A clock that is early or late reads from the window after or before, not from beyond its own's ends.
        in_time = replace(compiled, output_offsets_s=(0.0,) * len(compiled.outputs), output_maps=())
        read = self._run(in_time, ("in time", _key(z, effects)), initial)
        return mapped_outputs(compiled, self.rows, read_late(read, late_s, rate), rate)

    def unknown_at_start(self, z: Real | None = None, effects: Sequence[AttachedEffect] = ()) -> int:
        """Samples at the start that dead times of inputs fill from before the record: nobody knows with what."""
        if self.is_black_box:
            return 0
        dead_s = max(self.compiled(z, effects).input_delays_s, default=0.0)
        return min(int(np.ceil(dead_s * self.measurement.sample_rate_hz)), self.measurement.samples)

    def late_s(self, compiled: CompiledModel) -> Real:
        """``[output]`` how late the clocks of the measured outputs are."""
        return np.asarray(compiled.output_offsets_s, dtype=np.float64)[self.rows]

    def _run(self, compiled: CompiledModel, key: object, initial: Real | None) -> Real:
        rate = self.measurement.sample_rate_hz
        if is_plain(compiled):
            starts = initial_states(initial, len(self.windows), len(compiled.states))
            found = linear_outputs(self.inputs, compiled, self.rows, self.windows, starts)
            return mapped_outputs(compiled, self.rows, found, rate)
        marched = self.marched(compiled, initial)
        if marched is not None:
            return mapped_outputs(compiled, self.rows, marched.outputs, rate)
        parts = [one.outputs[self.rows] for one in self._integrations(compiled, key, initial)]
        return parts[0] if len(parts) == 1 else np.hstack(parts)

    def marched(self, compiled: CompiledModel, initial: Real | None) -> Marched | None:
        """Windows of a model with laws, outputs before clocks and maps; None where `integrations` does it better."""
        rate = self.measurement.sample_rate_hz
        hold = hold_of(compiled, rate)
        # An integrator counts time from the start of its own window; a law may want the log's.
        if len(self.windows) == 1 or not compiled.laws:
            return None
        if compiled.delays or hold.kinked.size or any(terminal.derivatives for terminal in compiled.inputs):
            return None
        starts = initial_states(initial, len(self.windows), len(compiled.states))
        return run_laws(self.equations(compiled, PARTS), self.windows, starts, rate)

    def equations(self, compiled: CompiledModel, parts: int) -> Equations:
        """Equations of the march with so many steps between samples, for the measured outputs."""
        rate = self.measurement.sample_rate_hz
        inputs = self.inputs.rows(compiled, hold_of(compiled, rate), parts)
        return equations(compiled, inputs, self.rows, rate, parts)

    def motion(
        self,
        z: Real | None = None,
        effects: Sequence[AttachedEffect] = (),
        initial: Real | None = None,
        *,
        site: str,
    ) -> PortMotion:
        """Motion at a joint, body or input of the model during the same run.

        Raises
        ------
        ModelError
            When the site has no port; see `outputs` too.
        """
        if isinstance(self.model, BlackBox):
            joint = self.compiled().port_index(site, "joint")
            return self._responded(self.model, z, effects).motions[joint]
        return self._motions(z, effects, initial, [self.compiled(z, effects).port_index(site)])[0]

    def law_motion(
        self, z: Real, effects: Sequence[AttachedEffect], initial: Real, *, site: str
    ) -> tuple[Real, Real]:
        """Displacement and velocity that a law at a site saw; `ModelError` where none acts, see `outputs` too."""
        if isinstance(self.model, BlackBox):
            motion = self.motion(z, effects, initial, site=site)
            return motion.displacement, motion.velocity
        compiled, runs = self.compiled(z, effects), self.integrations(z, effects, initial)
        for row, port in enumerate(runs[0].ports):
            if compiled.ports[port].name == site:
                displacement = np.concatenate([one.displacement[row] for one in runs])
                return displacement, np.concatenate([one.velocity[row] for one in runs])
        raise ModelError(f"no law acts at {site!r}")

    def motions(
        self, z: Real | None = None, effects: Sequence[AttachedEffect] = (), initial: Real | None = None
    ) -> dict[tuple[str, str], PortMotion]:
        """Motion at every port of the model during one run, by name and kind; see `outputs`."""
        if isinstance(self.model, BlackBox):
            found: Sequence[PortMotion] = self._responded(self.model, z, effects).motions
        else:
            found = self._motions(z, effects, initial, range(len(self.compiled(z, effects).ports)))
        return {(one.name, one.kind): one for one in found}

    def _motions(
        self, z: Real | None, effects: Sequence[AttachedEffect], initial: Real | None, ports: Sequence[int]
    ) -> list[PortMotion]:
        """Motions during a run; the force is 0 where no law acts."""
        compiled, runs = self.compiled(z, effects), self.integrations(z, effects, initial)
        columns = [self._columns(compiled, window) for window in self.windows]
        found = []
        for port in ports:
            parts = [_port_motion(compiled, port, one, u) for one, u in zip(runs, columns, strict=True)]
            displacement, velocity, force = np.concatenate(parts, axis=1)
            name, kind = compiled.ports[port].name, compiled.ports[port].kind
            found.append(PortMotion(name=name, kind=kind, displacement=displacement, velocity=velocity, force=force))
        return found

    def integrations(
        self, z: Real | None, effects: Sequence[AttachedEffect], initial: Real | None
    ) -> list[Integration]:
        """Give the run of each window; arguments and errors are those of `outputs`."""
        return self._integrations(self.compiled(z, effects), _key(z, effects), initial)

    def _integrations(self, compiled: CompiledModel, key: object, initial: Real | None) -> list[Integration]:
        # For this run alone: an integrator's tables grow while it runs.
        integrator = self._integrators.take(
            key, lambda: Integrator(compiled, self.measurement.sample_rate_hz, tolerance=self.tolerance)
        )
        starts = initial_states(initial, len(self.windows), len(compiled.states))
        try:
            return [
                integrator.run(self.measurement.inputs[:, slice(*window)], initial=start)
                for window, start in zip(self.windows, starts, strict=True)
            ]
        finally:
            self._integrators.put(key, integrator)

    def _columns(self, compiled: CompiledModel, window: tuple[int, int]) -> Real:
        """``[sample, column]`` of the compiled model's u in a window."""
        rate = self.measurement.sample_rate_hz
        hold = hold_of(compiled, rate)
        signals = self.measurement.inputs[:, slice(*window)]
        rows = input_rows(compiled, hold, signals, rate, extra=0)
        columns = np.zeros((signals.shape[1], compiled.columns))
        known = hold.source >= 0
        columns[:, hold.source[known]] = rows[:, : hold.columns][:, known]
        return columns


ModelT = TypeVar("ModelT", bound=Model)


def _at(model: ModelT, tunables: Tunables, z: Real | None, effects: Sequence[Effect]) -> ModelT:
    """Give the model at some parameters, with these effects behind those that it has."""
    if z is not None and np.any(z):
        model = model.with_values(tunables.values(np.asarray(z, dtype=np.float64)))
    return model.with_effects((*model.effects, *effects)) if effects else model


def mapped_outputs(compiled: CompiledModel, rows: Whole, outputs: Real, sample_rate_hz: float) -> Real:
    """``[output, sample]`` of the outputs `rows` behind the model's maps of samples."""
    if not compiled.output_maps:
        return outputs
    mapped = outputs.copy()
    for place, sample_map in compiled.output_maps:
        for row in np.flatnonzero(rows == place):
            mapped[row] = sample_map(mapped[row], sample_rate_hz)
    return mapped


def read_late(outputs: Real, offsets_s: Real, sample_rate_hz: float) -> Real:
    """Give ``[..., output, sample]`` as read by clocks that are late by ``offsets_s [output]``.

    By cubic splines between samples; before the start as at the start, after the end as at the end. What isn't finite
    somewhere is nowhere: a spline through it would have no numbers.
    """
    late = np.flatnonzero(offsets_s)
    if not late.size:
        return outputs
    from scipy.interpolate import CubicSpline

    times_s = np.arange(outputs.shape[-1]) / sample_rate_hz
    read = outputs.copy()
    for row in late:
        asked = np.clip(times_s - offsets_s[row], 0.0, times_s[-1])
        seen = outputs[..., row, :]
        finite = np.isfinite(seen).all(axis=-1)
        read[..., row, :] = np.nan
        read[finite, row, :] = CubicSpline(times_s, seen[finite], axis=-1)(asked)
    return read


def _key(z: Real | None, effects: Sequence[AttachedEffect]) -> object:
    """What tells one run's integrator from another's."""
    return None if z is None else np.asarray(z).tobytes(), tuple(effect_key(effect) for effect in effects)


def effect_key(effect: AttachedEffect) -> tuple[object, ...]:
    """What tells one attached effect from another."""
    return effect.effect, effect.site, effect.variant, effect.source, tuple(sorted(effect.values.items()))


def initial_states(initial: Real | None, windows: int, states: int) -> Real:
    """``[window, state]`` from what a caller gave; `ModelError` when the shape doesn't fit."""
    if initial is None:
        return np.zeros((windows, states))
    given = np.asarray(initial, dtype=np.float64)
    if given.ndim == 1:
        given = np.broadcast_to(given, (windows, given.size))
    if given.shape != (windows, states):
        raise ModelError(f"initial state has shape {given.shape}; [{windows} windows, {states} states] was expected")
    return given


def _checked(windows: Windows | None, samples: int) -> tuple[tuple[int, int], ...]:
    if windows is None:
        return ((0, samples),)
    at = 0
    for start, stop in windows:
        if start != at or not start < stop <= samples:
            raise ModelError(f"window ({start}, {stop}) must begin at sample {at} and end by {samples}")
        at = stop
    if at != samples:
        raise ModelError(f"windows end at sample {at}, the record has {samples}; cover all of it")
    return tuple((int(start), int(stop)) for start, stop in windows)


def _rows(compiled: CompiledModel, measurement: Measurement) -> Whole:
    """Rows of the measured outputs among the model's."""
    inputs = tuple(terminal.name for terminal in compiled.inputs)
    if measurement.input_names != inputs:
        raise ModelError(
            f"log {measurement.log!r} has inputs {', '.join(measurement.input_names) or 'none'}, the model takes "
            f"{', '.join(inputs) or 'none'}; take the measurement for this model"
        )
    names = [terminal.name for terminal in compiled.outputs]
    missing = [name for name in measurement.output_names if name not in names]
    if missing:
        raise ModelError(f"no output {missing[0]!r} in the model; outputs: {', '.join(names) or 'none'}")
    return np.array([names.index(name) for name in measurement.output_names], dtype=np.int64)


def _port_motion(compiled: CompiledModel, port: int, integration: Integration, columns: Real) -> Real:
    """``[displacement, velocity, force; sample]`` at any port, whether a law acts there or not."""
    active = list(integration.ports)
    found = []
    for state, column, through in (
        (compiled.displacement_state, compiled.displacement_column, compiled.displacement_port),
        (compiled.velocity_state, compiled.velocity_column, compiled.velocity_port),
    ):
        moved = state[port] @ integration.states + columns @ column[port]
        found.append(moved + through[port, active] @ integration.force)
    own = integration.force[active.index(port)] if port in active else np.zeros(columns.shape[0])
    return np.vstack([*found, own])

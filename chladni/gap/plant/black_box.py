"""Plants that only respond: runs of somebody else's program under a log, and what small pulses tell of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np
from scipy.ndimage import uniform_filter1d

from chladni.gap.calibration import AHEAD, GRANTED, KEPT, MANY, NUDGE, SLIGHT, SMOOTH, WIDE, Z_GRID
from chladni.gap.plant.kept import Kept
from chladni.gap.plant.linear_view import Way
from chladni.gap.plant.record_lines import RecordLines
from chladni.gap.plant.tunable import Scaled
from chladni.gap.records.measurement import Measurement
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port_law import PortLaw
from chladni.models.simulators.simulator import SimulatorResponse
from chladni.signals.arrays import Complex, Real


@runtime_checkable
class BlackBox(Model, Protocol):
    """A plant without known equations; `compile` gives its terminals and joints, with nothing in between."""

    def respond(self, inputs: Real, sample_rate_hz: float) -> SimulatorResponse:
        """Run from its own start under ``inputs [input, sample]``; `ModelError` when it diverges."""

    def refined(self) -> Self | None:
        """Give the same with steps half as long; None where it can't."""

    @property
    def untold(self) -> tuple[str, ...]:
        """Sentences on what can't be looked for in it."""


@dataclass(frozen=True, slots=True)
class _Pulse:
    """A force at a joint that knows nothing but the time: implements `Effect`."""

    site: str
    force: float
    at_s: float
    interval_s: float

    effect = "pulse"

    @property
    def values(self) -> Mapping[str, float]:
        """Of interest to nobody."""
        return {}

    def attach(self, compiled: CompiledModel) -> CompiledModel:
        """Give the joint with the pulse's law."""
        numbers = (self.force, self.at_s, self.interval_s)
        law = PortLaw(port=compiled.port_index(self.site), function=_pulse_law, parameters=numbers)
        return replace(compiled, laws=(*compiled.laws, law))


def _pulse_law(_d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    return float(parameters[0] * max(0.0, 1.0 - abs(t - parameters[1]) / parameters[2]))


class BlackBoxRuns:
    """Runs of a black box under one log, at any parameters, and its answers to pulses.

    Signals are rows of ``[signal, sample]``: the measured outputs, then displacement and velocity of each joint.
    """

    def __init__(self, box: BlackBox, tunables: Scaled, measurement: Measurement) -> None:
        self.box, self.tunables, self.measurement = box, tunables, measurement
        self.compiled = box.compile()
        names = [terminal.name for terminal in self.compiled.outputs]
        self._rows = [names.index(name) for name in measurement.output_names]
        self._runs: Kept[Real] = Kept(4 * KEPT)
        self._slopes: Kept[Real] = Kept(KEPT)
        self._answers: Kept[Real] = Kept(4 * KEPT)
        self._decays: Kept[Real] = Kept(1)
        self._sizes: Kept[float] = Kept(4 * KEPT)
        self._doubt: Kept[Real] = Kept(1)

    def at(self, z: Real) -> Real:
        """``[signal, sample]`` at ``z [parameter]``, in units of their tolerance."""
        return self._runs.get(z.tobytes(), lambda: self._signals(self._set(z), self.measurement.inputs))

    def slopes(self, z: Real) -> Real:
        """``[parameter, signal, sample]`` change with each parameter, at parameters near z."""
        near = _near(z)
        return self._slopes.get(near.tobytes(), lambda: self._differences(near))

    def view(self, z: Real, lines: RecordLines) -> "BlackBoxView":
        """Give the plant at z on some lines."""
        return BlackBoxView(self, z, lines)

    def answer(self, z: Real, kind: str, name: str) -> Real:
        """``[signal, sample]`` change by a force of one at a joint, or of an input, for the sample `AHEAD`.

        The mean over a few pulses along the record, at parameters near z.
        """
        near = _near(z)
        return self._answers.get((near.tobytes(), kind, name), lambda: self._answer(near, kind, name))

    def doubt(self) -> Real:
        """``[output]`` share of a force's answer that differs from pose to pose: no linear view follows it.

        Of all joints and inputs the largest, as power.
        """
        return self._doubt.get(None, self._doubted)

    def _doubted(self) -> Real:
        nominal, count = np.zeros(len(self.tunables.names)), len(self._rows)
        found = np.zeros(count)
        for kind, name in self._sites():
            answers = self._answers_at(nominal, kind, name)
            # As far as all of them were followed.
            told = min(answer.shape[1] for answer in answers)
            each = np.array([answer[:count, :told] for answer in answers])
            whole = np.sum(each**2, axis=(0, 2))
            apart = np.sum((each - each.mean(axis=0)) ** 2, axis=(0, 2)) * len(each) / (len(each) - 1)
            found = np.maximum(found, np.where(whole > 0, apart / np.where(whole > 0, whole, 1.0), 0.0))
        return np.minimum(found, 1.0)

    def error(self, lines: RecordLines) -> Real:
        """``[output, line]`` power of what is missed at the nominal parameters that no linear view follows."""
        nominal = np.zeros(len(self.tunables.names))
        missed = lines.spectrum(self.measurement.outputs - self.at(nominal)[: len(self._rows)])
        power = uniform_filter1d(np.mean(np.abs(missed) ** 2, axis=1), SMOOTH, axis=-1, mode="reflect")
        return np.asarray(self.doubt()[:, None] * power)

    def decays(self) -> Real:
        """``[decay, signal, sample]`` that span what the plant does when it's let go: what follows after pulses.

        A force that still acts at a record's end leaves what its spectrum would have come in again at the start.
        """
        return self._decays.get(None, self._spanned)

    def _spanned(self) -> Real:
        nominal, samples = np.zeros(len(self.tunables.names)), self.measurement.samples
        rows = []
        for shift in np.unique(np.geomspace(1, max(samples // 4, 1), MANY).astype(int)):
            for kind, name in self._sites():
                answer = self.answer(nominal, kind, name)[:, AHEAD + shift :]
                rows.append(np.pad(answer, ((0, 0), (0, samples - answer.shape[1]))))
        count, free = len(self._rows), np.array(rows)
        scale = np.std(self.measurement.outputs, axis=1)
        seen = (free[:, :count] / np.where(scale > 0, scale, 1.0)[:, None]).reshape(len(free), -1)
        size = np.linalg.norm(seen, axis=1)
        free, seen = (one[size > 0] / size[size > 0].reshape(-1, *[1] * (one.ndim - 1)) for one in (free, seen))
        values, vectors = np.linalg.eigh(seen @ seen.T)
        kept = values > GRANTED * values.max(initial=0.0)
        return np.asarray(np.tensordot((vectors[:, kept] / np.sqrt(values[kept])).T, free, axes=1))

    def _set(self, z: Real) -> BlackBox:
        return self.box.with_values(self.tunables.values(z)) if z.size else self.box

    def _signals(self, box: BlackBox, inputs: Real) -> Real:
        found = box.respond(inputs, self.measurement.sample_rate_hz)
        moved = [row for motion in found.motions for row in (motion.displacement, motion.velocity)]
        return np.vstack([found.outputs[self._rows], *moved])

    def _differences(self, z: Real) -> Real:
        # Inward, where the other side may lie outside of what is possible.
        steps = np.diag(np.where(z > 0, -NUDGE, NUDGE))
        found = np.zeros((z.size, *self.at(z).shape))
        for place, step in enumerate(steps):
            found[place] = (self._signals(self._set(z + step), self.measurement.inputs) - self.at(z)) / step[place]
        return found

    def _answer(self, z: Real, kind: str, name: str) -> Real:
        found, told = np.zeros_like(self.at(z)), np.zeros(self.measurement.samples)
        for answer in self._answers_at(z, kind, name):
            found[:, : answer.shape[1]] += answer
            told[: answer.shape[1]] += 1.0
        return found / np.maximum(told, 1.0)

    def _answers_at(self, z: Real, kind: str, name: str) -> list[Real]:
        """``[signal, sample]`` from `AHEAD` before each pulse on, for one of one."""
        # In thirds of the record: a machine answers otherwise in another pose.
        places = [AHEAD + turn * self.measurement.samples // 3 for turn in range(3)]
        size = self._sizes.get((kind, name), lambda: self._size(kind, name, places[0]))
        return [self._pulsed(z, kind, name, size, at)[:, at - AHEAD :] / size for at in places]

    def _sites(self) -> list[tuple[str, str]]:
        joints = [("joint", port.name) for port in self.compiled.ports]
        return joints + [("input", terminal.name) for terminal in self.compiled.inputs]

    def _size(self, kind: str, name: str, at: int) -> float:
        """Pulse that is answered by as little as is wanted."""
        nominal = np.zeros(len(self.tunables.names))
        size = SLIGHT * float(np.max(np.abs(self.measurement.inputs), initial=0.0)) or 1.0
        for _ in range(3):
            share = self._share(self._pulsed(nominal, kind, name, size, at))
            if not share or 1 / WIDE < share / SLIGHT < WIDE:
                break
            size *= SLIGHT / share
        return size

    def _share(self, change: Real) -> float:
        """Largest change of an output over the output's own largest."""
        whole = np.max(np.abs(self.measurement.outputs), axis=1)
        largest = np.max(np.abs(change[: len(whole)]), axis=1)
        return float(np.max(largest / np.where(whole > 0, whole, 1.0)))

    def _pulsed(self, z: Real, kind: str, name: str, size: float, at: int) -> Real:
        """``[signal, sample]`` change by a pulse."""
        box, inputs, rate = self._set(z), self.measurement.inputs, self.measurement.sample_rate_hz
        if kind == "input":
            inputs = np.array(inputs)
            inputs[self.measurement.input_names.index(name), at] += size
        else:
            pulse = _Pulse(name, size, at / rate, 1.0 / rate)
            box = box.with_effects((*box.effects, pulse))
        return self._signals(box, inputs) - self.at(z)


def _near(z: Real) -> Real:
    # Without the sign of zero: what is the same has one key.
    return np.asarray(Z_GRID * np.round(z / Z_GRID) + 0.0)


class BlackBoxView:
    """A black box on the lines of a record: implements `View`.

    What the inputs do is what it does; what forces do besides is linear in them, as pulses tell.
    """

    #: Pulses are followed to the record's end, and a step acts for all of itself.
    rounding = SLIGHT

    def __init__(self, runs: BlackBoxRuns, z: Real, lines: RecordLines) -> None:
        self.compiled, self.lines = runs.compiled, lines
        self._runs, self._z, self._count = runs, z, len(runs.measurement.output_names)
        self._spectrum = lines.spectrum(runs.at(z))
        free = np.fft.rfft(runs.decays()[..., : lines.samples], axis=-1)[..., lines.index]
        self._free = np.asarray(free / np.sqrt(lines.samples), dtype=np.complex128)

    def forced(self) -> Complex:
        """``[output, segment, line]`` under the log's inputs."""
        return self._spectrum[: self._count]

    def response(self, transient: Real | None, forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[output, segment, line]`` under the log's inputs, decays and forces ``[segment, line]``."""
        return self._moved(transient, [(way.outputs, force) for way, force in forces], slice(self._count))

    def states(self, _transient: Real | None, _forces: Sequence[tuple[Way, Complex]]) -> Complex:
        """``[decay, segment, line]``: nobody sees its states."""
        return np.zeros((len(self._free), *self._spectrum.shape[1:]), dtype=np.complex128)

    def transients(self) -> Complex:
        """``[decay, output, line]``, see `BlackBoxRuns.decays`."""
        return self._free[:, : self._count]

    def motion(
        self, port: int, transient: Real | None, forces: Sequence[tuple[Way, Complex]]
    ) -> tuple[Complex, Complex]:
        """Displacement and velocity ``[segment, line]`` at a joint, under the same as `response`."""
        rows = slice(self._count + 2 * port, self._count + 2 * port + 2)
        found = self._moved(transient, [(way.states[2 * port :][:2], force) for way, force in forces], rows)
        return found[0], found[1]

    def _moved(self, transient: Real | None, forces: Sequence[tuple[Complex, Complex]], rows: slice) -> Complex:
        """``[signal, segment, line]`` of some signals."""
        found = self._spectrum[rows]
        if transient is not None:
            found = found + np.einsum("dol,ds->osl", self._free[:, rows], transient)
        for pattern, force in forces:
            found = found + pattern[:, None] * force
        return np.asarray(found, dtype=np.complex128)

    def pattern(self, way: Way) -> Complex:
        """``[output, line]`` that a force of one prints."""
        return way.outputs

    def way_of_port(self, port: int) -> Way:
        """Way of a force at a joint; its `states` are displacement and velocity of each joint."""
        return self._way(self._runs.answer(self._z, "joint", self.compiled.ports[port].name), port=port)

    def way_of_input(self, name: str) -> Way:
        """Way of a change of an input."""
        return self._way(self._runs.answer(self._z, "input", name), column=self.compiled.column_of(name))

    def way_of_output(self, place: int) -> Way:
        """Way of an error of the sensor in row `place` of the measured outputs."""
        error = np.zeros((self._spectrum.shape[0], AHEAD + 1))
        error[place, AHEAD] = 1.0
        return self._way(error)

    def _way(self, answer: Real, *, port: int | None = None, column: int | None = None) -> Way:
        # What lasts longer than a segment comes in again at its start: the transform is the same.
        length = self.lines.samples
        folded = np.pad(answer, ((0, 0), (0, -answer.shape[1] % length)))
        printed = np.fft.rfft(folded.reshape(len(answer), -1, length).sum(axis=1), axis=1)[:, self.lines.index]
        printed = printed * self.lines.z**AHEAD
        none = np.zeros((0, self.lines.index.size), dtype=np.complex128)
        return Way(
            states=printed[self._count :], outputs=printed[: self._count], carried=none, port=port, column=column
        )

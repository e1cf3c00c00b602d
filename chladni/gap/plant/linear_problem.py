"""A measurement beside the linear part of a model: residual spectra, and how they move with the parameters."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from chladni.gap.calibration import KEPT, LAW_ERROR, SPARE_BYTES, STEP, THREADS
from chladni.gap.plant.black_box import BlackBox, BlackBoxRuns
from chladni.gap.plant.kept import Kept
from chladni.gap.plant.linear_view import LinearView, View, Way
from chladni.gap.plant.places import Site, way_to
from chladni.gap.plant.record_lines import RecordLines
from chladni.gap.plant.tunable import Scaled, Varied
from chladni.gap.plant.view_slopes import same_frame, view_slopes
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.pair import PairPorts, unlinked_pairs
from chladni.signals.arrays import Complex, Real

#: Complex numbers that slopes of some parameters at once may need beside their result: a quarter of what is spare.
_AT_ONCE = SPARE_BYTES // 64


class LinearProblem:
    """One measurement, one model, some lines; linearised wherever it's asked for.

    Problems of one model share the equations of its neighbours.
    """

    def __init__(
        self,
        model: Varied,
        measurement: Measurement,
        noise: NoiseFloor,
        tunables: Scaled,
        lines: RecordLines,
        *,
        neighbours: "Neighbours | BlackBoxRuns | None" = None,
    ) -> None:
        self.model, self.measurement, self.tunables, self.lines = model, measurement, tunables, lines
        self.noise = noise
        self._neighbours = _neighbours(model, tunables, measurement) if neighbours is None else neighbours
        self._inputs: dict[tuple[object, ...], Complex] = {}
        self._views: Kept[View] = Kept(THREADS)
        compiled = model.compile()
        names = [terminal.name for terminal in compiled.outputs]
        self.rows = tuple(names.index(name) for name in measurement.output_names)
        #: ``[output, line]``: power of what no model, and no linear view, follows a machine to.
        self.error = (LAW_ERROR * np.std(measurement.outputs, axis=1)[:, None]) ** 2
        if isinstance(self._neighbours, BlackBoxRuns):
            self.error = self.error + self._neighbours.error(lines)
        self.weight = 1.0 / np.sqrt(noise.density(lines.cycles) + self.error)[:, None]
        self.measured = lines.spectrum(measurement.outputs)

    @property
    def scale(self) -> int:
        """Complex numbers on all lines and outputs together."""
        return int(self.measured.size)

    def on(self, lines: RecordLines) -> "LinearProblem":
        """Give the same problem on other lines."""
        return LinearProblem(
            self.model, self.measurement, self.noise, self.tunables, lines, neighbours=self._neighbours
        )

    def with_noise(self, noise: NoiseFloor) -> "LinearProblem":
        """Give the same problem with another noise."""
        return LinearProblem(
            self.model, self.measurement, noise, self.tunables, self.lines, neighbours=self._neighbours
        )

    def limits(self, z: Real) -> Real:
        """``[parameter]`` bounds on ``abs(z)`` of a search that starts here, wide where that is outside."""
        return self.tunables.limits(self.tunables.wrong(z))

    @property
    def starts_known(self) -> bool:
        """Whether the plant starts where it starts: then segments of a record forgive nothing."""
        return isinstance(self._neighbours, BlackBoxRuns)

    def view(self, z: Real) -> View:
        """Give the linear part at parameters z."""
        # What is profiled at some parameters is linearised there next.
        return self._views.get(z.tobytes(), lambda: self._linear(z))

    def beside(self, z: Real, compiled: CompiledModel) -> View:
        """Give the linear part at parameters z as equations with more in them have it; a black box without."""
        if isinstance(self._neighbours, BlackBoxRuns):
            return self.view(z)
        return LinearView(compiled, self.lines, self.measurement.inputs, self.rows, known=self._inputs)

    def _linear(self, z: Real) -> View:
        if isinstance(self._neighbours, BlackBoxRuns):
            return self._neighbours.view(z, self.lines)
        equations = self._neighbours.at(z)
        return LinearView(equations, self.lines, self.measurement.inputs, self.rows, known=self._inputs)

    def way(self, view: View, site: Site) -> Way:
        """How a force at a site enters the equations of a view."""
        return way_to(view, site, self.measurement.output_names)

    def pattern(self, view: View, site: Site) -> Complex:
        """Whitened ``[output, 1, line]`` of a force at a site."""
        return np.asarray(view.pattern(self.way(view, site))[:, None] * self.weight, dtype=np.complex128)

    def transients(self, view: View) -> Complex:
        """Whitened ``[state, output, 1, line]``, see `LinearView.transients`: each segment has its own."""
        return np.asarray(view.transients()[:, :, None] * self.weight, dtype=np.complex128)

    def response(self, z: Real, transient: Real, forces: Sequence[tuple[Site, Complex]]) -> Complex:
        """Whitened ``[output, segment, line]`` response at parameters z to inputs, transients and forces."""
        view = self.view(z)
        ways = [(self.way(view, site), force) for site, force in forces]
        return np.asarray(view.response(transient, ways) * self.weight, dtype=np.complex128)

    def slopes(self, z: Real, transient: Real, forces: Sequence[tuple[Site, Complex]]) -> Complex:
        """``[tunable, output, segment, line]``: derivatives of `response` with all else held."""
        if not z.size:
            return np.zeros((0, *self.measured.shape), dtype=np.complex128)
        if isinstance(self._neighbours, BlackBoxRuns):
            changes = self._neighbours.slopes(z)[:, : len(self.rows)]
            return np.asarray(self.lines.spectrum(changes) * self.weight, dtype=np.complex128)
        # Of equations it is one.
        view = cast("LinearView", self.view(z))
        ways = [(self.way(view, site), force) for site, force in forces]
        changed = self._neighbours.changed(z)
        found = np.empty((z.size, *self.measured.shape), dtype=np.complex128)
        count = max(1, _AT_ONCE // (max(1, len(view.compiled.states)) * self.measured[0].size))
        for first in range(0, z.size, count):
            places = range(first, min(first + count, z.size))
            plain = [place for place in places if same_frame(view.compiled, changed[place])]
            slopes = view_slopes(view, [changed[place] for place in plain], STEP, transient, ways)
            slopes *= self.weight
            found[plain] = slopes
            for place in set(places) - set(plain):
                found[place] = self._difference(z, place, transient, forces)
        return found

    def _difference(self, z: Real, place: int, transient: Real, forces: Sequence[tuple[Site, Complex]]) -> Complex:
        """Slope along a parameter that moves a dead time, which isn't in the equations."""
        here = self.response(z, transient, forces)
        moved = z + STEP * np.eye(z.size)[place]
        there = self._linear(moved)
        ways = [(self.way(there, site), force) for site, force in forces]
        slope = (there.response(transient, ways) * self.weight - here) / STEP
        return np.asarray(slope, dtype=np.complex128)


def _neighbours(model: Varied, tunables: Scaled, measurement: Measurement) -> "Neighbours | BlackBoxRuns":
    if isinstance(model, BlackBox):
        return BlackBoxRuns(model, tunables, measurement)
    return Neighbours(model, tunables)


class Neighbours:
    """Equations of one model, kept while they are asked for again."""

    def __init__(self, model: Varied, tunables: Scaled) -> None:
        self._model, self._tunables = model, tunables
        # Where bodies share no joint the model may lack one. Which do is the same at all numbers.
        compiled = model.compile()
        self._pairs = PairPorts(compiled, unlinked_pairs(compiled))
        self._at: Kept[CompiledModel] = Kept(KEPT)
        self._changed: Kept[tuple[CompiledModel, ...]] = Kept(KEPT)

    def at(self, z: Real) -> CompiledModel:
        """Give the equations at ``z [parameter]``, in units of their tolerance."""
        return self._at.get(z.tobytes(), lambda: self._linked(self._set(z)))

    def changed(self, z: Real) -> tuple[CompiledModel, ...]:
        """``[parameter]``: equations with each parameter `STEP` further than at z."""
        return self._changed.get(z.tobytes(), lambda: self._steps(z))

    def _set(self, z: Real) -> Varied:
        return self._model.with_values(self._tunables.values(z)) if z.size else self._model

    def _steps(self, z: Real) -> tuple[CompiledModel, ...]:
        # From the model at z each takes one new number.
        base, there = self._set(z), self._tunables.values(z + STEP)
        return tuple(self._linked(base.with_values({name: there[name]})) for name in self._tunables.names)

    def _linked(self, model: Varied) -> CompiledModel:
        return self._pairs.of(model.compile())

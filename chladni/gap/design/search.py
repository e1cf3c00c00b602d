"""Search among further measurements for those that tell candidates apart."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chladni.gap.calibration import EFFECTIVE_SAMPLES, LINES, LITTLE, PLACES, PROFILE_STEPS, ZERO
from chladni.gap.design.course import Course
from chladni.gap.design.experiment import Change, Design, Experiment
from chladni.gap.design.experiments import Reach
from chladni.gap.design.more_sensors import more_sensors, sensor_words, with_noise_of, with_rows, with_sensors
from chladni.gap.design.rival import Rival, imitated
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import Windows
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.model import Model
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError, ModelError

#: An experiment with the rows of the outputs that are measured in it.
_Record = tuple[Course, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class _Found:
    """A design with what it takes to compute it more precisely."""

    design: Design
    course: Course
    chosen: tuple[int, ...]


class Search:
    """Further measurements that would tell the candidates of one log apart.

    Parameters
    ----------
    candidates
        Fitted, best first.
    seed
        Of random excitations.

    Raises
    ------
    ModelError
        When a candidate can't be simulated with the log's own inputs.
    """

    def __init__(
        self,
        model: Model,
        measurement: Measurement,
        tunables: Tunables,
        candidates: Sequence[Contestant],
        noise: NoiseFloor,
        *,
        seed: int,
    ) -> None:
        candidates = candidates[:PLACES]
        #: Kinds of changes that `best` looked at.
        self.tried: frozenset[Change] = frozenset()
        self._rivals = [Rival(one, tunables) for one in candidates]
        suspects = {named.site.split(".")[0] for one in candidates for named in one.hypothesis.named}
        self._sensors = more_sensors(model, measurement, suspects)
        self._own = tuple(range(len(measurement.output_names)))
        stretch, begin, self._windows = _stretch(measurement, candidates, 4 * LINES)
        self._reach = Reach(
            model=with_sensors(model, self._sensors), measurement=stretch, begins_with_log=begin == 0, seed=seed
        )
        self._record = with_rows(stretch, self._reach.model, self._sensors)
        self._logged = Course(self._reach.as_logged(), self._rivals, self._record, self._windows)
        self._noise = with_noise_of(
            noise, measurement.output_units, self._record.output_units[len(self._own) :], self._logged.outputs
        )
        self._detail = _details(candidates[0], self._noise, self._logged.outputs)
        self.now_nats = self._nats([(self._logged, self._own)], PROFILE_STEPS // 2)

    def best(self) -> tuple[Design, ...]:
        """Designs that tell the candidates apart, the least effort first; else the one that comes nearest.

        At most two: one changes how the machine is driven, the other the sensors or the input's place.
        """
        tried = [*self._with_sensors(), *self._each(self._reach.levels())]
        for more in (self._reach.courses, self._reach.positions):
            if not self._enough(tried):
                tried += self._each(more())
        self.tried = frozenset(one.design.change for one in tried)
        sure = self._confirmed(self._enough(tried))
        if sure:
            return tuple(sure)
        tried.sort(key=lambda one: (-one.design.nats, one.design.effort))
        return tuple(self._precise(one).design for one in tried[:1])

    def _confirmed(self, found: Sequence[_Found]) -> list[Design]:
        """Of each kind the first that still tells them apart when refits are followed further."""
        kept: dict[bool, Design] = {}
        for one in found:
            built = one.design.change in ("sensor", "position")
            if built not in kept:
                precise = self._precise(one)
                if precise.design.tells:
                    kept[built] = precise.design
        return sorted(kept.values(), key=lambda one: one.effort)

    def _with_sensors(self) -> list[_Found]:
        return [
            self._found(
                replace(self._logged.experiment, change="sensor", words=f"Add {sensor_words(sensor)}"),
                self._logged,
                (*self._own, len(self._own) + place),
            )
            for place, sensor in enumerate(self._sensors)
        ]

    def _each(self, experiments: Iterable[Experiment]) -> list[_Found]:
        found = []
        for experiment in experiments:
            try:
                found.append(self._found(experiment, self._course(experiment), self._own))
            except (ModelError, EstimateError):
                # A candidate that diverges there says that nobody should try it.
                continue
        return found

    def _course(self, experiment: Experiment) -> Course:
        if experiment.change == "repeats":
            return self._logged.again(experiment)
        return Course(experiment, self._rivals, self._record, self._windows)

    def _found(self, experiment: Experiment, course: Course, chosen: tuple[int, ...]) -> _Found:
        design = Design(
            change=experiment.change,
            words=experiment.words,
            effort=experiment.effort,
            nats=self._nats([(self._logged, self._own), (course, chosen)], 1),
            now_nats=self.now_nats,
        )
        return _Found(design, course, chosen)

    def _precise(self, found: _Found) -> _Found:
        nats = self._nats([(self._logged, self._own), (found.course, found.chosen)], PROFILE_STEPS // 2)
        return replace(found, design=replace(found.design, nats=nats))

    def _nats(self, records: Sequence[_Record], passes: int) -> float:
        """Log evidence between the first candidate and the nearest other one, of records that are explained together.

        The mean of what is expected when the one is true and when the other is (Box & Hill 1967), with the likelihood
        of the contest, and so many linear steps of each refit.
        """
        others = range(1, len(self._rivals))
        return min(0.5 * sum(self._lost(records, pair, passes) for pair in ((0, one), (one, 0))) for one in others)

    def _lost(self, records: Sequence[_Record], pair: tuple[int, int], passes: int) -> float:
        """Nats that the second of a pair is behind when the first is true, however it's refitted."""
        rival = self._rivals[pair[1]]
        at, best = np.zeros(rival.unknowns), np.inf
        for step in range(passes):
            try:
                parts = [
                    course.part(self._noise, self._detail, chosen, pair, at if step else None)
                    for course, chosen in records
                ]
            except ModelError:
                # Where it diverges it imitates nothing: what was found before stands.
                break
            at, left = imitated(rival, at, parts)
            shares = [np.log1p(one / part.scale) for one, part in zip(left, parts, strict=True)]
            lost = 0.5 * EFFECTIVE_SAMPLES * float(np.sum(np.concatenate(shares))) + rival.paid(at)
            # A step may promise too much; that it promises too little is not possible for long.
            best = min(best, max(lost, 0.0))
        return best

    def _enough(self, tried: Sequence[_Found]) -> list[_Found]:
        return sorted(
            (one for one in tried if one.design.tells), key=lambda one: (one.design.effort, -one.design.nats)
        )


def _details(best: Contestant, noise: NoiseFloor, outputs: Real) -> Real:
    """``[output]`` share of its power that the best candidate leaves beyond noise."""
    power = np.maximum(np.mean(noise.whitened(outputs) ** 2, axis=-1), ZERO)
    count = best.held.size
    own = np.maximum(best.held - 1.0, 0.0) / power[:count]
    return np.concatenate([own, np.full(power.size - count, np.median(own))])


def _stretch(
    measurement: Measurement, candidates: Sequence[Contestant], most: int
) -> tuple[Measurement, int, Windows | None]:
    """Part of a log that stands for all of it: its first sample, and its windows."""
    windows = _windows(candidates[0], measurement.samples)
    if len(windows) > 1:
        kept = [one for one in windows if one[1] <= max(most, windows[0][1])]
        return _part(measurement, 0, kept[-1][1]), 0, tuple(kept)
    # What changes at a time of its own is seen in the whole log only.
    timed = any(effect.kind.clues.timed for one in candidates for effect in one.hypothesis.effects)
    count = measurement.samples if timed else min(most, measurement.samples)
    power = np.sum(
        measurement.outputs**2 / np.maximum(np.var(measurement.outputs, axis=1), ZERO)[:, None],
        axis=0,
    )
    begins = np.arange(0, measurement.samples - count + 1, count)
    loud = np.array([float(np.mean(power[begin : begin + count])) for begin in begins])
    begin = int(begins[np.argmin(np.abs(np.log(np.maximum(loud, ZERO) / np.mean(power))))])
    part = _part(measurement, begin, begin + count)
    if begin:
        # From rest in the middle of a course: a jump would shake all modes as the log never did.
        fade = np.minimum(np.arange(count) / (LITTLE * count), 1.0)
        part = replace(part, inputs=part.inputs * np.sin(0.5 * np.pi * fade) ** 2)
    return part, begin, None


def _windows(fitted: Contestant, samples: int) -> list[tuple[int, int]]:
    """Windows of a fit, which are as long as each other: each has an initial state."""
    edges = np.round(np.linspace(0, samples, len(fitted.fit.initial) + 1)).astype(int).tolist()
    return list(pairwise(edges))


def _part(measurement: Measurement, start: int, stop: int) -> Measurement:
    inputs, outputs = measurement.inputs[:, start:stop], measurement.outputs[:, start:stop]
    return replace(measurement, inputs=inputs, outputs=outputs, period_samples=None, transient_periods=0)

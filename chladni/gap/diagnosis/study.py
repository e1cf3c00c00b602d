"""One log beside one model, made ready: noise, training stretches, free runs, location."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import FAR, HARDLY_ANY, MOST, STEP
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.comparison.whitening import quiet_floor
from chladni.gap.diagnosis.told_holds import with_told_holds
from chladni.gap.explanation.contest import Contest, training_mask
from chladni.gap.explanation.known_effect import KnownStates
from chladni.gap.location.locate import Located, Location, locate
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.tunable import Tunables
from chladni.gap.plant.windows import short_windows, training_in_windows, windows_for
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.core.model import Model
from chladni.models.effects.catalogue import taking_part
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.lattice import Lattice
from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, ModelError
from chladni.signals.sensor_quality import sensor_quality
from chladni.signals.time_series import TimeSeries

#: Most e-folds that an error may grow by from one sample to the next, before a step of differences is all there is.
_E_FOLDS = -float(np.log(STEP))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Study:
    """What all steps of a diagnosis share.

    Attributes
    ----------
    model, measurement
        What is compared.
    stated
        The model as it was given: a hold that it states is a fact, one that was told is weighed to the end.
    location
        Where an unknown force explains the gap, with the noise behind it.
    contest
        In which hypotheses are fitted.
    windows
        ``(start, stop)`` samples, None in free run.
    lattices
        Outputs whose samples stand on a lattice that is coarse beside their noise, by name.
    repeating
        Outputs that hold their samples, without standing on a lattice.
    """

    model: Model
    stated: Model
    measurement: Measurement
    location: Location
    contest: Contest
    windows: tuple[tuple[int, int], ...] | None
    lattices: Mapping[str, Lattice]
    repeating: tuple[str, ...]
    kinds: tuple[EffectKind, ...]

    @property
    def held(self) -> Mask:
        """``[sample]`` that no fit sees."""
        return ~self.contest.training

    @property
    def coarse(self) -> frozenset[str]:
        """Outputs whose steps are larger than their signal's RMS: what rounding takes follows the signal."""
        return _coarse(self.measurement, self.lattices)

    @property
    def stepping(self) -> EffectKind | None:
        """The effect that samples themselves show by standing on a lattice."""
        return _stepping(self.kinds)

    @property
    def of_constant(self) -> EffectKind | None:
        """The effect that is a constant of an output, when it takes part."""
        return next((kind for kind in self.kinds if kind.clues.of_constant), None)

    def constants(self, fit: OutputErrorFit, noise: NoiseFloor) -> dict[str, float]:
        """Constants of outputs that a fit left free and that are larger than the noise, by name."""
        rows = zip(self.measurement.output_names, fit.offsets.tolist(), noise.rms.tolist(), strict=True)
        return {name: value for name, value, rms in rows if abs(value) > rms}

    def takes_part(self, word: str) -> bool:
        """Whether an effect is one of those that are looked for."""
        return any(kind.name == word for kind in self.kinds)


def study_of(
    model: Model, measurement: Measurement, *, leave_out: frozenset[str], own: Mapping[str, EffectKind]
) -> Study:
    """Prepare the study of one log.

    Raises
    ------
    EstimateError
        When the model runs away from one sample to the next.
    """
    _require_within_reach(model, measurement)
    measurement = with_period(measurement)
    noise = floor_of(measurement)
    kinds = taking_part(leave_out, own.values())
    lattices = _lattices(measurement, noise, _stepping(kinds))
    noise = _with_rounding(noise, model, measurement, lattices)
    tunables = Tunables.of(model)
    location = locate(model, measurement, noise, tunables)
    stated, model = model, with_told_holds(model, location)
    if model is not stated:
        location = locate(model, measurement, noise, tunables)
    windows = None if _runs_free(model, location) else windows_for(model, measurement)
    run = FreeRun(model, measurement, windows=windows)
    training = training_of(measurement, windows)
    return Study(
        model=model,
        stated=stated,
        measurement=measurement,
        location=location,
        contest=Contest(run, location.problem, training),
        windows=windows,
        lattices=lattices,
        repeating=_repeating(measurement),
        kinds=kinds,
    )


def over_floor(study: Study, noise: NoiseFloor) -> Study:
    """Give the study of the same log over another floor, its runs as long as they were."""
    noise = _with_rounding(noise, study.model, study.measurement, study.lattices)
    location = locate(study.model, study.measurement, noise, Tunables.of(study.model))
    contest = Contest(study.contest.run, location.problem, study.contest.training, study.contest.states)
    return replace(study, location=location, contest=contest)


def contest_over(study: Study, model: Model) -> Contest:
    """Give the contest on the same log of a model that differs in what happens between samples."""
    old = study.contest
    run = FreeRun(model, study.measurement, windows=study.windows)
    problem = LinearProblem(model, study.measurement, old.noise, run.tunables, old.problem.lines)
    return Contest(run, problem, old.training, old.states)


def over_model(study: Study, model: Model) -> Study:
    """Give the study of the same log beside such a model."""
    return over_floor(replace(study, model=model, contest=contest_over(study, model)), study.contest.noise)


def floor_of(measurement: Measurement) -> NoiseFloor:
    """Give the noise of a log; of an only output without periods the quiet band's, since no fit tells that apart."""
    noise = estimate_noise(measurement)
    return quiet_floor(measurement) if len(measurement.output_names) < 2 and noise.upper_bound.any() else noise


def over_windows(study: Study, states: KnownStates) -> Study:
    """Give the study of the same log over windows that begin at known states."""
    windows = short_windows(study.model, study.measurement)
    run, training = FreeRun(study.model, study.measurement, windows=windows), training_in_windows(windows)
    return replace(study, windows=windows, contest=Contest(run, study.location.problem, training, states))


def recovered_states(problem: LinearProblem, located: Located | None) -> KnownStates | None:
    """Give the states under the unknown forces at a place, or at two; None without any, and of a black box."""
    if located is None or not located.profile.forces or problem.starts_known:
        return None
    first, *others = located.profile.sites
    motion = recovered(problem, located.profile, first, others)
    return KnownStates(names=problem.model.compile().states, values=motion.states(problem))


def step_error(study: Study, fit: OutputErrorFit) -> float | None:
    """How far half a simulator's own step moves a fit on held-out samples, as a gap; None where that isn't told."""
    finer = study.contest.run.refined()
    if finer is None:
        return None
    try:
        moved = fit.outputs - fit.offsets[:, None] - finer.outputs(fit.z, fit.effects)
    except ModelError:
        return float("inf")
    return pooled_gap(moved[:, study.held], study.measurement.outputs[:, study.held])


def training_of(measurement: Measurement, windows: Sequence[tuple[int, int]] | None) -> Mask:
    """Give ``[sample]``: True where fits may look, in one free run or over windows."""
    if windows is None:
        return training_mask(measurement.samples, measurement.sample_rate_hz, measurement.period_samples)
    return training_in_windows(windows)


def _require_within_reach(model: Model, measurement: Measurement) -> None:
    growth = float(np.linalg.eigvals(model.compile().a).real.max(initial=0.0))
    if growth > _E_FOLDS * measurement.sample_rate_hz:
        raise EstimateError(
            f"model {model.name!r} runs away: an error grows e-fold in {1.0 / growth:.2g} s, {_E_FOLDS:.3g} times "
            f"and more between two samples of log {measurement.log!r} ({measurement.sample_rate_hz:g} Hz); check the "
            "gains and signs of its loops, and the units of its parameters"
        )


def _runs_free(model: Model, location: Location) -> bool:
    """Whether the linear part follows the whole record from one state, but for a force at the best place.

    A free body does, when its forces are told well enough; one that doesn't is compared over windows. A black box
    starts nowhere else than where it starts.
    """
    if location.problem.starts_known:
        return True
    growing = np.linalg.eigvals(model.compile().a).real.max(initial=-1.0) * location.problem.measurement.duration_s
    best = location.best
    if growing > 1.0 or best is None or len(location.problem.measured) < 2:
        return False
    return min(best.profile.chi, location.tuned.chi) < FAR


def _stepping(kinds: Iterable[EffectKind]) -> EffectKind | None:
    return next((kind for kind in kinds if kind.clues.in_samples is not None), None)


def _lattices(measurement: Measurement, noise: NoiseFloor, stepping: EffectKind | None) -> dict[str, Lattice]:
    found: dict[str, Lattice] = {}
    lattice_of = stepping.clues.in_samples if stepping is not None else None
    if lattice_of is None:
        return found
    for name, signal, rms in zip(measurement.output_names, measurement.outputs, noise.rms, strict=True):
        lattice = lattice_of(signal)
        # Steps far below the noise are those of any converter.
        if lattice is not None and lattice.rounding_rms > MOST * rms:
            found[name] = lattice
    return found


def _repeating(measurement: Measurement) -> tuple[str, ...]:
    """Names of outputs that hold samples: often, by values that repeat, or long, by the rule for dropouts.

    Of a rest, a range's end or a lattice the values that repeat would be few.
    """
    names, outputs = measurement.output_names, measurement.outputs
    often = {name for name, row in zip(names, outputs, strict=True) if _values_held(row) > HARDLY_ANY * row.size}
    channels = tuple(
        Channel(name=name, unit=unit) for name, unit in zip(names, measurement.output_units, strict=True)
    )
    series = TimeSeries(values=outputs, sample_rate_hz=measurement.sample_rate_hz, channels=channels)
    long = {fault.channel for fault in sensor_quality(series) if fault.kind == "dropouts"}
    return tuple(name for name in names if name in often | long)


def _values_held(signal: Real) -> int:
    """How many different values a signal repeats at once."""
    return int(np.unique(signal[1:][np.diff(signal) == 0]).size)


def _with_rounding(
    noise: NoiseFloor, model: Model, measurement: Measurement, lattices: Mapping[str, Lattice]
) -> NoiseFloor:
    """Give the floor with the rounding of coarse steps in it: no law of motion explains that."""
    rounding = {name: lattice.rounding_rms for name, lattice in lattices.items()}
    coarse = _coarse(measurement, lattices)
    for name, measured, row in _simulated(model, measurement) if coarse else ():
        if name in coarse:
            rounding[name] = max(rounding[name], _rounded_off(row, measured, lattices[name].step))
    return noise.raised(np.array([rounding.get(name, 0.0) for name in measurement.output_names]))


def _coarse(measurement: Measurement, lattices: Mapping[str, Lattice]) -> frozenset[str]:
    rows = zip(measurement.output_names, measurement.outputs, strict=True)
    return frozenset(name for name, row in rows if name in lattices and lattices[name].step > np.std(row))


def _simulated(model: Model, measurement: Measurement) -> list[tuple[str, Real, Real]]:
    """Name, measured and simulated signal of each output by the nominal model; nothing where that diverges."""
    try:
        simulated = FreeRun(model, measurement).outputs()
    except ModelError:
        return []
    return list(zip(measurement.output_names, measurement.outputs, simulated, strict=True))


def _rounded_off(simulated: Real, measured: Real, step: float) -> float:
    """RMS of what rounding takes from a signal like the simulated one: all of it where it stays below a step."""
    rounded = [step * np.round(simulated / step), step * np.floor(simulated / step)]
    nearest = min(rounded, key=lambda row: float(np.std(row - measured)))
    return float(np.std(nearest - simulated))

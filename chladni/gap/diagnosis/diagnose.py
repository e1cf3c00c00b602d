"""The whole diagnosis of a model and its logs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from chladni.gap.calibration import COVERAGE
from chladni.gap.comparison.distortion import distortion_where_told
from chladni.gap.comparison.levels import compare_levels
from chladni.gap.comparison.log_regimes import amplitude
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.shares import Variable, gap_map, where_of
from chladni.gap.diagnosis.advice import advice_on, measure_next
from chladni.gap.diagnosis.closing import Yardstick, closing_of
from chladni.gap.diagnosis.evidence import any_law, evidence
from chladni.gap.diagnosis.naming import (
    causes_named,
    correlation_of,
    naive_of,
    ranking_of,
    tuned_numbers,
    with_shares,
)
from chladni.gap.diagnosis.other_logs import tried_elsewhere
from chladni.gap.diagnosis.remarks import remarks_on
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.diagnosis.verdict import Causes, causes_found
from chladni.gap.location.locate import Located, Location, explained_share, lowest_hz
from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.places import Site
from chladni.gap.records.diagnosis import (
    Diagnosis,
    GapSignals,
    PairShare,
    RestoringForce,
    SiteShare,
    Where,
)
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import OutputErrorFit, fit_output_error
from chladni.models.core.model import Model
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError, ModelError
from chladni.signals.linear_algebra import in_one_thread

StepProgress = Callable[[str, float], None]


@in_one_thread()
def diagnose(
    model: Model,
    measurements: Sequence[Measurement],
    *,
    leave_out: frozenset[str] = frozenset(),
    own_effects: Sequence[EffectKind] = (),
    seed: int = 0,
    progress: StepProgress | None = None,
) -> Diagnosis:
    """Say where a model and logs disagree, what causes it, and how far that closes the gap.

    The first log is diagnosed; with more of them, what changes with level is told too.

    Parameters
    ----------
    measurements
        Logs of the real machine, one or more.
    leave_out
        Words of effects that don't take part.
    own_effects
        Records of the user's that do.
    seed
        Of the bootstrap.
    progress
        Called with the name of the step and the share done.

    Raises
    ------
    EstimateError
        When there's no measurement, or the model diverges on it.
    """
    if not measurements:
        raise EstimateError("no measurement to hold against the model")
    tell = progress or _silent
    tell("locating", 0.0)
    study = study_of(model, measurements[0], leave_out=leave_out, own={one.name: one for one in own_effects})
    tell("explaining", 0.3)
    study, causes = causes_found(study, lambda done: tell("explaining", 0.3 + 0.6 * done))
    tell("measuring the closing", 0.9)
    found = _assembled(study, causes, [one.log for one in measurements], seed)
    # Periods tell noise from distortion at every level, as they did for the first log.
    elsewhere, diverging = tried_elsewhere(study, causes, measurements[1:], seed=seed)
    levels = compare_levels([with_period(one) for one in measurements]) if len(measurements) > 1 else ()
    tell("measuring the closing", 1.0)
    # What is said of a level there needn't be said of its log again.
    remarks = tuple(one for one in found.remarks if not any(one in told for told in levels))
    return replace(found, elsewhere=elsewhere, levels=levels, remarks=(*remarks, *diverging))


def _silent(_step: str, _share: float) -> None:
    pass


def _assembled(study: Study, causes: Causes, logs: Sequence[str], seed: int) -> Diagnosis:
    said = causes_named(study, causes)
    before = _nominal(study)
    shown = causes.best if causes.verdict in ("effect", "parameters") else causes.tuned
    after = shown.fit.outputs
    if causes.shaken is not None:
        after = causes.shaken.predicted
    recoveries = evidence(study, causes, said)
    motion = recoveries[0] if recoveries else None
    distortion = distortion_where_told(study.measurement)
    motions = joint_motions(study, shown.fit, motion)
    yardstick = Yardstick(
        measurement=study.measurement,
        held=study.held,
        noise=causes.noise,
        windows=study.windows,
        across_sensors=causes.shaken is not None,
    )
    gap = closing_of(yardstick, before, causes.tuned.fit.outputs, after, seed=seed)
    return Diagnosis(
        model=study.model.name,
        logs=tuple(logs),
        verdict=causes.verdict,
        causes=with_shares(causes, said, gap),
        ranking=ranking_of(causes, said),
        where=_where(study, causes, before, motions),
        # What the parameters close isn't what nothing explains, and may lie elsewhere.
        left=_where(study, causes, causes.tuned.fit.outputs, motions) if causes.verdict == "unknown" else None,
        gap=gap,
        tuned_parameters=tuned_numbers(study, shown.fit),
        correlation=correlation_of(study.contest.run.tunables, shown.fit),
        any_law=any_law(study, causes, said),
        next_measurement=measure_next(study, causes, seed),
        naive=naive_of(causes),
        remarks=remarks_on(study, causes, shown, distortion),
        advice=advice_on(study, causes),
        restoring_forces=tuple(_restoring(study, causes, one) for one in recoveries),
        signals=_signals(study, causes, before, after),
        distortion=() if distortion is None else distortion.shares,
        answer_set=() if causes.shaken is not None else causes.belief.answer_set(COVERAGE),
        coverage=COVERAGE,
    )


def _nominal(study: Study) -> Real:
    """Free run of the nominal model from the initial state that suits it best."""
    run, contest = study.contest.run, study.contest
    try:
        return fit_output_error(run, contest.noise, training=contest.training, tune=False).outputs
    except ModelError:
        return run.outputs()


def _where(study: Study, causes: Causes, simulated: Real, motions: Mapping[str, Variable]) -> Where:
    found = where_of(study.measurement.outputs - simulated, study.measurement, causes.noise, motions)
    return replace(found, sites=_sites(study.location), pair=_pair(study.location, causes.forces))


def _sites(location: Location) -> tuple[SiteShare, ...]:
    """Sites by falling share, each with the others of its place."""
    alike = {name: place.names for place in location.places for name in place.names}
    return tuple(
        SiteShare(name=name, share=share, group=tuple(one for one in alike[name] if one != name))
        for name, share in sorted(location.shares.items(), key=lambda one: -one[1])
    )


def _pair(location: Location, forces: Located | None) -> PairShare | None:
    if forces is None:
        return None
    first, second = forces.places
    return PairShare(
        groups=(first.names, second.names), share=explained_share(location.tuned.chi, forces.profile.chi)
    )


def _restoring(study: Study, causes: Causes, motion: Recovered) -> RestoringForce:
    port = _port(study, motion.site)
    law = None
    if causes.best.fit.effects and causes.verdict == "effect" and motion.site.kind == "joint":
        law = _law_force(study, causes, motion)
    return RestoringForce(
        site=motion.site.name,
        time_s=motion.time_s,
        displacement=motion.displacement,
        velocity=motion.velocity,
        force=motion.force,
        law_force=law,
        force_unit=port[0],
        displacement_unit=port[1],
    )


def _law_force(study: Study, causes: Causes, motion: Recovered) -> Real | None:
    fit = causes.best.fit
    try:
        return study.contest.run.motion(fit.z, fit.effects, fit.initial, site=motion.site.name).force
    except ModelError:
        return None


def _port(study: Study, site: Site) -> tuple[str, str]:
    # As it was located: two bodies that no joint links have a port there alone.
    compiled = study.location.problem.view(study.location.tuned.z).compiled
    for port in compiled.ports:
        if (port.name, port.kind) == (site.name, site.kind):
            return port.unit, port.displacement_unit
    for terminal in (*compiled.inputs, *compiled.outputs):
        if terminal.name == site.name:
            return terminal.unit, terminal.unit
    return "1", "1"


def _signals(study: Study, causes: Causes, before: Real, after: Real) -> GapSignals:
    measurement = study.measurement
    time_s, frequency_hz, density = gap_map(
        measurement.outputs - before, measurement.outputs, measurement.sample_rate_hz
    )
    return GapSignals(
        log=measurement.log,
        sample_rate_hz=measurement.sample_rate_hz,
        output_names=measurement.output_names,
        output_units=measurement.output_units,
        measured=measurement.outputs,
        before=before,
        after=after,
        noise_rms=causes.noise.rms,
        noise_density=causes.noise.one_sided(measurement.sample_rate_hz),
        map_time_s=time_s,
        map_frequency_hz=frequency_hz,
        gap_map=density,
        gap_map_after=gap_map(measurement.outputs - after, measurement.outputs, measurement.sample_rate_hz)[2],
        # Each sensor predicted from the others knows of no windows.
        window_starts=() if causes.shaken is not None else tuple(start for start, _ in study.windows or ()),
    )


def joint_motions(study: Study, fit: OutputErrorFit, known: Recovered | None) -> dict[str, Variable]:
    """Give displacement, velocity and amplitude of every joint, by names such as ``elbow.velocity``.

    They're those of the run of the fit that is believed, but at the site whose motion was recovered: the sensors tell
    that without any law. A run that diverges tells nothing, and a joint whose motion can't be told is left out.
    """
    try:
        run = study.contest.run.motions(fit.z, fit.effects, fit.initial)
    except ModelError:
        run = {}
    moved = {name: (one.displacement, one.velocity) for (name, kind), one in run.items() if kind == "joint"}
    if known is not None and known.site.kind == "joint":
        moved[known.site.name] = known.displacement, known.velocity
    period = round(study.measurement.sample_rate_hz / lowest_hz(study.model, study.measurement))
    found: dict[str, Variable] = {}
    for port in study.contest.run.compiled().ports:
        if port.kind != "joint" or port.name not in moved:
            continue
        displacement, velocity = moved[port.name]
        unit = port.displacement_unit
        found[f"{port.name}.displacement"] = Variable(displacement, unit)
        found[f"{port.name}.velocity"] = Variable(velocity, f"{unit}/s")
        found[f"{port.name}.amplitude"] = Variable(amplitude(displacement, period), unit)
    return found

"""The whole diagnosis of a model and its logs."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.gap.comparison.distortion import Distortion, distortion_of
from chladni.gap.comparison.levels import compare_levels
from chladni.gap.comparison.outside_band import products_outside
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.scale_doubt import scale_doubt
from chladni.gap.comparison.shares import band_shares, channel_gaps, gap_map, regime_shares
from chladni.gap.design.next_measurement import next_measurement
from chladni.gap.design.what_is_missing import what_is_missing
from chladni.gap.diagnosis.causes import Causes, causes_of
from chladni.gap.diagnosis.closing import Yardstick, closing_of
from chladni.gap.diagnosis.naming import causes_named, naive_of, ranking_of, tuned_numbers
from chladni.gap.diagnosis.other_logs import closing_elsewhere
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.explanation.shaken_ground import predicted_by_others
from chladni.gap.linear_algebra import in_one_thread
from chladni.gap.location.profile import profile_at
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.places import Site
from chladni.gap.records.diagnosis import (
    Cause,
    Diagnosis,
    GapSignals,
    RegimeShare,
    RestoringForce,
    SiteShare,
    Where,
)
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.core.model import Model
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.errors import EstimateError, ModelError

Matrix = NDArray[np.float64]
StepProgress = Callable[[str, float], None]
#: Nats within which a further measurement is worth a thought.
_STILL_CLOSE = 8.0
#: Of the tuned model's error: parameters outside their tolerance that leave less are wrong, whatever else is.
_MOSTLY = 0.25


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
        One at least.
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
    causes = causes_of(study, lambda done: tell("explaining", 0.3 + 0.6 * done))
    tell("measuring the closing", 0.9)
    found = _assembled(study, causes, [one.log for one in measurements], seed)
    # Periods tell noise from distortion at every level, as they did for the first log.
    others = [closing_elsewhere(study, causes, one, seed=seed) for one in measurements[1:]]
    levels = compare_levels([with_period(one) for one in measurements]) if len(measurements) > 1 else ()
    tell("measuring the closing", 1.0)
    # What is said of a level there needn't be said of its log again.
    remarks = tuple(one for one in found.remarks if not any(one in told for told in levels))
    elsewhere = tuple(one for one in others if one is not None)
    return replace(found, elsewhere=elsewhere, levels=levels, remarks=remarks)


def _silent(_step: str, _share: float) -> None:
    pass


def _assembled(study: Study, causes: Causes, logs: Sequence[str], seed: int) -> Diagnosis:
    said = causes_named(study, causes)
    before = _nominal(study)
    shown = causes.best if causes.verdict in ("effect", "parameters") else causes.tuned
    after = shown.fit.outputs
    if causes.shaken is not None:
        after = predicted_by_others(study.location.problem, causes.shaken.profile)
    motion = _evidence(study, causes, said)
    distortion = _distortion(study.measurement)
    return Diagnosis(
        model=study.model.name,
        logs=tuple(logs),
        verdict=causes.verdict,
        causes=said,
        ranking=ranking_of(causes, said),
        where=_where(study, causes, before, motion),
        # What the parameters close isn't what nothing explains, and may lie elsewhere.
        left=_where(study, causes, causes.tuned.fit.outputs, motion) if causes.verdict == "unknown" else None,
        gap=closing_of(_yardstick(study, causes), before, causes.tuned.fit.outputs, after, seed=seed),
        tuned_parameters=tuned_numbers(study, shown.fit),
        next_measurement=_next(study, causes, seed),
        naive=naive_of(causes),
        remarks=(*_remarks(study, causes, shown), *_distortion_remarks(study.measurement, distortion)),
        advice=_advice(study, causes),
        restoring_force=_restoring(study, causes, motion),
        signals=_signals(study, causes, before, after),
        distortion=() if distortion is None else distortion.shares,
    )


def _yardstick(study: Study, causes: Causes) -> Yardstick:
    by: Literal["free_run", "windows", "cross_sensor"] = "free_run" if study.windows is None else "windows"
    if causes.shaken is not None:
        by = "cross_sensor"
    return Yardstick(
        measurement=study.measurement,
        held=study.held,
        noise=causes.noise,
        by=by,
        horizon_s=study.horizon_s,
    )


def _nominal(study: Study) -> Matrix:
    """Free run of the nominal model from the initial state that suits it best."""
    run, contest = study.contest.run, study.contest
    try:
        return fit_output_error(run, contest.noise, training=contest.training, tune=False).outputs
    except ModelError:
        return run.outputs()


def _where(study: Study, causes: Causes, simulated: Matrix, motion: Recovered | None) -> Where:
    measurement = study.measurement
    residual = measurement.outputs - simulated
    shares = sorted(study.location.shares.items(), key=lambda one: -one[1])
    return Where(
        channels=channel_gaps(residual, measurement.outputs, causes.noise, output_names=measurement.output_names),
        bands=band_shares(residual, measurement.outputs, sample_rate_hz=measurement.sample_rate_hz),
        sites=tuple(SiteShare(name=name, share=share) for name, share in shares),
        regimes=_regimes(study, residual, motion),
    )


def _regimes(study: Study, residual: Matrix, motion: Recovered | None) -> tuple[RegimeShare, ...]:
    """Regimes of a joint's motion; of what acts elsewhere there are none."""
    if motion is None or motion.site.kind != "joint":
        return ()
    unit = _port(study, motion.site)[1]
    name = motion.site.name
    variables = {f"{name}.displacement": motion.displacement, f"{name}.velocity": motion.velocity}
    units = {f"{name}.displacement": unit, f"{name}.velocity": f"{unit}/s"}
    found = regime_shares(residual, study.measurement.outputs, variables)
    return tuple(replace(one, unit=units[one.variable]) for one in found)


def _evidence(study: Study, causes: Causes, said: Sequence[Cause]) -> Recovered | None:
    """Force and motion at the named site, else at the best place, with the parameters that are believed."""
    problem = study.location.problem
    for located in study.location.ranked:
        for site in located.places[0].sites:
            if said and site.name != said[0].site:
                continue
            z = located.profile.z if causes.best is causes.tuned else causes.best.fit.z
            return recovered(problem, profile_at(problem, (site,), z), site)
    return None


def _restoring(study: Study, causes: Causes, motion: Recovered | None) -> RestoringForce | None:
    if motion is None:
        return None
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


def _law_force(study: Study, causes: Causes, motion: Recovered) -> Matrix | None:
    fit = causes.best.fit
    try:
        return study.contest.run.motion(fit.z, fit.effects, fit.initial, site=motion.site.name).force
    except ModelError:
        return None


def _port(study: Study, site: Site) -> tuple[str, str]:
    compiled = study.contest.run.compiled()
    for port in compiled.ports:
        if (port.name, port.kind) == (site.name, site.kind):
            return port.unit, port.displacement_unit
    for terminal in (*compiled.inputs, *compiled.outputs):
        if terminal.name == site.name:
            return terminal.unit, terminal.unit
    return "1", "1"


def _signals(study: Study, causes: Causes, before: Matrix, after: Matrix) -> GapSignals:
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
        map_time_s=time_s,
        map_frequency_hz=frequency_hz,
        gap_map=density,
        gap_map_after=gap_map(measurement.outputs - after, measurement.outputs, measurement.sample_rate_hz)[2],
        # Each sensor predicted from the others knows of no windows.
        window_starts=() if causes.shaken is not None else tuple(start for start, _ in study.windows or ()),
    )


def _distortion(measurement: Measurement) -> Distortion | None:
    try:
        return distortion_of(measurement)
    except EstimateError:
        return None


def _distortion_remarks(measurement: Measurement, distortion: Distortion | None) -> tuple[str, ...]:
    """What the excitation doesn't allow to be told of distortion, and what the lines above its band tell."""
    if distortion is None:
        return ()
    outside = products_outside(measurement)
    return (*distortion.remarks, *(() if outside is None else (outside.sentence(),)))


def _remarks(study: Study, causes: Causes, shown: Contestant) -> list[str]:
    found = []
    if len(study.measurement.output_names) < 2:
        found.append(
            "one output only: which site the missing force acts at can't be told from patterns, only from its law; "
            "a second sensor would tell"
        )
    if study.repeating:
        found.append(
            f"{', '.join(study.repeating)}: samples repeat the one before; the sensor is slower than the log, or "
            "messages were lost"
        )
    if causes.distorted:
        found.append(f"{', '.join(causes.distorted)}: what is left follows its own signal in a curve or in steps")
    if shown.fit.undetermined:
        names = ", ".join(shown.fit.undetermined[:6])
        found.append(f"this log doesn't determine {names}: only the stated tolerance holds what it can't tell")
    if np.any(causes.noise.upper_bound):
        found.append("the noise floor of some outputs is an upper bound: distortion may be in it")
    return found


def _next(study: Study, causes: Causes, seed: int) -> str | None:
    """What to measure so that the answer gets clearer, None when it's clear or nothing would help."""
    run = study.contest.run
    if causes.shaken is not None:
        return None
    close = [one for one in (*causes.ranked, causes.tuned) if len(one.hypothesis.named) <= 1]
    close = sorted(close, key=lambda one: -one.log_evidence)
    near = [one for one in close if one.log_evidence > close[0].log_evidence - _STILL_CLOSE]
    if causes.verdict != "unknown" and len(near) > 1 and close[0] is not causes.tuned:
        return next_measurement(study.model, study.measurement, run.tunables, near[:4], causes.noise, seed=seed)
    if causes.verdict == "unknown":
        sites = [located.places[0].sites[0].name for located in study.location.ranked[:3]]
        return what_is_missing(study.model, study.measurement, causes.noise, sites=sites)
    return None


def _advice(study: Study, causes: Causes) -> str | None:
    """What to do next; a scale that can't be right comes before all else."""
    measurement = study.measurement
    try:
        # From rest: the initial states that suit a log of another scale would hide it.
        doubt = scale_doubt(measurement.outputs, study.contest.run.outputs(), measurement.output_names)
    except ModelError:
        doubt = None
    return " ".join(filter(None, (doubt, _advice_on(study, causes)))) or None


def _advice_on(study: Study, causes: Causes) -> str | None:
    if causes.instead is not None:
        return causes.instead.sentence()
    if causes.verdict == "unknown" and causes.best.hypothesis.wide and causes.best.gap < _MOSTLY * causes.tuned.gap:
        return _wrong_first(study, causes)
    if causes.verdict == "unknown":
        return "No effect of the catalogue explains the gap; the site and the recovered force say where to look."
    if causes.verdict == "none" and causes.tuned.chi > 1.2:
        return "What is left beside the noise is too little to be named."
    return None


def _wrong_first(study: Study, causes: Causes) -> str:
    """Say which parameters to put right, where something is missing beside them."""
    tunables, values = study.contest.run.tunables, causes.best.fit.values
    rows = zip(tunables.names, tunables.nominal, tunables.units, strict=True)
    wrong = " and ".join(
        f"{name} of {_short(values[name])} {unit} where the model has {_short(nominal)}"
        for name, nominal, unit in rows
        if name in causes.best.hypothesis.wide
    )
    return (
        f"With {wrong} an error of {_short(100 * causes.best.gap)} % is left, {_short(100 * causes.tuned.gap)} % "
        "without: put that right in the model and ask again; what is left has another cause."
    )


def _short(value: float) -> str:
    """Three digits, without an exponent where there need be none."""
    return f"{float(f'{value:.3g}'):g}"

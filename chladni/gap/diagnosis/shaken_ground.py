"""A floor that shakes: when only it explains a gap, what each sensor tells of it, and how strong it is."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import ALIKE, CLEARLY, LEFT_BY_LAW, MOST, RIDGE, SOME, TIED
from chladni.gap.diagnosis.plausible import near_places
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.explanation.contest import held_gap
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.location.locate import Located
from chladni.gap.location.profile import Profile, profile_at
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.plant.record_lines import all_lines
from chladni.gap.records.diagnosis import FittedNumber
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real

#: Share of the gap that any law of a site's motion, or a filter of the inputs, must leave there.
_LEFT = {"joint": LEFT_BY_LAW, "input": SOME, "ground": MOST}


@dataclass(frozen=True, slots=True, kw_only=True)
class ShakenGround:
    """The word, the names of sites that can't be told from the ground, itself first, and what its motion tells.

    `predicted` is ``[output, sample]``: each sensor by what the others tell of the floor. `parameters` are what all
    of them tell of its level and band.
    """

    effect: str
    group: tuple[str, ...]
    predicted: Real
    parameters: Mapping[str, FittedNumber]


def shaken_by(study: Study, tuned: Contestant) -> ShakenGround | None:
    """Give the ground when no law is left but a motion of its own; None when something else may act.

    With a machine that stands on one joint, a force there is nearly the ground's motion. What tells them apart is
    that a law of the joint follows its motion, and an actuator's the inputs; the floor follows neither. A motion of
    its own for every sample explains much: of a floor the other sensors must tell more than the model alone does.
    """
    kind = next((one for one in study.kinds if one.clues.of_force is not None and "ground" in one.sites), None)
    if kind is None or len(study.measurement.output_names) < 2:
        return None
    first = study.location.ranked[0].profile.chi
    tied = [one for one in study.location.ranked if one.profile.chi < ALIKE * first]
    if len(tied) > 2:
        return None
    ground = next((one for one in tied if _grounds(one)), None)
    if ground is None or ground.profile.chi > min(CLEARLY, TIED * first):
        return None
    predicted = predicted_by_others(study.location.problem, ground.profile)
    measured = study.measurement.outputs
    by_others, alone = (held_gap(measured, one, study.held) for one in (predicted, tuned.fit.outputs))
    if not by_others < alone:
        return None
    if any(_follows(study, one) for one in near_places(study.location, ALIKE)):
        return None
    site = _grounds(ground)[0]
    parameters = floor_motion(study.location.problem, site, ground.profile.z, kind)
    if not parameters:
        return None
    names = [site.name, *(name for one in (ground, *tied) for name in one.places[0].names)]
    return ShakenGround(
        effect=kind.name,
        group=tuple(dict.fromkeys(names)),
        predicted=predicted,
        parameters=parameters,
    )


def _grounds(located: Located) -> list[Site]:
    return [site for site in located.places[0].sites if site.kind == "ground"]


def _follows(study: Study, located: Located) -> bool:
    """Whether any law of the motion at one of a place's sites, or of the inputs, would explain most."""
    sites = [site for site in located.places[0].sites if site.kind in _LEFT]
    return any(left_by_any_law(study.location, located, site) < _LEFT[site.kind] for site in sites)


def floor_motion(problem: LinearProblem, ground: Site, z: Real, kind: EffectKind) -> Mapping[str, FittedNumber]:
    """Give the numbers of an effect at the ground that the sensors tell, without a standard deviation.

    The problem is of the whole record, z in units of the parameters' tolerances. An effect's force must follow
    nothing, see `Clues`; of another one nothing is told.
    """
    if kind.clues.of_force is None:
        return {}
    found = recovered(problem, profile_at(problem, (ground,), z), ground)
    values = kind.clues.of_force(found.force, problem.measurement.sample_rate_hz)
    unit = next(port.unit for port in problem.view(z).compiled.ports if port.kind == "ground")
    # What it vanishes with is in the ground's unit, which may turn.
    units = {name: unit if name in kind.neutral else kind.parameters[name].unit for name in values}
    return {name: FittedNumber(value=value, std=None, unit=units[name]) for name, value in values.items()}


def predicted_by_others(problem: LinearProblem, found: Profile) -> Real:
    """Give ``[output, sample]``: what each sensor should have read if the force that all others tell acts.

    The force is Wiener's estimate (Kay 1993, *Estimation theory*, section 12.7): the less it stands out of the noise
    of the sensors that tell it, the less of that is believed. How strong it is around a line all sensors tell: where
    the others hardly feel it, they couldn't tell that either. The problem is of the whole record and of two sensors
    at least, the profile that of a force at one site.
    """
    measurement = problem.measurement
    lines = all_lines(measurement.samples, measurement.sample_rate_hz)
    whole = problem.on(lines)
    view = whole.view(found.z)
    pattern = whole.pattern(view, found.sites[0])[:, 0]
    force = recovered(problem, found, found.sites[0])
    linear = view.response(force.transient, ())
    residual = ((whole.measured - linear) * whole.weight)[:, 0]
    told, strength = pattern.conj() * residual, np.abs(pattern) ** 2
    # All is told of none without noise.
    believed = np.minimum(force.reliable, 1.0 - RIDGE)
    total = strength.sum(axis=0)
    over_noise = np.where(total > 0, believed / (1.0 - believed) / np.where(total > 0, total, 1.0), 0.0)
    others = (told.sum(axis=0) - told) * over_noise / (1.0 + (total - strength) * over_noise)
    predicted = linear[:, 0] + pattern / whole.weight[:, 0] * others
    mean = measurement.outputs.mean(axis=1, keepdims=True)
    return np.asarray(lines.signal(predicted[:, None])[:, 0] + mean, dtype=np.float64)

"""What inputs did between their samples, told from the log, whatever else is missing."""

from collections.abc import Mapping, Sequence

import numpy as np

from chladni.gap.calibration import BEYOND_DOUBT, PLACES, WORTH
from chladni.gap.explanation.evidence import Left, highest_level, left_by_force
from chladni.gap.location.locate import Location
from chladni.gap.location.profile import profile_at, profiled
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.records.measurement import Measurement
from chladni.models.core.model import Model
from chladni.models.core.port import HOLDS, HoldKind
from chladni.signals.arrays import Real


def with_told_holds(model: Model, location: Location) -> Model:
    """Give the model with the holds of its inputs that a log tells.

    What is missing somewhere hides what an input did between its samples, and a wrong hold hides where it is missing.
    So each hold is weighed beside an unknown force at each of the places that lead with it, and without any,
    parameters tuned anew: the evidence of the best of these.
    That tells what the force was behind what is missing, as a lag makes any hold smooth: a hypothesis, which causes
    are to compete with.
    Inputs whose hold the model states, which never move, or whose rate acts too, are left as they are; so are all
    when the model leaves noise alone, and where no hold is worth its price and brings all down to the noise.

    Parameters
    ----------
    model
        Of the location's problem.
    location
        Of the log, with the holds that the model has.
    """
    asked = other_holds(model, location.problem.measurement)
    if not asked:
        return model
    tuned = location.tuned
    if tuned.misfit <= np.mean(highest_level(location.problem.noise)) * tuned.expected:
        return model
    told, nats = model, _weighed(model, location)[0]
    for others in asked:
        for tried in changed(told, others):
            found, elsewhere = _weighed(tried, location)
            # Where a hold doesn't bring all down to the noise, what else is missing may pass for it.
            if found - price(model, tried) > nats - price(model, told) and elsewhere < WORTH:
                told, nats = tried, found
    return told


def changed(model: Model, answers: Sequence[Mapping[str, HoldKind]]) -> list[Model]:
    """Give the model with each of the answers that aren't its own holds anyway."""
    tried = [model.with_holds(one) for one in answers]
    return [one for one in tried if one.compile().holds != model.compile().holds]


def price(stated: Model, told: Model) -> float:
    """Nats of holds that a model doesn't state: of each kind of device beside those that it says, or means."""
    return BEYOND_DOUBT * len(set(told.compile().holds) - set(stated.compile().holds))


def other_holds(stated: Model, measurement: Measurement) -> list[list[dict[str, HoldKind]]]:
    """Give the questions that a log may answer, each with its answers: the hold of all inputs, then of each."""
    rows = zip(stated.compile().inputs, measurement.inputs, strict=True)
    asked = [
        one.name for one, signal in rows if one.hold is None and not one.derivatives and np.any(signal != signal[0])
    ]
    # One device has often written all of them.
    together = [asked] if len(asked) > 1 else []
    return [[dict.fromkeys(names, hold) for hold in HOLDS] for names in (*together, *([one] for one in asked))]


def _weighed(model: Model, location: Location) -> tuple[float, float]:
    """Evidence with an unknown force where that tells most, or without; nats of what is left beyond doubt."""
    old = location.problem
    level = highest_level(old.noise)
    problem = LinearProblem(model, old.measurement, old.noise, old.tunables, old.lines)
    tuned = profiled(problem, (), location.tuned.z, share=0.0)
    plain = Left(along=0.0, along_expected=0.0, across=tuned.misfit, across_expected=tuned.expected, force=0.0)
    found = [(plain.at(level).log_likelihood - tuned.prior / 2, plain.at(level).elsewhere)]
    for site, z in _leading(problem, location, tuned.z) if len(problem.measured) > 1 else ():
        beside = profiled(problem, (site,), z, share=0.0)
        left = left_by_force(problem, tuned, beside)
        found.append((left.at(level).log_likelihood - beside.prior / 2, left.at(level).elsewhere))
    return max(found)


def _leading(problem: LinearProblem, location: Location, tuned_z: Real) -> list[tuple[Site, Real]]:
    """The places that explain most with a problem's own holds, each with the parameters to begin a profile at."""
    starts = [(place.sites[0], tuned_z) for place in location.places]
    starts += [(one.places[0].sites[0], one.profile.z) for one in location.ranked]
    leading: dict[Site, Real] = {}
    for site, z in sorted(starts, key=lambda start: profile_at(problem, start[:1], start[1]).cost):
        leading.setdefault(site, z)
    return list(leading.items())[:PLACES]

"""A floor's motion as numbers: how strong it is, and in which band."""

from collections.abc import Mapping

from chladni.gap.location.profile import profile_at
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.records.diagnosis import FittedNumber
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real


def floor_motion(problem: LinearProblem, ground: Site, z: Real, kind: EffectKind) -> Mapping[str, FittedNumber]:
    """Give the numbers of an effect at the ground that the sensors tell, without a standard deviation.

    Parameters
    ----------
    problem
        Of the whole record.
    ground
        The site whose acceleration it is.
    z
        Parameters of the model, in units of their tolerance.
    kind
        An effect whose force follows nothing, see `Clues`; of another one nothing is told.
    """
    if kind.clues.of_force is None:
        return {}
    found = recovered(problem, profile_at(problem, (ground,), z), ground)
    values = kind.clues.of_force(found.force, problem.measurement.sample_rate_hz)
    unit = next(port.unit for port in problem.view(z).compiled.ports if port.kind == "ground")
    # What it vanishes with is in the ground's unit, which may turn.
    units = {name: unit if name in kind.neutral else kind.parameters[name].unit for name in values}
    return {name: FittedNumber(value=value, std=None, unit=units[name]) for name, value in values.items()}

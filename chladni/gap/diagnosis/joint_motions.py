"""How each joint of a model moves while a log's inputs drive it: what the regimes of a gap are cut by."""

from chladni.gap.comparison.log_regimes import amplitude
from chladni.gap.comparison.shares import Variable
from chladni.gap.diagnosis.study import Study
from chladni.gap.location.locate import lowest_hz
from chladni.gap.location.recovered import Recovered
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def joint_motions(study: Study, fit: OutputErrorFit, known: Recovered | None) -> dict[str, Variable]:
    """Give displacement, velocity and amplitude of every joint, by names such as ``elbow.velocity``.

    They're those of a fitted model's run, but at the site whose motion was recovered: the sensors tell that without
    any law. A run that diverges tells nothing, and a joint whose motion can't be told is left out.

    Parameters
    ----------
    fit
        Of the model whose run is believed.
    """
    moved = _of_run(study, fit)
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


def _of_run(study: Study, fit: OutputErrorFit) -> dict[str, tuple[Real, Real]]:
    """Displacement and velocity of each joint during a fitted model's run, by name."""
    try:
        found = study.contest.run.motions(fit.z, fit.effects, fit.initial)
    except ModelError:
        return {}
    return {name: (one.displacement, one.velocity) for (name, kind), one in found.items() if kind == "joint"}

"""How each joint of a model moves while a log's inputs drive it: what the regimes of a gap are cut by."""

from collections.abc import Mapping
from dataclasses import dataclass

from chladni.gap.comparison.log_regimes import amplitude
from chladni.gap.diagnosis.study import Study
from chladni.gap.location.locate import lowest_hz
from chladni.gap.location.recovered import Recovered
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMotions:
    """Motion of joints over a whole log.

    Attributes
    ----------
    signals
        Name, such as ``elbow.velocity``, to ``[sample]``, SI.
    units
        By the same names.
    """

    signals: Mapping[str, Real]
    units: Mapping[str, str]


def joint_motions(study: Study, fit: OutputErrorFit, known: Recovered | None) -> JointMotions:
    """Give displacement, velocity and amplitude of every joint; nothing of those whose motion can't be told.

    They're those of a fitted model's run, but at the site whose motion was recovered: the sensors tell that without
    any law. A run that diverges tells nothing.

    Parameters
    ----------
    fit
        Of the model whose run is believed.
    known
        Motion that was recovered, None without.
    """
    moved = _of_run(study, fit)
    if known is not None and known.site.kind == "joint":
        moved[known.site.name] = known.displacement, known.velocity
    period = round(study.measurement.sample_rate_hz / lowest_hz(study.model, study.measurement))
    signals: dict[str, Real] = {}
    units: dict[str, str] = {}
    for port in study.contest.run.compiled().ports:
        if port.kind != "joint" or port.name not in moved:
            continue
        displacement, velocity = moved[port.name]
        unit = port.displacement_unit
        for word, signal, its_unit in (
            ("displacement", displacement, unit),
            ("velocity", velocity, f"{unit}/s"),
            ("amplitude", amplitude(displacement, period), unit),
        ):
            signals[f"{port.name}.{word}"] = signal
            units[f"{port.name}.{word}"] = its_unit
    return JointMotions(signals=signals, units=units)


def _of_run(study: Study, fit: OutputErrorFit) -> dict[str, tuple[Real, Real]]:
    """Displacement and velocity of each joint during a fitted model's run, by name."""
    try:
        found = study.contest.run.motions(fit.z, fit.effects, fit.initial)
    except ModelError:
        return {}
    return {name: (one.displacement, one.velocity) for (name, kind), one in found.items() if kind == "joint"}

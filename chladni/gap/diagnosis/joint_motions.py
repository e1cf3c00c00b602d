"""How each joint of a model moves while a log's inputs drive it: what the regimes of a gap are cut by."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.study import Study
from chladni.gap.location.locate import lowest_hz
from chladni.gap.location.recovered import Recovered
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.signals.errors import ModelError

Matrix = NDArray[np.float64]


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

    signals: Mapping[str, Matrix]
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
    signals: dict[str, Matrix] = {}
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


def amplitude(displacement: Matrix, period: int) -> Matrix:
    """``[sample]`` amplitude of an oscillation ``[sample]``: of a sine that is as large over `period` samples.

    The mean over the same samples is left out, since a load or a travel is no oscillation. At the ends of the record
    the first and the last whole period stand in.
    """
    length = min(max(period, 2), displacement.size)
    # Squares of a small oscillation about a large mean would lose it to rounding.
    centred = displacement - displacement.mean()
    mean, square = (_running_mean(one, length) for one in (centred, centred**2))
    found = np.sqrt(2 * np.maximum(square - mean**2, 0.0))
    before = length // 2
    return np.pad(found, (before, displacement.size - found.size - before), mode="edge")


def _running_mean(signal: Matrix, length: int) -> Matrix:
    """``[sample]`` means over each whole stretch of a length."""
    sums = np.concatenate([[0.0], np.cumsum(signal)])
    return np.asarray((sums[length:] - sums[:-length]) / length, dtype=np.float64)


def _of_run(study: Study, fit: OutputErrorFit) -> dict[str, tuple[Matrix, Matrix]]:
    """Displacement and velocity of each joint during a fitted model's run, by name."""
    try:
        found = study.contest.run.motions(fit.z, fit.effects, fit.initial)
    except ModelError:
        return {}
    return {name: (one.displacement, one.velocity) for (name, kind), one in found.items() if kind == "joint"}

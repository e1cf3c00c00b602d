"""What to do after a diagnosis: what to check, to put right, to measure."""

from collections.abc import Iterator, Sequence

import numpy as np

from chladni.gap.calibration import ALONE, CLOSE, FORMS, PLACES, ROUNDING, SOME
from chladni.gap.comparison.doubts import scale_doubt
from chladni.gap.design.next_measurement import next_measurement
from chladni.gap.design.what_is_missing import level_missing, sensor_missing, what_is_missing
from chladni.gap.diagnosis.study import Study
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: What "nothing is missing" leaves open in loud noise.
_HIDDEN = "What moves the outputs by less than this noise may act unseen: this log can't rule it out."


def advice_on(study: Study, causes: Causes) -> str | None:
    """What to do next; a scale that can't be right comes before all else."""
    scale = _doubted_scale(study)
    doubts = _doubted_values(study, causes) if scale is None else [scale]
    return " ".join(filter(None, (*doubts, _on_causes(study, causes)))) or None


def _doubted_scale(study: Study) -> str | None:
    """Doubt of what the inputs do in the model: the starts that suit a log of another scale would hide it."""
    run, measurement = study.contest.run, study.measurement
    try:
        if study.windows is None:
            measured, simulated = measurement.outputs, run.outputs()
        else:
            measured, simulated = driven_parts(run)
    except ModelError:
        return None
    return scale_doubt(measured, simulated, measurement.output_names)


def _doubted_values(study: Study, causes: Causes) -> Iterator[str | None]:
    """Doubts of what was fitted: effects that are too large for their name."""
    if causes.verdict != "effect":
        return
    for effect in causes.best.fit.effects:
        if effect.kind.clues.doubts is not None:
            yield from effect.kind.clues.doubts(effect.site, effect.values, study.model.parameters)


def measure_next(study: Study, causes: Causes, seed: int) -> str | None:
    """What to measure so that the answer gets clearer, None when it's clear or nothing would help."""
    if causes.shaken is not None or study.contest.run.is_black_box:
        # What other sensors and excitations would tell takes equations.
        return None
    if causes.verdict == "unknown":
        return what_is_missing(study.model, study.measurement, causes.noise, sites=_likely_sites(study, ()))
    near = _still_close(causes)
    said = None
    if len(near) > 1 and near[0] is not causes.tuned:
        tunables = study.contest.run.tunables
        said = next_measurement(study.model, study.measurement, tunables, near[:FORMS], causes.noise, seed=seed)
    return said or _beyond_these_sensors(study, causes)


def _still_close(causes: Causes) -> list[Contestant]:
    """The best answer and those with as many causes that come near it; of several also the best with one fewer."""
    count = len(causes.best.hypothesis.named)
    if count <= 1:
        alike = [one for one in (*causes.ranked, causes.tuned) if len(one.hypothesis.named) <= 1]
        alike.sort(key=lambda one: -causes.belief.nats(one))
        first = alike[0]
    else:
        # An experiment between others than the answer would tell nothing of it.
        first = causes.best
        others = [one for one in causes.ranked if len(one.hypothesis.named) == count and one is not first]
        fewer = [one for one in causes.ranked if len(one.hypothesis.named) == count - 1][:1]
        alike = [first, *sorted((*others, *fewer), key=lambda one: -causes.belief.nats(one))]
    enough = causes.belief.nats(first) - CLOSE
    return [one for one in alike if one is first or causes.belief.nats(one) > enough]


def _likely_sites(study: Study, named: Sequence[str]) -> list[str]:
    """Sites that were named, then those at which an unknown force explains most."""
    first = [located.places[0].sites for located in study.location.ranked[:PLACES]]
    if len(study.measurement.output_names) == 1:
        # To an only sensor all are one place: it's among them that the force may act.
        sites = [site.name for each in first for site in each if site.kind in ("joint", "body")]
    else:
        sites = [each[0].name for each in first]
    return list(dict.fromkeys((*named, *sites)))


def _beyond_these_sensors(study: Study, causes: Causes) -> str | None:
    """What limits an answer that nothing else is asked for: noise, or an only sensor."""
    level = level_missing(study.measurement, causes.noise)
    if causes.verdict == "none":
        return None if level is None else f"{level} {_HIDDEN}"
    sensor = None
    if len(study.measurement.output_names) == 1:
        # A parameter such as elbow.stiffness acts where its joint does.
        named = [one.site.split(".")[0] for one in causes.best.hypothesis.named]
        sites = _likely_sites(study, named)
        sensor = sensor_missing(study.model, study.measurement, causes.noise, sites=sites)
    return " ".join(filter(None, (level, sensor))) or None


def _on_causes(study: Study, causes: Causes) -> str | None:
    if causes.within_step:
        return "The simulator's own step moves its outputs more than any effect does; shorten the step."
    if causes.verdict == "unknown" and causes.best.hypothesis.freed and causes.best.gap < SOME * causes.tuned.gap:
        return _wrong_first(study, causes)
    if causes.verdict == "unknown":
        return "No effect of the catalogue explains the gap; the site and the recovered force say where to look."
    if causes.verdict == "none" and causes.tuned.chi > ALONE:
        return "What is left beside the noise is too little to be named."
    return None


def _wrong_first(study: Study, causes: Causes) -> str:
    """Say which parameters to put right, where something is missing beside them."""
    tunables, values = study.contest.run.tunables, causes.best.fit.values
    rows = zip(tunables.names, tunables.nominal, tunables.units, strict=True)
    wrong = " and ".join(
        f"{name} of {_short(values[name])} {unit} where the model has {_short(nominal)}"
        for name, nominal, unit in rows
        if name in causes.best.hypothesis.freed
    )
    return (
        f"With {wrong} an error of {_short(100 * causes.best.gap)} % is left, {_short(100 * causes.tuned.gap)} % "
        "without: put that right in the model and ask again; what is left has another cause."
    )


def _short(value: float) -> str:
    """Three digits, without an exponent where there need be none."""
    return f"{float(f'{value:.3g}'):g}"


def driven_parts(run: FreeRun) -> tuple[Real, Real]:
    """Give ``[output, sample]`` of the log, and of the linear model from rest, without what a start can give.

    A free axis is where it began to be: most of its position is its start. What is left of both signals, once every
    pattern that an initial state of the window prints is taken off (least squares, output by output), only the inputs
    can have driven; its scale is the model's. A model that diverges is a `ModelError`.
    """
    # Laws would make the patterns depend on one another; friction from rest isn't friction of a machine in motion.
    linear = FreeRun(run.model.with_effects(()), run.measurement, windows=run.windows)
    driven = linear.outputs()
    patterns = [linear.outputs(initial=start) - driven for start in np.eye(len(linear.compiled().states))]
    # A sensor's offset is no motion.
    patterns.append(np.ones_like(driven))
    return _without(run.measurement.outputs, patterns, run.windows), _without(driven, patterns, run.windows)


def _without(signals: Real, patterns: list[Real], windows: tuple[tuple[int, int], ...]) -> Real:
    left = signals.copy()
    for start, stop in windows:
        for row, signal in enumerate(left[:, start:stop]):
            basis = _basis(np.array([pattern[row, start:stop] for pattern in patterns]))
            left[row, start:stop] = signal - (signal @ basis) @ basis.T
    return left


def _basis(patterns: Real) -> Real:
    """Orthonormal ``[sample, direction]`` of ``[pattern, sample]``, whatever their sizes."""
    size = np.linalg.norm(patterns, axis=1, keepdims=True)
    shapes = np.divide(patterns, size, out=np.zeros_like(patterns), where=size > 0)
    directions, share, _ = np.linalg.svd(shapes.T, full_matrices=False)
    return np.asarray(directions[:, share > ROUNDING * share[0]])

"""Output-error fit: parameters and effects with which a free run of the model comes nearest to the log."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypedDict

import numpy as np
from scipy import fft

from chladni.gap.calibration import DAMPINGS, GAINED, ITERATIONS, LITTLE, LONGEST, PRECISION, RIDGE, ZERO
from chladni.gap.comparison.whitening import with_law_error
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.bounded_step import bounded_step
from chladni.gap.tuning.effect_scale import effect_numbers
from chladni.gap.tuning.fit_problem import Evaluation, FitProblem, Point, Slopes
from chladni.gap.tuning.residual import Whitening, weights
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError, ModelError
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OutputErrorFit(Value):
    """What an output-error fit found.

    Attributes
    ----------
    values
        Every tunable parameter by name, SI.
    z
        ``[parameter]`` the same in sigmas of their tolerances.
    parameter_std
        ``[parameter]`` standard deviations, SI.
    effects
        With fitted values.
    effect_std
        For each effect the standard deviation of each fitted parameter, SI; infinite when nothing determines it.
    initial
        ``[window, state]`` estimated initial states.
    offsets
        ``[output]`` constants of the measured outputs that no model explains.
    outputs
        ``[output, sample]`` of the free run, offsets added.
    misfit
        Mean square of the whitened residual over the training samples; 1 when only noise is left.
    held_by_output
        ``[output]`` the same over the samples that the fit didn't see, empty when it saw all.
    prior_cost
        ``z.z``, of freed parameters over their own spread: what leaving the nominal values costs.
    undetermined
        Names of the parameters that this log leaves as uncertain as they were: nothing but their tolerance keeps them
        near nominal, and they move with others that they depend on.
    covariance
        Of z and of the unknowns of the effects, in that order.
    """

    values: Mapping[str, float]
    z: Real
    parameter_std: Real
    effects: tuple[AttachedEffect, ...]
    effect_std: tuple[Mapping[str, float], ...]
    initial: Real
    offsets: Real
    outputs: Real
    misfit: float
    held_by_output: Real
    prior_cost: float
    undetermined: tuple[str, ...]
    covariance: Real

    def __post_init__(self) -> None:
        self._freeze()


def fit_output_error(
    run: FreeRun,
    noise: NoiseFloor,
    *,
    effects: Sequence[AttachedEffect] = (),
    fitted: Sequence[Sequence[str]] | None = None,
    training: Mask | None = None,
    start_z: Real | None = None,
    start_initial: Real | None = None,
    freed: Sequence[str] = (),
    held: bool = True,
    tune: bool = True,
    offsets: bool = True,
    max_iterations: int = ITERATIONS,
    precision: float = PRECISION,
) -> OutputErrorFit:
    """Fit parameters, effects and initial states to a log.

    Least squares on whitened residuals with the prior ``z.z`` (Ljung, *System Identification*, 2nd ed., section 7.4),
    by Gauss and Newton inside hard bounds, damped where a step makes things worse. Where a residual is larger than
    the noise, its own size takes the noise's place, see `likelihood_cost`.

    Parameters
    ----------
    run
        The model driven by the log.
    noise
        Of the measured outputs.
    effects
        With the values that the fit starts from.
    fitted
        Names of the parameters that move, for each effect; by default those that it can't do without.
    training
        ``[sample]``: what the fit may see; all by default.
    start_z
        ``[parameter]`` where the parameters start; nominal by default. Without `tune` they stay there.
    start_initial
        ``[window, state]`` where initial states start; at rest by default.
    freed
        Names of parameters that may be wrong by a slip.
    held
        Whether the others are kept within three sigmas of their tolerances.
    tune
        Whether the parameters move.
    offsets
        Whether each output may have an unknown constant.
    max_iterations
        Of the fit.
    precision
        Nats; a step that promises less ends the fit.

    Raises
    ------
    ModelError
        When the model diverges at the start already.
    EstimateError
        When nothing is left to fit on, or motions at the start part so fast that they have no slopes.
    """
    count, samples = len(run.tunables.names), run.measurement.samples
    training = np.ones(samples, dtype=bool) if training is None else np.asarray(training, dtype=bool)
    require_shape("training", training, (samples,), "the log")
    z = np.zeros(count) if start_z is None else np.asarray(start_z, dtype=np.float64)
    require_shape("start_z", z, (count,), "the tunable parameters")
    known = _known(run, noise, z, effects)
    seen = training & known
    numbers = effect_numbers(effects, fitted)
    problem = FitProblem(
        run, _whitening(run, noise, seen, offsets),
        effects=effects, numbers=numbers, tune=tune, freed=freed, held=held, start_z=z,
    )  # fmt: skip
    start = problem.start_of_windows() if problem.has_laws and len(run.windows) > 1 else problem.start()
    if start_initial is not None:
        start = Point(start.x, np.array(start_initial, dtype=np.float64).reshape(start.initial.shape))
    here, slopes = _fit(problem, start, max_iterations, precision)
    return _report(problem, here, slopes, held=known & ~training)


def with_coloured_spread(
    run: FreeRun,
    noise: NoiseFloor,
    fit: OutputErrorFit,
    *,
    fitted: Sequence[Sequence[str]] | None = None,
    training: Mask | None = None,
    freed: Sequence[str] = (),
    tune: bool = True,
    offsets: bool = True,
) -> OutputErrorFit:
    """Give a fit with spreads that allow for a residual that is correlated from sample to sample.

    A fit states those of white noise, which cost it nothing. What a law leaves of another one is no such thing, and
    tells numbers less well than as much noise would, see `coloured_information`.

    Parameters
    ----------
    fit
        What `fit_output_error` gave for the other arguments.
    fitted, training, freed, tune, offsets
        As it was given them.

    Raises
    ------
    EstimateError
        When motions there part so fast that they have no slopes.
    """
    known = _known(run, noise, fit.z, fit.effects)
    seen = known if training is None else training & known
    numbers = effect_numbers(fit.effects, fitted)
    problem = FitProblem(
        run, _whitening(run, noise, seen, offsets),
        effects=fit.effects, numbers=numbers, tune=tune, freed=freed, held=False, start_z=fit.z,
    )  # fmt: skip
    problem.coarse = False
    x = np.concatenate([fit.z[: problem.tuned], np.zeros(len(problem.numbers))])
    here = problem.evaluate(Point(x, fit.initial))
    slopes = problem.slopes(here)
    white = _inverse(slopes.curvature)
    covariance = white @ coloured_information(problem, here, slopes) @ white
    return replace(fit, covariance=covariance, **_spreads(problem, x, covariance))


def _known(run: FreeRun, noise: NoiseFloor, z: Real, effects: Sequence[AttachedEffect]) -> Mask:
    """``[sample]``: where no input comes from before the record, nor is anything whitened beside such a sample."""
    unknown = run.unknown_at_start(z, effects)
    first = unknown + noise.whitening.shape[1] - 1 if unknown else 0
    return np.arange(run.measurement.samples) >= first


def _whitening(run: FreeRun, noise: NoiseFloor, training: Mask, offsets: bool) -> Whitening:
    seen = with_law_error(noise, np.std(run.measurement.outputs, axis=1))
    return Whitening(seen, training, offsets=offsets)


def _fit(problem: FitProblem, start: Point, most: int, precision: float) -> tuple[Evaluation, Slopes]:
    """Coarsely first where that is quicker, then as finely as runs are made."""
    spent = 0
    if problem.coarse:
        # What a coarse run is wrong by is no reason to follow it further than this.
        enough = GAINED * problem.whitening.samples * problem.run.rows.size
        try:
            found, _, spent = _descend(problem, problem.evaluate(start), most, enough)
            start = found.point
        except (ModelError, EstimateError):
            spent = 0
        problem.coarse = False
    left = max(most - spent, min(most, ITERATIONS // 3))
    return _descend(problem, problem.evaluate(start), left, precision)[:2]


def _descend(problem: FitProblem, here: Evaluation, most: int, enough: float) -> tuple[Evaluation, Slopes, int]:
    """Step until no step promises enough, at most so many times; also give how many iterations that took."""
    level, iterations = 0, 0
    slopes = problem.slopes(here)
    while iterations < most:
        # Slopes are what costs: steps along secants are counted with the differences that they start from.
        iterations += not problem.stale
        found, promised, level = _search(problem, here, slopes, level)
        if found is None and not problem.stale:
            return here, slopes, iterations
        gained, here = (0.0, here) if found is None else (here.cost - found.cost, found)
        done = found is None or max(promised, gained) < enough
        if done and not problem.stale:
            return here, slopes, iterations
        try:
            slopes = problem.slopes(here, fresh=done)
        except EstimateError:
            return here, slopes, iterations
    return here, slopes, iterations


def _search(
    problem: FitProblem, here: Evaluation, slopes: Slopes, level: int
) -> tuple[Evaluation | None, float, int]:
    """First damping whose step makes the cost less, from the one that did last time; what the first promised."""
    promised = np.inf
    # Along secants that don't lead on, more damping costs more than slopes do.
    last = min(level + 2, DAMPINGS + 1) if problem.stale else DAMPINGS + 1
    for place in range(level, last):
        step = _step(problem, here, slopes, _damping(place))
        # Nats that the step promises to gain.
        expected = float(-(slopes.gradient @ step) - 0.5 * step @ slopes.curvature @ step)
        promised = min(promised, expected) if np.isfinite(promised) else expected
        try:
            # Initial states were eliminated without damping: they are held back as much.
            start = here.point.initial + slopes.initial_step(step) / (1.0 + _damping(place))
            found = problem.evaluate(Point(here.point.x + step, start))
        except ModelError:
            continue
        if found.cost < here.cost:
            return found, promised, max(0, place - 1)
    return None, promised, level


def _damping(place: int) -> float:
    """None, then by tens up to ten."""
    return 10.0 ** (place + 1 - DAMPINGS) if place else 0.0


def _step(problem: FitProblem, here: Evaluation, slopes: Slopes, damping: float) -> Real:
    low = np.minimum(np.maximum(problem.low - here.point.x, -LONGEST), 0.0)
    high = np.maximum(np.minimum(problem.high - here.point.x, LONGEST), 0.0)
    return bounded_step(slopes.curvature, slopes.gradient, low, high, damping=damping)


def _report(problem: FitProblem, here: Evaluation, slopes: Slopes, *, held: Mask) -> OutputErrorFit:
    x, run = here.point.x, problem.run
    z = problem.z(x)
    covariance = _inverse(slopes.curvature)
    offsets = here.residual.offsets
    outputs = here.outputs + offsets[:, None]
    white = problem.whitening.whitened(run.measurement.outputs - outputs)[:, held]
    return OutputErrorFit(
        values=run.tunables.values(z),
        z=z,
        effects=problem.effects_at(x),
        initial=here.point.initial,
        offsets=offsets,
        outputs=outputs,
        misfit=float(np.mean(here.residual.power)),
        held_by_output=np.mean(white**2, axis=1) if held.any() else np.zeros(0),
        prior_cost=2.0 * problem.prior_of(x),
        covariance=covariance,
        **_spreads(problem, x, covariance),
    )


class _Spreads(TypedDict):
    """What a covariance says of parameters and effects, see `OutputErrorFit`."""

    parameter_std: Real
    effect_std: tuple[Mapping[str, float], ...]
    undetermined: tuple[str, ...]


def _spreads(problem: FitProblem, x: Real, covariance: Real) -> _Spreads:
    tunables, z = problem.run.tunables, problem.z(x)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    own = np.concatenate([std[: problem.tuned], np.zeros(z.size - problem.tuned)])
    values = tunables.values(z)
    return _Spreads(
        parameter_std=own * tunables.tolerance * np.abs(np.array([values[name] for name in tunables.names])),
        effect_std=_effect_std(problem, x, std),
        undetermined=tuple(
            name for name, one in zip(tunables.names[: problem.tuned], std, strict=False) if one > 1 - LITTLE
        ),
    )


def _inverse(curvature: Real) -> Real:
    """Inverse of a matrix whose rows have very different units."""
    size = np.sqrt(np.maximum(np.diag(curvature), ZERO))
    values, vectors = np.linalg.eigh(curvature / size[:, None] / size)
    # Directions that rounding leaves without curvature are as good as unknown.
    spread = vectors / size[:, None]
    return np.asarray((spread / np.maximum(values, RIDGE)) @ spread.T, dtype=np.float64)


def _effect_std(problem: FitProblem, x: Real, std: Real) -> tuple[Mapping[str, float], ...]:
    found: list[dict[str, float]] = [{} for _ in problem.effects]
    for number, at, spread in zip(problem.numbers, x[problem.tuned :], std[problem.tuned :], strict=True):
        # Nothing changes with it, so nothing tells it.
        found[number.effect][number.name] = abs(number.slope(float(at))) * float(spread) if spread > 0 else np.inf
    return tuple(found)


def coloured_information(problem: FitProblem, here: Evaluation, slopes: Slopes) -> Real:
    """Variance ``[unknown, unknown]`` of a cost's slope at its least, whatever the residual's colour.

    Were the residual white it would be the curvature M of the cost, and the unknowns' covariance its inverse. With a
    residual that is correlated from sample to sample it's ``sum_j w_j^2 S_j R_j S_j'``, with R_j the autocovariance
    of output j's residual and S_j its change with the unknowns, and the covariance is ``M^-1 (that) M^-1`` (Morelli
    and Klein, *Accuracy of aerodynamic model parameters estimated from flight test data*, J. Guidance, Control, and
    Dynamics 20(1), 1997). The prior belongs to it.
    """
    moved = problem.followed(here, slopes)
    found = problem.prior_information(moved.shape[0])
    per_output = zip(np.moveaxis(moved, 1, 0), here.residual.white, weights(here.residual.power), strict=True)
    for columns, residual, weight in per_output:
        found += weight**2 * _through(_spread_out(columns, problem), _spread_out(residual, problem), problem.training)
    return found


def _spread_out(kept: Real, problem: FitProblem) -> Real:
    """``[..., sample]`` of all samples from training samples, 0 elsewhere."""
    whole = np.zeros((*kept.shape[:-1], problem.training.size))
    whole[..., problem.training] = kept
    return whole


def _through(columns: Real, residual: Real, seen: Mask) -> Real:
    """``C R C'`` with the autocovariance of a residual that is 0 where it isn't seen."""
    size = fft.next_fast_len(2 * residual.size, real=True)
    lags = max(int(LITTLE * residual.size), 1)
    covariance = _products(residual, size)[:lags] / np.maximum(_products(seen.astype(np.float64), size)[:lags], 1.0)
    # A noise that is told to be more than what is left is believed: it's one at least.
    covariance[0] = max(covariance[0], 1.0)
    # Falling to zero (Bartlett), so that no frequency gets a negative power by what long lags lack.
    tapered = covariance * (1.0 - np.arange(lags) / lags)
    ring = np.zeros(size)
    ring[:lags] = tapered
    ring[size - lags + 1 :] = tapered[:0:-1]
    power = np.maximum(fft.rfft(ring).real, 0.0)
    spectra = fft.rfft(columns, size, axis=-1)
    filtered = fft.irfft(spectra * power, size, axis=-1)[..., : residual.size]
    return np.asarray(columns @ filtered.T, dtype=np.float64)


def _products(signal: Real, size: int) -> Real:
    """Sum of products ``[lag]`` of a signal with itself."""
    return np.asarray(fft.irfft(np.abs(fft.rfft(signal, size)) ** 2, size), dtype=np.float64)

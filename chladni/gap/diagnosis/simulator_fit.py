"""Fit of a simulator's parameters, and of effects around it, to a log: output error with numeric slopes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from chladni.gap.diagnosis.simulator_runs import EFFECTIVE_SAMPLES, SimulatorRuns, log_likelihood, weights
from chladni.gap.tuning.bounded_step import bounded_step
from chladni.gap.tuning.effect_scale import EffectNumber, effect_numbers
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

#: Beyond three sigma of its tolerance a parameter isn't what the model says.
HARD_BOUND = 3.0
#: Steps for numeric slopes: large against the jitter that friction leaves in a run.
_NUDGE_Z, _NUDGE_X = 0.1, 0.03
_FARTHEST = 7.0
_NARROWER, _WIDER = float(np.log(5.0)), float(np.log(5.0))
_STEPS = 14
#: A step that gains less than this, in nats, is the last with these slopes.
_WORTHLESS = 0.1
_DAMPING, _MOST_DAMPING = 1e-3, 1e4


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatorFit(Value):
    """A hypothesis, fitted on the training blocks and judged on the others.

    Attributes
    ----------
    z
        ``[parameter]`` in sigmas.
    effects
        With their fitted values.
    covariance
        ``[unknown, unknown]`` of z, then of the effects' numbers on their scales.
    numbers
        What of the effects was fitted.
    outputs
        ``[output, sample]`` simulated.
    powers
        ``[output]`` mean square missed on held-out blocks, over the noise's power.
    log_evidence
        Nats.
    """

    z: Real
    effects: tuple[AttachedEffect, ...]
    covariance: Real
    numbers: tuple[EffectNumber, ...]
    outputs: Real
    powers: Real
    log_evidence: float

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def names(self) -> tuple[tuple[str, str], ...]:
        """Effect and site of each effect, in a fixed order."""
        return tuple(sorted((each.effect, each.site) for each in self.effects))

    def std(self, effect: int, name: str) -> float | None:
        """Standard deviation of an effect's parameter, None for one that was held."""
        for place, number in enumerate(self.numbers):
            if (number.effect, number.name) == (effect, name):
                spread = float(np.sqrt(self.covariance[self.z.size + place, self.z.size + place]))
                value = self.effects[effect].values[name]
                return spread * (number.scale or abs(value))
        return None


def fitted(
    runs: SimulatorRuns, z: Real, effects: Sequence[AttachedEffect], *, bound: float = HARD_BOUND
) -> SimulatorFit | None:
    """Fit parameters and effects together, from these values.

    Parameters
    ----------
    runs
        The simulator and the log.
    z
        ``[parameter]`` start, in sigmas.
    effects
        With the values to start from.
    bound
        Largest z.

    Returns
    -------
    SimulatorFit or None
        None when the simulation diverges at the start.
    """
    names = [(*effect.usually_fitted, *effect.kind.variant(effect.variant).parameters) for effect in effects]
    search = _Search(runs=runs, effects=tuple(effects), numbers=effect_numbers(effects, names), z_count=z.size)
    x = np.concatenate([np.clip(z, -bound, bound), np.zeros(len(search.numbers))])
    ranges = [_range(effects[each.effect], each) for each in search.numbers]
    low = np.array([*[-bound] * z.size, *(each[0] for each in ranges)])
    high = np.array([*[bound] * z.size, *(each[1] for each in ranges)])
    missed = search.missed(x)
    if missed is None:
        return None
    return search.judged(search.descended(search.point(x, missed), low, high))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Point(Value):
    """Where a search stands: unknowns, what is missed there over the noise, and minus the log posterior, nats."""

    x: Real
    missed: Real
    cost: float

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """What stays the same during one fit."""

    runs: SimulatorRuns
    effects: tuple[AttachedEffect, ...]
    numbers: tuple[EffectNumber, ...]
    z_count: int

    def at(self, x: Real) -> tuple[Real, tuple[AttachedEffect, ...]]:
        """Parameters in sigmas, and effects."""
        values = [dict(effect.values) for effect in self.effects]
        for number, one in zip(self.numbers, x[self.z_count :].tolist(), strict=True):
            values[number.effect][number.name] = number.value(one)
        found = [
            replace(effect, values=_consistent(effect, one)) for effect, one in zip(self.effects, values, strict=True)
        ]
        return x[: self.z_count], tuple(found)

    def missed(self, x: Real) -> Real | None:
        """None where the values contradict each other or the simulation diverges."""
        try:
            return self.runs.missed(*self.at(x))
        except ModelError:
            return None

    def point(self, x: Real, missed: Real) -> _Point:
        """Judge unknowns on the training blocks."""
        z = x[: self.z_count]
        powers = self.runs.powers(missed, self.runs.training)
        return _Point(x=x, missed=missed, cost=0.5 * float(z @ z) - log_likelihood(powers))

    def descended(self, point: _Point, low: Real, high: Real) -> tuple[_Point, Real]:
        """Levenberg & Marquardt with Broyden's updates of the slopes: a run costs far more than algebra.

        Returns the last point and the slopes there ``[unknown, output, sample]``.
        """
        slopes, fresh, damping = self.slopes(point, high), True, _DAMPING
        for _ in range(_STEPS if point.x.size else 0):
            trial = self.tried(point, slopes, low, high, damping)
            gained = -np.inf if trial is None else point.cost - trial.cost
            if trial is not None and gained > 0:
                slopes = _updated(slopes, point, trial)
                point, damping = trial, damping / 5
            else:
                damping *= 10
            if gained > _WORTHLESS:
                fresh = False
            elif not fresh:
                slopes, fresh = self.slopes(point, high), True
            elif gained > 0 or damping > _MOST_DAMPING:
                break
        return point, slopes

    def tried(self, point: _Point, slopes: Real, low: Real, high: Real, damping: float) -> _Point | None:
        """Make Gauss-Newton's step for the log posterior, inside the bounds; None where the simulation diverges."""
        curvature, gradient = self.quadratic(point, slopes)
        x = point.x + bounded_step(curvature, gradient, low - point.x, high - point.x, damping=damping)
        missed = self.missed(x)
        return None if missed is None else self.point(x, missed)

    def slopes(self, point: _Point, high: Real) -> Real:
        """``[unknown, output, sample]`` change of what is missed; none where the simulation would diverge."""
        slopes = np.zeros((point.x.size, *point.missed.shape))
        for place, value in enumerate(point.x):
            nudge = _NUDGE_Z if place < self.z_count else _NUDGE_X
            # Inward, where the other side isn't allowed.
            nudge = -nudge if value + nudge > high[place] else nudge
            moved = point.x.copy()
            moved[place] += nudge
            missed = self.missed(moved)
            if missed is not None:
                slopes[place] = (missed - point.missed) / nudge
        return slopes

    def quadratic(self, point: _Point, slopes: Real) -> tuple[Real, Real]:
        """Curvature and gradient of minus the log posterior, each output weighing as what is missed there does."""
        training = self.runs.training
        scale = weights(self.runs.powers(point.missed, training), int(training.sum()))[:, None]
        rows = (slopes[:, :, training] * scale).reshape(point.x.size, -1)
        prior = np.zeros(point.x.size)
        prior[: self.z_count] = 1.0
        gradient = rows @ (point.missed[:, training] * scale).ravel() + prior * point.x
        return rows @ rows.T + np.diag(prior), gradient

    def judged(self, found: tuple[_Point, Real]) -> SimulatorFit:
        """Judge the end of a search on the blocks that it didn't see."""
        point, slopes = found
        z, effects = self.at(point.x)
        powers = self.runs.powers(point.missed, ~self.runs.training)
        # The prior counts once: as what the parameters' move costs.
        evidence = log_likelihood(powers) - 0.5 * float(z @ z) - 0.5 * len(self.numbers) * np.log(EFFECTIVE_SAMPLES)
        curvature, _ = self.quadratic(point, slopes)
        return SimulatorFit(
            z=z,
            effects=effects,
            # What the log doesn't show at all is as uncertain as can be, not an error.
            covariance=np.asarray(np.linalg.pinv(curvature + 1e-12 * np.eye(point.x.size), hermitian=True)),
            numbers=self.numbers,
            outputs=self.runs.measurement.outputs - point.missed * self.runs.floor[:, None],
            powers=powers,
            log_evidence=float(evidence),
        )


def _updated(slopes: Real, before: _Point, after: _Point) -> Real:
    """Give slopes that agree with the step just made (Broyden 1965)."""
    moved = after.x - before.x
    change = after.missed - before.missed - np.tensordot(moved, slopes, axes=1)
    return np.asarray(slopes + np.multiply.outer(moved / float(moved @ moved), change))


def _range(effect: AttachedEffect, number: EffectNumber) -> tuple[float, float]:
    """Bounds of an effect's number on its scale."""
    low, high = max(number.low, -_FARTHEST), min(number.high, _FARTHEST)
    # Strengths may vanish. A shape far from where it was screened is another effect's: hysteresis with a yield of
    # next to nothing is dry friction, with one beyond the motion a spring.
    if number.scale == 0 and number.name not in effect.kind.neutral and number.name in effect.kind.parameters:
        return max(low, -_NARROWER), min(high, _WIDER)
    return low, high


def _consistent(effect: AttachedEffect, values: dict[str, float]) -> dict[str, float]:
    """Where a law's numbers contradict each other, lift the later strengths to the earlier: sticking to sliding."""
    if effect.kind.check is None or not effect.kind.check(values):
        return values
    strengths = [name for name in effect.kind.required if name in effect.kind.neutral]
    for lower, upper in pairwise(strengths):
        values[upper] = max(values[upper], values[lower])
    return values

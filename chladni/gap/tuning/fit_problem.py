"""An output-error fit as a least-squares problem: what it costs at a point, and how that changes around it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import JITTER, RIDGE, RUNAWAY, STEP, UNNOTICED, WIDE, ZERO
from chladni.gap.plant.free_run import FreeRun, initial_states
from chladni.gap.plant.law_plant import LawRunResult, Setting, around, coarse_run, differences, fine_run, slopes_of
from chladni.gap.plant.linear_run import decay, is_plain
from chladni.gap.tuning.effect_scale import EffectNumber, with_numbers
from chladni.gap.tuning.residual import Residual, Whitening, likelihood_cost, weights
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.integrator.integrator import Integrator
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError


@dataclass(frozen=True, slots=True)
class Point:
    """Unknowns: ``x`` of the parameters and effects, ``initial [window, state]``."""

    x: Real
    initial: Real


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A free run at a point, its residual, and the cost in nats; what its slopes need when the model has laws."""

    point: Point
    outputs: Real
    residual: Residual
    cost: float
    made: LawRunResult | None = None


@dataclass(frozen=True, slots=True)
class Slopes:
    """Least-squares equations around a point, initial states eliminated.

    ``curvature [unknown, unknown]`` and ``gradient [unknown]`` are those of the cost; `back` is for each window the
    step of its initial state, ``(constant [state], per unknown [state, unknown])``.
    """

    curvature: Real
    gradient: Real
    back: tuple[tuple[Real, Real], ...]

    def initial_step(self, step: Real) -> Real:
        """``[window, state]`` that goes with a step of the unknowns."""
        return np.array([constant - per @ step for constant, per in self.back])


class FitProblem:
    """Unknowns, bounds, prior, cost and slopes of one fit.

    The numbers are those of the effects' parameters that move; freed parameters may be wrong by a slip, see
    `Tunables`. They start, or stay, at ``start_z [parameter]``.
    """

    def __init__(
        self,
        run: FreeRun,
        whitening: Whitening,
        *,
        effects: Sequence[AttachedEffect],
        numbers: Sequence[EffectNumber],
        tune: bool,
        freed: Sequence[str] = (),
        held: bool = True,
        start_z: Real,
    ) -> None:
        self.run, self.whitening, self.training = run, whitening, whitening.training
        self.effects, self.numbers = tuple(effects), tuple(numbers)
        self.tuned = len(run.tunables.names) if tune else 0
        self.start_z = start_z
        limit, sure = run.tunables.limits(freed), run.tunables.precision(freed)
        limit = limit[: self.tuned] if held else np.full(self.tuned, np.inf)
        self.low = np.concatenate([-limit, [number.low for number in numbers]])
        self.high = np.concatenate([limit, [number.high for number in numbers]])
        self._prior = np.concatenate([sure[: self.tuned], np.full(len(numbers), UNNOTICED)])
        self._wide = np.zeros(0)
        compiled = run.compiled(start_z, self.effects)
        self.has_laws = bool(compiled.laws)
        self.has_slopes = not is_plain(compiled)
        self.coarse = self.has_slopes
        #: Whether the last slopes are secants of the steps since those before, not differences where they were asked.
        self.stale = False
        self._known: tuple[Evaluation, Real] | None = None

    def start(self) -> Point:
        """Where the fit begins: at rest, moved into the bounds."""
        states = len(self.run.compiled(self.start_z, self.effects).states)
        x = np.concatenate([self.start_z[: self.tuned], np.zeros(len(self.numbers))])
        return Point(np.clip(x, self.low, self.high), initial_states(None, len(self.run.windows), states))

    def start_of_windows(self) -> Point:
        """Where the fit begins, each window at the state that the linear part alone would begin with.

        A law that sticks forgets where it began: from rest no slope would tell that a window starts in motion.
        """
        start = self.start()
        z, effects = self.z(start.x), self.effects_at(start.x)
        linear = replace(self.run.compiled(z, effects), laws=())
        rate, windows = self.run.measurement.sample_rate_hz, self.run.windows
        integrator = Integrator(linear, rate)
        parts = [integrator.run(self.run.measurement.inputs[:, slice(*window)]) for window in windows]
        outputs = np.hstack([part.outputs[self.run.rows] for part in parts])
        residual = self.whitening.residual(self.run.measurement.outputs - outputs)
        here = Evaluation(start, outputs, residual, 0.0)
        step = self._equations(here, np.zeros((0, *outputs.shape)), self._local(start)).initial_step(np.zeros(0))
        return Point(start.x, step)

    def z(self, x: Real) -> Real:
        """``[parameter]`` of the model."""
        return np.concatenate([x[: self.tuned], self.start_z[self.tuned :]])

    def effects_at(self, x: Real) -> tuple[AttachedEffect, ...]:
        """Effects with their parameters."""
        return with_numbers(self.effects, self.numbers, x[self.tuned :])

    def evaluate(self, point: Point) -> Evaluation:
        """Run freely and judge; `ModelError` when the run diverges."""
        made = None
        if self.has_slopes:
            made = (coarse_run if self.coarse else fine_run)(self.run, self._setting(point.x), point.initial)
        outputs = (
            made.outputs
            if made is not None
            else self.run.outputs(self.z(point.x), self.effects_at(point.x), point.initial)
        )
        residual = self.whitening.residual(self.run.measurement.outputs - outputs)
        cost = likelihood_cost(residual.power, self.whitening.samples) + self.prior_cost(point)
        return Evaluation(point, outputs, residual, cost, made)

    def prior_cost(self, point: Point) -> float:
        """Half the squares of what is believed beforehand, in nats."""
        spread = self._spread(point)
        at_start = np.sum((point.initial * (spread > 0) / np.where(spread > 0, spread, 1.0)) ** 2)
        return self.prior_of(point.x) + float(0.5 * at_start)

    def prior_of(self, x: Real) -> float:
        """Half the squares of what the unknowns' sizes are believed to be beforehand, in nats."""
        return float(0.5 * np.sum(self._prior * x**2))

    def slopes(self, here: Evaluation, *, fresh: bool = False) -> Slopes:
        """Gauss and Newton's equations around a point, each output weighed by what it misses.

        Fresh ones are no secants. Where neighbouring motions part so fast that slopes leave the numbers there's an
        `EstimateError`.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            found = self._equations(here, *self._columns(here, fresh=fresh))
        # NaN is beyond too.
        if not (np.all(np.abs(found.curvature) < RUNAWAY) and np.all(np.isfinite(found.gradient))):
            raise EstimateError(
                "the run is too sensitive for a fit: its slopes leave the numbers; use shorter windows"
            )
        return found

    def followed(self, here: Evaluation, slopes: Slopes) -> Real:
        """``[unknown, output, training sample]``: change of the whitened outputs with each unknown.

        What a fit finds beside the unknowns, initial states and constants, follows them as it does at the slopes'
        point.
        """
        own, starts = self._columns(here)
        moved = self.whitening.seen(own)
        for (start, stop), (_, per) in zip(self.run.windows, slopes.back, strict=True):
            seen, local = self._seen(start, stop), starts(start, stop)
            local[self._spread(here.point) == 0] = 0.0
            moved[..., seen] -= np.einsum("su,son->uon", per, local)
        constants = self.whitening.constants()
        for place, constant in enumerate(constants[place, place] for place in range(len(constants))):
            share = moved[:, place] @ constant / (constant @ constant)
            moved[:, place] -= share[:, None] * constant
        return moved

    def prior_information(self, unknowns: int) -> Real:
        """``[unknown, unknown]``: what is known of the first so many unknowns beforehand."""
        return np.diag(self._prior[:unknowns])

    def _equations(self, here: Evaluation, own: Real, starts: Callable[[int, int], Real]) -> Slopes:
        root = np.sqrt(weights(here.residual.power))[:, None]
        residual = here.residual.white * root
        columns = np.concatenate([self.whitening.seen(own), self.whitening.constants()]) * root
        curvature, gradient = _products(columns, columns), -_products(columns, residual[None])[:, 0]
        unknowns = len(own)
        curvature[:unknowns, :unknowns] += np.diag(self._prior[:unknowns])
        gradient[:unknowns] += (self._prior * here.point.x)[:unknowns]
        spread = self._spread(here.point)
        sure = np.where(spread > 0, spread, 1.0) ** -2.0
        back = []
        for place, (start, stop) in enumerate(self.run.windows):
            seen, local = self._seen(start, stop), starts(start, stop) * root
            local[spread == 0] = 0.0
            slope = sure * here.point.initial[place] - _products(local, residual[None, :, seen])[:, 0]
            cross = _products(local, columns[..., seen])
            per, constant = _eliminated(_products(local, local) + np.diag(sure), cross, slope)
            curvature -= cross.T @ per
            gradient += cross.T @ constant
            back.append((constant, per))
        # Constants last: they are free, and known once the rest is.
        cross = curvature[unknowns:, :unknowns]
        per, constant = _eliminated(curvature[unknowns:, unknowns:], cross, gradient[unknowns:])
        return Slopes(
            curvature[:unknowns, :unknowns] - cross.T @ per,
            gradient[:unknowns] + cross.T @ constant,
            tuple((c - b[:, unknowns:] @ constant, b[:, :unknowns] - b[:, unknowns:] @ per) for c, b in back),
        )

    def _columns(self, here: Evaluation, *, fresh: bool = False) -> tuple[Real, Callable[[int, int], Real]]:
        """Slopes ``[unknown, output, sample]``, and whitened ``[state, output, training sample]`` of each window."""
        if here.made is None:
            own = self._secants(here, fresh) if self.run.is_black_box else self._differences(here)
            return own, self._local(here.point)
        own, starts = slopes_of(self.run, here.made, self._changed(here.point.x))
        white = self.whitening.whitened(starts)
        return own, lambda start, stop: white[..., start:stop][..., self.training[start:stop]]

    def _setting(self, x: Real) -> Setting:
        return Setting(self.z(x), self.effects_at(x))

    def _secants(self, here: Evaluation, fresh: bool) -> Real:
        """Differences, then what agrees with each step that was made (Broyden 1965): runs of others are dear."""
        if fresh or self._known is None:
            columns, self.stale = self._differences(here), False
        else:
            before, columns = self._known
            moved = here.point.x - before.point.x
            if np.any(moved):
                change = here.outputs - before.outputs - np.tensordot(moved, columns, axes=1)
                columns, self.stale = columns + np.multiply.outer(moved / (moved @ moved), change), True
        self._known = here, columns
        return columns

    def _differences(self, here: Evaluation) -> Real:
        return differences(self.run, self._changed(here.point.x), here.point.initial, here.outputs)

    def _changed(self, x: Real) -> list[tuple[Setting, float]]:
        return around(self._setting, x, self._steps(x))

    def _steps(self, x: Real) -> Real:
        """Steps of each unknown, away from the nearer bound."""
        apart = JITTER if self.run.is_black_box else STEP
        steps = np.concatenate([apart / self.run.tunables.tolerance[: self.tuned], np.full(len(self.numbers), apart)])
        return np.asarray(np.where(x + steps > self.high, -steps, steps))

    def _spread(self, point: Point) -> Real:
        """``[state]`` one sigma of an initial state, so wide that it only keeps the equations regular."""
        if not self._wide.size:
            with np.errstate(over="ignore"):
                alone = np.sqrt(np.mean(self._decays(point) ** 2, axis=(1, 2)))
            measured = np.mean(self.whitening.whitened(self.run.measurement.outputs) ** 2)
            # What grows beyond all numbers is seen all the more.
            alone = np.where(np.isfinite(alone), alone, RUNAWAY)
            seen = alone > RIDGE * max(alone.max(initial=0.0), ZERO)
            self._wide = np.where(seen, WIDE * np.sqrt(measured) / np.where(seen, alone, 1.0), 0.0)
        return self._wide

    def _decays(self, point: Point) -> Real:
        """``[state, output, sample]`` whitened outputs from a unit of each state, as long as the longest window."""
        compiled = self.run.compiled(self.z(point.x), self.effects_at(point.x))
        longest = max(stop - start for start, stop in self.run.windows)
        with np.errstate(over="ignore", invalid="ignore"):
            found = decay(compiled, self.run.rows, self.run.measurement.sample_rate_hz, longest)
            return self.whitening.whitened(found)

    def _local(self, point: Point) -> Callable[[int, int], Real]:
        """Slopes of a window's outputs over its start, of the linear part."""
        # At this point: after many cycles a decay of slightly other parameters is out of phase.
        decays = self._decays(point)
        return lambda start, stop: decays[..., : stop - start][..., self.training[start:stop]]

    def _seen(self, start: int, stop: int) -> slice:
        """Place of a window's samples among the training samples."""
        before = int(np.count_nonzero(self.training[:start]))
        return slice(before, before + int(np.count_nonzero(self.training[start:stop])))


def _products(left: Real, right: Real) -> Real:
    """``[left, right]`` sums over outputs and samples."""
    # Lengths are written out: of nothing, none can be told from the size.
    size = int(np.prod(left.shape[1:]))
    return np.asarray(left.reshape(len(left), size) @ right.reshape(len(right), size).T, dtype=np.float64)


def _eliminated(own: Real, cross: Real, slope: Real) -> tuple[Real, Real]:
    """Best step of some unknowns, ``constant - per step``, from ``own p + cross step + slope = 0``."""
    if not len(own):
        return np.zeros(cross.shape), np.zeros(0)
    if not np.all(np.isfinite(own)):
        return np.full(cross.shape, np.nan), np.full(len(own), np.nan)
    # A start that prints nothing (a state that no sensor sees) stays where it is.
    held = own + np.diag(RIDGE * np.diag(own) + ZERO) + np.diag(np.where(np.diag(own) > 0, 0.0, 1.0))
    solved = np.asarray(np.linalg.solve(held, np.column_stack([cross, slope])), dtype=np.float64)
    return solved[:, :-1], -solved[:, -1]

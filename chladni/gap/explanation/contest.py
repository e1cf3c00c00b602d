"""The contest: hypotheses fitted by output error on some stretches of a log, weighed on the others."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from chladni.gap.calibration import BLOCK_S, EFFECTIVE_SAMPLES, FEWEST, ITERATIONS, THIRDS
from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.explanation.evidence import Left, doubt_of, freedom_nats, left_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_effect import KnownStates
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.side_by_side import side_by_side
from chladni.gap.tuning.output_error import OutputErrorFit, fit_output_error, with_coloured_spread
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError, ModelError

if TYPE_CHECKING:
    from chladni.gap.records.noise_floor import NoiseFloor


def training_mask(samples: int, sample_rate_hz: float, period_samples: int | None = None) -> Mask:
    """Give ``[sample]``: True where fits may look, False in every third block of about 0.75 s.

    Blocks alternate over the whole log, so that a drift is on both sides; they don't keep step with a period.
    """
    block = max(int(BLOCK_S * sample_rate_hz), samples // EFFECTIVE_SAMPLES, 1)
    # At least four held-out blocks, or a bootstrap has nothing to draw from.
    block = min(block, max(samples // (FEWEST * THIRDS), 1))
    if period_samples is not None and period_samples % (THIRDS * block) < block:
        block += max(block // 7, 1)
    return np.asarray((np.arange(samples) // block) % THIRDS != 1, dtype=np.bool_)


class Contest:
    """Fits hypotheses to one log, on the samples that `training` marks.

    Windows begin their search at `states`; without them each begins at what its linear part alone would.
    """

    def __init__(
        self, run: FreeRun, problem: LinearProblem, training: Mask, states: KnownStates | None = None
    ) -> None:
        self.run, self.problem, self.training, self.states = run, problem, training, states
        self.noise: NoiseFloor = problem.noise
        #: Energy that runs over windows leave without a law, of what was entered.
        self._without_laws = np.inf

    def enter(
        self,
        hypothesis: Hypothesis,
        *,
        max_iterations: int = ITERATIONS,
        tune: bool = True,
        initial: Real | None = None,
    ) -> Contestant | None:
        """Fit a hypothesis, from some initial states ``[window, state]``; None when its start already diverges."""
        freed = tuple(dict.fromkeys((*hypothesis.freed, *self.run.tunables.wrong(hypothesis.start_z))))
        try:
            if initial is None:
                initial = self._initial(hypothesis)
            fit = fit_output_error(
                self.run, self.noise,
                effects=hypothesis.effects, fitted=hypothesis.fitted or None, training=self.training,
                start_z=hypothesis.start_z, freed=freed,
                start_initial=initial, max_iterations=max_iterations, tune=tune,
                # Over windows each start is free: of a free axis a constant is the same thing again.
                offsets=len(self.run.windows) == 1,
            )  # fmt: skip
        except (ModelError, EstimateError, np.linalg.LinAlgError):
            return None
        # One that came back inside its tolerance isn't wrong.
        return self.judged(replace(hypothesis, freed=self.run.tunables.wrong(fit.z)), fit)

    def judged(self, hypothesis: Hypothesis, fit: OutputErrorFit) -> Contestant:
        """Weigh a fit on the samples that it didn't see."""
        left = self._left(hypothesis, fit)
        freedom = freedom_nats(self.run, fit, hypothesis.fitted, hypothesis.freed, left)
        return Contestant(
            hypothesis=hypothesis,
            fit=fit,
            held=fit.held_by_output,
            gap=held_gap(self.run.measurement.outputs, fit.outputs, ~self.training),
            left=left,
            log_evidence=left.log_likelihood - 0.5 * fit.prior_cost + freedom - self._starts(fit),
        )

    def _left(self, hypothesis: Hypothesis, fit: OutputErrorFit) -> Left:
        detailed = [one.site for one in hypothesis.effects if not one.kind.clues.exact]
        if len(self.run.windows) == 1:
            return left_of(self.problem, self.run, fit, detailed)
        # Each window begins anew: over the record's lines what is left there prints no pattern.
        expected = float(self.problem.scale)
        energy = expected * float(np.mean(fit.held_by_output))
        if not hypothesis.effects:
            self._without_laws = min(self._without_laws, energy)
        tuned = (energy, expected, 0.0, 0.0) if detailed else (0.0, 0.0, energy, expected)
        return Left(
            along=tuned[0], along_expected=tuned[1], across=tuned[2], across_expected=tuned[3],
            force=self._without_laws, doubt=doubt_of(self.noise), sites=len(set(detailed)),
        )  # fmt: skip

    def with_spread(self, found: Contestant) -> Contestant:
        """Give a contestant with the standard deviations that the colour of its residual allows."""
        try:
            fit = with_coloured_spread(
                self.run, self.noise, found.fit,
                fitted=found.hypothesis.fitted or None, training=self.training, freed=found.hypothesis.freed,
                tune=bool(np.any(found.fit.parameter_std)), offsets=len(self.run.windows) == 1,
            )  # fmt: skip
        except (ModelError, EstimateError, np.linalg.LinAlgError):
            return found
        return replace(found, fit=fit)

    def _initial(self, hypothesis: Hypothesis) -> Real | None:
        """``[window, state]`` to begin a fit at; what effects add begins at rest."""
        if hypothesis.initial is not None:
            own = hypothesis.initial[:, : len(self.run.compiled().states)]
            added = len(self.run.compiled(None, hypothesis.effects).states) - own.shape[1]
            return np.pad(own, ((0, 0), (0, added)))
        if self.states is None:
            return None
        return self.states.at_starts(self.run.windows, self.run.compiled(None, hypothesis.effects).states)

    def _starts(self, fit: OutputErrorFit) -> float:
        """Nats for the states that effects begin windows with, beyond those of the first: all are free numbers.

        Each is told by its own window's samples alone, and pays by these.
        """
        windows = len(self.run.windows)
        added = max(fit.initial.shape[-1] - len(self.run.compiled().states), 0) * (windows - 1)
        return float(0.5 * added * np.log(max(EFFECTIVE_SAMPLES / windows, 2.0)))

    def enter_all(
        self, hypotheses: Sequence[Hypothesis], progress: Callable[[float], None] | None = None
    ) -> list[Contestant]:
        """Fit hypotheses, and give them in their order; those that diverge are left out."""
        return [one for one in side_by_side(self.enter, hypotheses, progress) if one is not None]


def held_gap(measured: Real, simulated: Real, held: Mask) -> float:
    """RMS of the residual over RMS of what was measured on held-out samples, outputs pooled; 1 when nothing fits."""
    return pooled_gap((measured - simulated)[:, held], measured[:, held])

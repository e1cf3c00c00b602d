"""A candidate in an experiment: what it predicts, and how that moves with its parameters."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import LONGEST, STEP
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.law_plant import Setting, fine_run, slopes_of
from chladni.gap.plant.linear_run import can_run, decay
from chladni.gap.plant.tunable import Tunables
from chladni.gap.tuning.effect_scale import EffectNumber, effect_numbers, with_numbers
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a candidate predicts, and its slopes.

    Attributes
    ----------
    outputs
        ``[output, sample]``.
    own
        ``[unknown, output, sample]`` by its parameters and those of its effects.
    starts
        ``[state, output, sample]`` by the initial state of each window.
    at
        ``[unknown]`` where.
    """

    outputs: Real
    own: Real
    starts: Real
    at: Real


class Rival:
    """One fitted candidate.

    Parameters
    ----------
    contestant
        With its fit.
    tunables
        Of the model.
    """

    def __init__(self, contestant: Contestant, tunables: Tunables) -> None:
        fit, hypothesis = contestant.fit, contestant.hypothesis
        self.contestant = contestant
        self._z, self._tolerance = fit.z, tunables.tolerance
        self._effects = fit.effects
        fitted = hypothesis.fitted if len(hypothesis.fitted) == len(fit.effects) else None
        self._numbers: tuple[EffectNumber, ...] = effect_numbers(fit.effects, fitted)
        limit, sure = tunables.limits(hypothesis.freed), tunables.precision(hypothesis.freed)
        low = [max(one.low, -LONGEST) for one in self._numbers]
        high = [min(one.high, LONGEST) for one in self._numbers]
        #: Bounds on the unknowns, which are 0 at the fit.
        self.low = np.concatenate([np.minimum(-limit - fit.z, 0.0), low])
        self.high = np.concatenate([np.maximum(limit - fit.z, 0.0), high])
        #: ``[unknown]`` where the unknowns are believed beforehand, and how much.
        self.believed = np.concatenate([-fit.z, np.zeros(len(low))])
        self.sure = np.concatenate([sure, np.zeros(len(low))])

    def paid(self, at: Real) -> float:
        """Nats that the parameters pay to go from the fit to ``at [unknown]``."""
        there, here = at - self.believed, -self.believed
        return float(0.5 * np.sum(self.sure * (there**2 - here**2)))

    @property
    def unknowns(self) -> int:
        """How many numbers a refit would move."""
        return int(self.low.size)

    def predicted(self, run: FreeRun, initial: Real, at: Real | None = None) -> Prediction:
        """Predict an experiment.

        Parameters
        ----------
        initial
            ``[window, state]``.
        at
            ``[unknown]``; as fitted by default.

        Raises
        ------
        ModelError
            When it diverges there.
        """
        x = np.zeros(self.unknowns) if at is None else at
        here = self._setting(x)
        compiled = run.compiled(here.z, here.effects)
        if can_run(compiled):
            made = fine_run(run, here, initial)
            steps = self._steps(x)
            changed = [(self._setting(x + row), by) for row, by in zip(np.diag(steps), steps, strict=True)]
            own, starts = slopes_of(run, made, changed)
            return Prediction(made.outputs, own, starts, x)
        outputs = run.outputs(here.z, here.effects, initial)
        own = np.empty((x.size, *outputs.shape))
        for place, by in enumerate(self._steps(x)):
            moved = x.copy()
            moved[place] += by
            there = self._setting(moved)
            own[place] = (run.outputs(there.z, there.effects, initial) - outputs) / by
        rate = run.measurement.sample_rate_hz
        longest = decay(compiled, run.rows, rate, max(stop - start for start, stop in run.windows))
        starts = np.concatenate([longest[..., : stop - start] for start, stop in run.windows], axis=-1)
        return Prediction(outputs, own, starts, x)

    def _setting(self, x: Real) -> Setting:
        count = self._z.size
        return Setting(self._z + x[:count], with_numbers(self._effects, self._numbers, x[count:]))

    def _steps(self, x: Real) -> Real:
        steps = np.concatenate([STEP / self._tolerance, np.full(len(self._numbers), STEP)])
        return np.asarray(np.where(x + steps > self.high, -steps, steps))

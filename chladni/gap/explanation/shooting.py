"""Multiple shooting: a hypothesis fitted over short windows from recovered states, which then grow to the whole run.

A run of a strongly nonlinear machine has several ends for one set of parameters, and between them its misfit has
minima that no slope leads out of. Over a window no longer than an oscillation there's one, when the window begins at
the state that the machine had there (Bock, in: Modelling of Chemical Reaction Systems, Springer 1981).
"""

from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import PARTED
from chladni.gap.comparison.whitening import with_law_error
from chladni.gap.explanation.contest import Contest
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_effect import KnownStates
from chladni.gap.plant.free_run import FreeRun, Windows
from chladni.gap.plant.windows import nested_windows, training_in_windows
from chladni.gap.tuning.output_error import OutputErrorFit, fit_output_error
from chladni.gap.tuning.residual import Whitening
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError, ModelError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """A hypothesis fitted over windows.

    Attributes
    ----------
    hypothesis
        With the values that the windows led to.
    misfit
        Mean square of the whitened residual in the median window, 1 is noise: a few that began at a state from which
        the search didn't find to the machine's say nothing of the law.
    level
        How often the windows have grown.
    """

    hypothesis: Hypothesis
    fit: OutputErrorFit
    misfit: float
    level: int = 0


class Shooting:
    """Fits over windows that grow to those of a contest, from states that the machine went through."""

    def __init__(self, contest: Contest, states: KnownStates) -> None:
        self.contest, self.states = contest, states
        run = contest.run
        self.levels = nested_windows(run.model, run.measurement, run.windows)
        floor = with_law_error(contest.noise, np.std(run.measurement.outputs, axis=1))
        self._whitening = Whitening(floor, contest.training, offsets=False)

    def shot(self, hypothesis: Hypothesis) -> Shot | None:
        """Fit over the shortest windows; None when that fails, or when there are no shorter ones."""
        if not self.levels:
            return None
        try:
            names = self.contest.run.compiled(None, hypothesis.effects).states
        except ModelError:
            return None
        return self._shot(hypothesis, 0, self.states.at_starts(self.levels[0], names))

    def grown(self, shot: Shot) -> Shot:
        """Let the windows grow as long as the run follows the log."""
        while shot.level + 1 < len(self.levels):
            level = shot.level + 1
            starts = _firsts(shot.fit, self.levels[shot.level], self.levels[level])
            longer = self._shot(shot.hypothesis, level, starts)
            if longer is None or longer.misfit > PARTED * max(shot.misfit, 1.0):
                break
            shot = longer
        return shot

    def entered(self, shot: Shot) -> Contestant | None:
        """Enter the contest from where the windows led."""
        found = self.grown(shot)
        run = self.contest.run
        return self.contest.enter(found.hypothesis, initial=_firsts(found.fit, self.levels[found.level], run.windows))

    def _shot(self, hypothesis: Hypothesis, level: int, starts: Real) -> Shot | None:
        run, windows = self.contest.run, self.levels[level]
        try:
            fit = fit_output_error(
                FreeRun(run.model, run.measurement, tolerance=run.tolerance, windows=windows), self.contest.noise,
                effects=hypothesis.effects, fitted=hypothesis.fitted or None, training=training_in_windows(windows),
                start_z=hypothesis.start_z, start_initial=starts, offsets=False,
            )  # fmt: skip
        except (ModelError, EstimateError, np.linalg.LinAlgError):
            return None
        reached = replace(hypothesis, effects=fit.effects, start_z=fit.z)
        return Shot(hypothesis=reached, fit=fit, misfit=self._misfit(fit, windows), level=level)

    def _misfit(self, fit: OutputErrorFit, windows: Windows) -> float:
        power = np.mean(self._whitening.whitened(self.contest.run.measurement.outputs - fit.outputs) ** 2, axis=0)
        return float(np.median([np.mean(power[slice(*window)]) for window in windows]))


def _firsts(fit: OutputErrorFit, windows: Windows, longer: Windows) -> Real:
    """``[window, state]`` at the starts of longer windows, which some of the shorter ones begin with too."""
    starts = [start for start, _ in windows]
    return fit.initial[[starts.index(start) for start, _ in longer]]

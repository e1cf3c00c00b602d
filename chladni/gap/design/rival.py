"""A candidate in an experiment: what it predicts, how that moves with its numbers, and how near another comes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import LONGEST, PROFILE_STEPS, ROUNDING, STEP
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.law_plant import Setting, around, differences, fine_run, slopes_of
from chladni.gap.plant.linear_run import decay, is_plain
from chladni.gap.plant.tunable import Tunables
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.bounded_step import bounded_step
from chladni.gap.tuning.effect_scale import EffectNumber, effect_numbers, with_numbers
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a candidate predicts, ``outputs [output, sample]``, and its slopes.

    Those are ``own [unknown, output, sample]`` by its parameters and those of its effects, and ``starts [state,
    output, sample]`` by the initial state of each window.
    """

    outputs: Real
    own: Real
    starts: Real


class Rival:
    """One fitted candidate."""

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
        """Predict an experiment from ``initial [window, state]``, as fitted or ``at [unknown]``.

        A candidate that diverges there is a `ModelError`.
        """
        x = np.zeros(self.unknowns) if at is None else at
        here, changed = self._setting(x), around(self._setting, x, self._steps(x))
        compiled = run.compiled(here.z, here.effects)
        if not is_plain(compiled):
            made = fine_run(run, here, initial)
            return Prediction(made.outputs, *slopes_of(run, made, changed))
        outputs = run.outputs(here.z, here.effects, initial)
        own = differences(run, changed, initial, outputs)
        rate = run.measurement.sample_rate_hz
        longest = decay(compiled, run.rows, rate, max(stop - start for start, stop in run.windows))
        starts = np.concatenate([longest[..., : stop - start] for start, stop in run.windows], axis=-1)
        return Prediction(outputs, own, starts)

    def _setting(self, x: Real) -> Setting:
        count = self._z.size
        return Setting(self._z + x[:count], with_numbers(self._effects, self._numbers, x[count:]))

    def _steps(self, x: Real) -> Real:
        steps = np.concatenate([STEP / self._tolerance, np.full(len(self._numbers), STEP)])
        return np.asarray(np.where(x + steps > self.high, -steps, steps))


@dataclass(frozen=True, slots=True)
class Part:
    """One record that is imitated: ``sums [window, output, column, column]``, see `sums_of`, and its samples.

    `scale` is the ``[output]`` mean square of the whitened residual that isn't held against a candidate.
    """

    sums: Real
    scale: Real
    samples: int


def sums_of(wanted: Real, prediction: Prediction, noise: NoiseFloor, windows: Sequence[tuple[int, int]]) -> Real:
    """Sum products over the samples of each window, ``[window, output, column, column]``.

    Columns are the whitened difference ``[output, sample]`` of what is wanted and predicted, the slopes by the
    unknowns, and those by the initial states; a constant of each output is taken out. Any choice of outputs and
    weights is a sum of these.
    """
    columns = np.concatenate([(wanted - prediction.outputs)[None], prediction.own, prediction.starts])
    white = noise.whitened(columns)
    white -= white.mean(axis=-1, keepdims=True)
    flat = np.swapaxes(white, 0, 1)
    parts = [flat[..., start:stop] for start, stop in windows]
    return np.stack([one @ np.swapaxes(one, 1, 2) for one in parts])


def imitated(rival: Rival, at: Real, parts: Sequence[Part]) -> tuple[Real, list[Real]]:
    """Refit a candidate by one linear step to what another one predicts, to all records at once.

    The step makes ``sum_j N_j/2 ln(v_j + delta_j) + z.z/2`` least, with v_j the scale of output j, N_j its samples,
    and delta_j the mean square of the whitened difference that is left.

    Parameters
    ----------
    at
        ``[unknown]`` where the slopes in `parts` were taken.

    Returns
    -------
    at
        ``[unknown]`` where the step ends.
    left
        delta ``[output]`` of each part.
    """
    left = [part.sums[..., 0, 0].sum(axis=0) / part.samples for part in parts]
    step = np.zeros(rival.unknowns)
    for _ in range(PROFILE_STEPS):
        weighed = [
            np.tensordot(part.sums, 1.0 / (part.scale + one), axes=([1], [0]))
            for part, one in zip(parts, left, strict=True)
        ]
        step, starts = _solved(rival, at, np.concatenate(weighed))
        whole = np.concatenate([np.ones((len(starts), 1)), np.tile(-step, (len(starts), 1)), -starts], axis=1)
        first, left = 0, []
        for part in parts:
            own = whole[first : first + len(part.sums)]
            first += len(part.sums)
            found = np.einsum("wk,wokl,wl->o", own, part.sums, own) / part.samples
            left.append(np.maximum(found, 0.0))
    return at + step, left


def _solved(rival: Rival, at: Real, sums: Real) -> tuple[Real, Real]:
    """Best step and initial states ``[window, state]`` from weighed sums ``[window, column, column]``."""
    known = rival.unknowns
    per = _eliminated(sums, known)
    cross = sums[:, known + 1 :, : known + 1]
    rest = (sums[:, : known + 1, : known + 1] - np.swapaxes(cross, 1, 2) @ per).sum(axis=0)
    curvature = rest[1:, 1:] + np.diag(rival.sure)
    gradient = -rest[1:, 0] + rival.sure * (at - rival.believed)
    low, high = np.minimum(rival.low - at, 0.0), np.maximum(rival.high - at, 0.0)
    step = bounded_step(curvature, gradient, low, high, damping=0.0)
    return step, per[:, :, 0] - per[:, :, 1:] @ step


def _eliminated(sums: Real, known: int) -> Real:
    """Best initial states for the difference and for each unknown, ``[window, state, 1 + unknown]``."""
    local, cross = sums[:, known + 1 :, known + 1 :], sums[:, known + 1 :, : known + 1]
    size = np.einsum("wkk->wk", local)
    # States that print nothing keep a one in the scaled equations.
    root = np.sqrt(np.where(size > 0, size, 1.0))
    scaled = local / root[:, :, None] / root[:, None, :]
    scaled += np.eye(local.shape[-1]) * np.where(size > 0, ROUNDING, 1.0)[:, None, :]
    return np.asarray(np.linalg.solve(scaled, cross / root[:, :, None]) / root[:, :, None], dtype=np.float64)

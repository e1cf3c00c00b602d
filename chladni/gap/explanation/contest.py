"""The contest: hypotheses fitted by output error on some stretches of a log, weighed on the others."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.known_states import KnownStates
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.side_by_side import side_by_side
from chladni.gap.tuning.output_error import OutputErrorFit, fit_output_error, with_coloured_spread
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError, ModelError

#: Independent samples that a log is taken for, whatever its length: a model that is right but for details of its law
#: must not be refuted by those details a million times over (see docs/methods/gap-explanation.md).
EFFECTIVE_SAMPLES = 200.0
#: Share of the noise's power that details of a law may leave without counting against it.
SLACK = 0.3
#: Least of them that tell a state at the start of a window.
_LEAST_SAMPLES = 2.0
#: Nats by which fits of one form differ that ended at the same place.
_SAME = 0.5
_BLOCK_S = 0.75
#: Every so manieth block is held out.
_EVERY = 3


def training_mask(samples: int, sample_rate_hz: float, period_samples: int | None = None) -> Mask:
    """Give ``[sample]``: True where fits may look, False in every third block of about 0.75 s.

    Blocks alternate over the whole log, so that a drift is on both sides; they don't keep step with a period.
    """
    block = max(int(_BLOCK_S * sample_rate_hz), samples // 200, 1)
    # At least four held-out blocks, or a bootstrap has nothing to draw from.
    block = min(block, max(samples // (4 * _EVERY), 1))
    if period_samples is not None and period_samples % (_EVERY * block) < block:
        block += max(block // 7, 1)
    return np.asarray((np.arange(samples) // block) % _EVERY != 1, dtype=np.bool_)


class Contest:
    """Fits hypotheses to one log.

    Parameters
    ----------
    run
        The model driven by the log.
    noise
        Of the outputs.
    training
        ``[sample]`` what fits may see.
    states
        Those that windows begin their search at; without them each begins at what its linear part alone would.
    """

    def __init__(self, run: FreeRun, noise: NoiseFloor, training: Mask, states: KnownStates | None = None) -> None:
        self.run, self.noise, self.training, self.states = run, noise, training, states

    def enter(
        self,
        hypothesis: Hypothesis,
        *,
        max_iterations: int = 12,
        tune: bool = True,
        initial: Real | None = None,
        only_coarse: bool = False,
    ) -> Contestant | None:
        """Fit a hypothesis, from some initial states ``[window, state]``; None when its start already diverges."""
        try:
            if initial is None:
                initial = self._initial(hypothesis)
            fit = fit_output_error(
                self.run, self.noise,
                effects=hypothesis.effects, fitted=hypothesis.fitted or None, training=self.training,
                start_z=np.clip(hypothesis.start_z, -3.0, 3.0) if not hypothesis.wide else hypothesis.start_z,
                z_limit={name: hypothesis.wide.get(name, 3.0) for name in self.run.tunables.names},
                start_initial=initial, max_iterations=max_iterations, tune=tune, only_coarse=only_coarse,
                # Over windows each start is free: of a free axis a constant is the same thing again.
                offsets=len(self.run.windows) == 1,
            )  # fmt: skip
        except (ModelError, EstimateError, np.linalg.LinAlgError):
            return None
        return self.judged(hypothesis, fit)

    def judged(self, hypothesis: Hypothesis, fit: OutputErrorFit) -> Contestant:
        """Weigh a fit on the samples that it didn't see."""
        held = fit.held_by_output
        # A parameter that may leave its tolerance pays for its freedom instead of its distance.
        wide = [self.run.tunables.names.index(name) for name in hypothesis.wide]
        prior = fit.prior_cost - float(np.sum(fit.z[wide] ** 2))
        return Contestant(
            hypothesis=hypothesis,
            fit=fit,
            held=held,
            gap=held_gap(self.run.measurement.outputs, fit.outputs, ~self.training),
            prior=prior,
            starts=self._starts(fit),
        )

    def with_spread(self, found: Contestant) -> Contestant:
        """Give a contestant with the standard deviations that the colour of its residual allows."""
        try:
            fit = with_coloured_spread(
                self.run, self.noise, found.fit,
                fitted=found.hypothesis.fitted or None, training=self.training,
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
        return float(0.5 * added * np.log(max(EFFECTIVE_SAMPLES / windows, _LEAST_SAMPLES)))

    def enter_all(
        self,
        hypotheses: Sequence[Hypothesis],
        progress: Callable[[float], None] | None = None,
        *,
        max_iterations: int = 12,
        only_coarse: bool = False,
    ) -> list[Contestant]:
        """Fit hypotheses, and give them in their order; those that diverge are left out."""
        enter = partial(self.enter, max_iterations=max_iterations, only_coarse=only_coarse)
        return [one for one in side_by_side(enter, hypotheses, progress) if one is not None]


def weighed(contestants: Sequence[Contestant]) -> list[Contestant]:
    """Give contestants with their evidence, by falling evidence.

    Noise that no fit saw can't be less than what the best of them leaves of it: where an effect at a sensor, such as
    clipping, looked like noise at first, its floor is lowered to that, the same for all.
    """
    if not contestants:
        return []
    floor = lowest(contestants)
    found = [
        replace(one, log_evidence=log_evidence(one.held / floor, one.prior, one.hypothesis.freedom) - one.starts)
        for one in contestants
    ]
    return sorted(found, key=lambda one: -one.log_evidence)


def distinct(ranked: Sequence[Contestant]) -> list[Contestant]:
    """Give weighed contestants without those that ended where another of the same name and form did.

    Searches from several starts often find one fit; in a share of probabilities it counts once.
    """
    found: list[Contestant] = []
    for one in ranked:
        if not any(_is_same(one, other) for other in found):
            found.append(one)
    return found


def _is_same(one: Contestant, other: Contestant) -> bool:
    forms = [
        {(effect.effect, effect.site, effect.variant, effect.source) for effect in each.hypothesis.effects}
        for each in (one, other)
    ]
    close = abs(one.log_evidence - other.log_evidence) < _SAME
    return close and forms[0] == forms[1] and one.hypothesis.wide == other.hypothesis.wide


def lowest(contestants: Sequence[Contestant]) -> Real:
    """Give ``[output]`` what the best of contestants leave, over the noise's estimate; at most 1."""
    return np.asarray(np.minimum(np.min([one.held for one in contestants], axis=0), 1.0), dtype=np.float64)


def log_evidence(held: Real, prior: float, freedom: int) -> float:
    """Held-out predictive log likelihood in nats, with prior and a penalty for freedom (Schwarz 1978).

    ``-N/2 sum_j ln((m_j + slack)/(1 + slack)) - prior/2 - freedom/2 ln N`` with m_j the whitened mean square of
    output j and N the effective number of samples.
    """
    likelihood = -0.5 * EFFECTIVE_SAMPLES * float(np.sum(np.log((held + SLACK) / (1.0 + SLACK))))
    return likelihood - 0.5 * prior - 0.5 * freedom * float(np.log(EFFECTIVE_SAMPLES))


def held_gap(measured: Real, simulated: Real, held: Mask) -> float:
    """RMS of the residual over RMS of what was measured on held-out samples, outputs pooled; 1 when nothing fits."""
    return pooled_gap((measured - simulated)[:, held], measured[:, held])

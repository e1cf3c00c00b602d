"""Search for the effects that bring a simulator to a log: screened, fitted, added while the evidence pays for it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from chladni.gap.diagnosis.simulator_fit import SimulatorFit, fitted
from chladni.gap.diagnosis.simulator_runs import SimulatorRuns, can_act, log_likelihood
from chladni.gap.diagnosis.simulator_screen import Screened, screen
from chladni.gap.diagnosis.simulator_starts import SiteScales, starts
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

Progress = Callable[[str, float], None]
#: How many of the screen's best are fitted, alone and in pairs.
_SINGLES, _PAIRS, _SIBLINGS, _FURTHER = 6, 4, 3, 3
#: Nats that a further effect must gain beside what its numbers cost: "very strong" (Kass & Raftery 1995).
_WORTH = 5.0
_MOST_EFFECTS = 3
#: Share of the gap beyond the noise that a further effect must close: no law is exact, and others dress its errors.
_LEAST_CLOSING = 0.03
#: Missed power over the noise's: under which nothing is left to explain, and too little for two effects at once.
_AT_NOISE, _NEAR_NOISE = 1.1, 1.5
#: Sigmas that parameters may go when nothing else is to explain the log.
_LOOSE = 20.0
_FAR_STARTS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorSearch:
    """Everything that was fitted.

    Attributes
    ----------
    runs
        The simulator and the log.
    nominal
        ``[output, sample]`` of the simulator as it came.
    tuned, loose
        Parameters alone: inside their tolerance, and wherever they go.
    best
        What explains the log best: effects, or `tuned`.
    fits
        Every hypothesis with effects.
    singles
        The screen of single effects, by falling gain.
    """

    runs: SimulatorRuns
    nominal: Real
    tuned: SimulatorFit
    loose: SimulatorFit
    best: SimulatorFit
    fits: tuple[SimulatorFit, ...]
    singles: tuple[Screened, ...]


def search(runs: SimulatorRuns, kinds: Sequence[EffectKind], *, progress: Progress) -> SimulatorSearch:
    """Tune, screen and fit.

    Parameters
    ----------
    runs
        The simulator and the log.
    kinds
        Effects to try.
    progress
        Called with what is being done, and the share that is done.

    Raises
    ------
    ModelError
        When the simulator diverges as it came.
    """
    start = np.zeros(len(runs.tunables.names))
    nominal = runs.simulated(start, ())
    progress("tuning", 0.0)
    tuned = _required(fitted(runs, start, ()))
    if np.all(tuned.powers < _AT_NOISE):
        return _result(runs, nominal, tuned, tuned, (), ())
    loose = _loosened(runs, tuned)
    screening = screen(runs, kinds, tuned.z, progress=partial(progress, "screening"))
    fits = _fits(runs, screening.singles[:_SINGLES], tuned, "fitting", progress)
    small = np.all(tuned.powers < _NEAR_NOISE)
    if small and _best([tuned, *fits]).log_evidence < tuned.log_evidence + _WORTH:
        return _result(runs, nominal, tuned, loose, tuple(fits), screening.singles)
    if not np.all(_best([tuned, *fits]).powers < _AT_NOISE):
        fits += _fits(runs, screening.pairs[:_PAIRS], tuned, "fitting pairs", progress)
    if fits:
        fits += _rivals(runs, kinds, _best(fits), progress)
        fits += _pruned(runs, _best(fits))
        fits += _grown(runs, kinds, tuned, _thriftiest(runs, tuned, fits), progress)
    return _result(runs, nominal, tuned, loose, tuple(fits), screening.singles)


def _left(runs: SimulatorRuns, tuned: SimulatorFit, fit: SimulatorFit) -> float:
    """Share of the tuned simulator's gap that a fit leaves."""
    return runs.gap(fit.outputs) / max(runs.gap(tuned.outputs), 1e-12)


def _result(
    runs: SimulatorRuns,
    nominal: Real,
    tuned: SimulatorFit,
    loose: SimulatorFit,
    fits: tuple[SimulatorFit, ...],
    singles: tuple[Screened, ...],
) -> SimulatorSearch:
    return SimulatorSearch(
        runs=runs,
        nominal=nominal,
        tuned=tuned,
        loose=loose,
        best=_thriftiest(runs, tuned, fits),
        fits=fits,
        singles=singles,
    )


def _loosened(runs: SimulatorRuns, tuned: SimulatorFit) -> SimulatorFit:
    """Fit parameters alone without bounds, also from where a single one explains most: optima lie far apart."""
    starts = [
        move * each for each in np.eye(tuned.z.size) for move in (-_LOOSE / 2, -_LOOSE / 4, _LOOSE / 4, _LOOSE / 2)
    ]
    judged = sorted(starts, key=lambda z: _likelihood(runs, z), reverse=True)
    fits = [fitted(runs, z, (), bound=_LOOSE) for z in (tuned.z, *judged[:_FAR_STARTS])]
    return _best([tuned, *(fit for fit in fits if fit is not None)])


def _likelihood(runs: SimulatorRuns, z: Real) -> float:
    try:
        return log_likelihood(runs.powers(runs.missed(z, ()), runs.training))
    except ModelError:
        return -np.inf


def _required(fit: SimulatorFit | None) -> SimulatorFit:
    if fit is None:
        raise ModelError("the simulator diverges with the log's inputs; check their units, or shorten its step")
    return fit


def _best(fits: Sequence[SimulatorFit]) -> SimulatorFit:
    return max(fits, key=lambda each: each.log_evidence)


def _thriftiest(runs: SimulatorRuns, tuned: SimulatorFit, fits: Sequence[SimulatorFit]) -> SimulatorFit:
    """Give the best of as few effects as do: each further one must be worth it, and close some of the gap."""
    best = tuned
    for count in range(1, _MOST_EFFECTS + 1):
        found = [each for each in fits if len(each.effects) == count]
        if found:
            leading = _best(found)
            closes = _left(runs, tuned, best) - _left(runs, tuned, leading)
            if leading.log_evidence > best.log_evidence + _WORTH and closes > _LEAST_CLOSING:
                best = leading
    return best


def _fits(
    runs: SimulatorRuns, screened: Sequence[Screened], tuned: SimulatorFit, doing: str, progress: Progress
) -> list[SimulatorFit]:
    found = []
    for count, each in enumerate(screened):
        progress(doing, count / len(screened))
        fit = fitted(runs, tuned.z, each.effects)
        if fit is not None:
            found.append(fit)
    return found


def _rivals(
    runs: SimulatorRuns, kinds: Sequence[EffectKind], best: SimulatorFit, progress: Progress
) -> list[SimulatorFit]:
    """At each site of the best hypothesis, fit what else could act there, in every form of its law."""
    found = []
    for place, effect in enumerate(best.effects):
        rest = (*best.effects[:place], *best.effects[place + 1 :])
        taken = {each.effect for each in rest if each.site == effect.site}
        own = [kind for kind in kinds if kind.name not in taken]
        screening = screen(runs, own, best.z, rest, only=effect.site, progress=lambda _share: None)
        (site,) = (each for each in screening.scales if each.name == effect.site)
        tried = [each.effects[0] for each in screening.singles[:_SIBLINGS]]
        if effect.effect not in [each.effect for each in tried]:
            tried.append(effect)
        forms = [form for each in tried for form in _forms(runs, each, site)]
        others = [form for form in forms if (form.effect, form.variant) != (effect.effect, effect.variant)]
        wider = [Screened(effects=(*rest, form), gain=0.0) for form in others]
        found += _fits(runs, wider, best, f"comparing causes at {effect.site}", progress)
    return found


def _forms(runs: SimulatorRuns, effect: AttachedEffect, site: SiteScales) -> list[AttachedEffect]:
    """Give the effect in each form of its law, with what the forms share as it is."""
    found = [effect]
    shared = {name: value for name, value in effect.values.items() if name in effect.kind.parameters}
    for variant in effect.kind.variants:
        form = next(starts(effect.kind, variant, site, [effect.source or ""]), None)
        if variant.name != effect.variant and form is not None:
            form = replace(form, values={**form.values, **shared})
            found += [form] if can_act(runs, form) else []
    return found


def _pruned(runs: SimulatorRuns, best: SimulatorFit) -> list[SimulatorFit]:
    """Leave out one effect at a time: a second one may have come in only because the first had a poor form."""
    if len(best.effects) < 2:
        return []
    rest = [(*best.effects[:place], *best.effects[place + 1 :]) for place in range(len(best.effects))]
    found = [fitted(runs, best.z, effects) for effects in rest]
    return [each for each in found if each is not None]


def _grown(
    runs: SimulatorRuns,
    kinds: Sequence[EffectKind],
    tuned: SimulatorFit,
    best: SimulatorFit,
    progress: Progress,
) -> list[SimulatorFit]:
    """Add one effect after another to the best, while enough is left for it to close."""
    grown: list[SimulatorFit] = []
    while 0 < len(best.effects) < _MOST_EFFECTS and _left(runs, tuned, best) > _LEAST_CLOSING:
        doing = f"looking for {'a second' if len(best.effects) == 1 else 'a third'} effect"
        screening = screen(runs, kinds, best.z, best.effects, progress=partial(progress, doing))
        wider = [
            Screened(effects=(*best.effects, *each.effects), gain=each.gain) for each in screening.singles[:_FURTHER]
        ]
        found = _fits(runs, wider, best, doing, progress)
        grown += found
        leading = _thriftiest(runs, tuned, [best, *found])
        if leading is best:
            break
        best = leading
    return grown

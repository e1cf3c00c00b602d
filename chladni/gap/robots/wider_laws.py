"""Laws that hold a plainer one with a further number: which of both words a log tells."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.calibration import MOST, OPEN, SIGMAS, ZERO
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.term import Term


def adds(solved: Solved, fit: Fit, place: int) -> bool:
    """Whether what a law has beyond the plainer one is told, and is more than a detail that a right law leaves."""
    term = fit.terms[place]
    if term.form is not None and term.adds_form:
        spread = solved.spread.get((term.word, term.site, term.variant), term.form.high - term.form.low)
        return term.form.value > SIGMAS * spread
    value, deviation = _last(fit, place)
    # Of physics nothing is left.
    is_exact = all(one.is_exact for one in term.numbers[:-1])
    return abs(value) > SIGMAS * deviation and (is_exact or _share(solved.contest, fit, place, value) > OPEN)


def not_told_apart(contest: Contest, best: Fit, place: int) -> Iterator[tuple[Fit, float]]:
    """Fit laws that hold a term and whose further number the log neither tells nor excludes, and give their evidence.

    That number stays about as it was believed before, and may make a part of the law's force that matters. As either
    word is one thing at that joint, evidence counts alone, over that of the term, nats.
    """
    term = best.terms[place]
    rest = [*best.terms[:place], *best.terms[place + 1 :]]
    # What few machines have isn't as likely as what most have.
    laws = [_alike(one, term) for one in contest.terms if one.holds(term) and one.rare == term.rare]
    found: dict[str, tuple[Contest, Fit]] = {}
    for wider in {(one.word, one.variant, str(one.form_value)): one for one in laws}.values():
        small = contest if wider in contest.terms else contest.narrowed(rest).joined(wider)
        fit = small.fit([*rest, wider], best)
        if wider.word not in found or fit.nats > found[wider.word][1].nats:
            found[wider.word] = small, fit
    for small, fit in found.values():
        value, deviation = _last(fit, -1)
        is_open = MOST * fit.terms[-1].numbers[-1].scale < deviation and abs(value) < SIGMAS * deviation
        if is_open and _share(small, fit, -1, abs(value) + SIGMAS * deviation) > OPEN:
            yield fit, fit.nats - contest.prior.nats(fit.terms) - best.nats + contest.prior.nats(best.terms)


def _alike(wider: Term, term: Term) -> Term:
    """Give a law with the form that a plainer one was found with, where it has that form, too."""
    form, own = wider.form, term.form
    has_it = form is not None and own is not None and (wider.variant, form.name) == (term.variant, own.name)
    return form.at(own.value) if form is not None and own is not None and has_it else wider


def _last(fit: Fit, place: int) -> tuple[float, float]:
    """Value and standard deviation of a term's last number, beside the nominal one."""
    values, deviations = fit.values(place % len(fit.terms))
    return float(values[-1] - fit.terms[place].nominal[-1]), float(deviations[-1])


def _share(contest: Contest, fit: Fit, place: int, value: float) -> float:
    """Share of a law's force, as RMS, that its last number makes with a value."""
    term = fit.terms[place]
    whole, _ = fit.values(place % len(fit.terms))
    alone = np.zeros_like(whole)
    alone[-1] = value
    return float(np.sqrt(contest.power(term, alone) / max(contest.power(term, whole), ZERO)))

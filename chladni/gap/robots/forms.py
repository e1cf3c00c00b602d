"""Numbers that laws aren't linear in, searched between those of their grids."""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize_scalar

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.search import alternatives, merged
from chladni.gap.robots.term import Form, Term
from chladni.gap.robots.torques import FormKey

#: Of a form's interval: how well it's searched, and how far on either side its curvature is looked at.
_WELL, _ASIDE = 0.03, 0.1
_FITS, _RIVALS = 8, 2

Forms = Mapping[FormKey, float]


def refined(contest: Contest, best: Fit, before: Forms) -> tuple[Forms, Forms]:
    """Give the most probable number of each law's form and of its rivals', and their standard deviations.

    Parameters
    ----------
    before
        Numbers that were found already: rivals keep theirs.
    """
    forms = dict(before)
    spread: dict[FormKey, float] = {}
    small = contest.narrowed(best.terms)
    for place, term in enumerate(best.terms):
        # Off its grid a rival may be better than what is best on it: in place of all at its site, or of this one.
        for rival in [*merged(contest, best, [place]), *alternatives(contest, best, place, _RIVALS)[1:]]:
            one = rival.terms[-1]
            if one.form is not None and _key(one) not in forms:
                beside = {_key(each) for each in rival.terms[:-1]}
                rest = small.narrowed([each for each in small.terms if _key(each) in beside])
                found, spread[_key(one)] = _found(rest, best, one.form)
                forms[_key(one)] = found.form_value
        if term.form is not None:
            rest = small.narrowed([each for each in small.terms if _key(each) != _key(term)])
            found, spread[_key(term)] = _found(rest, best, term.form)
            forms[_key(term)] = found.form_value
            small = rest.joined(found)
    return forms, spread


def _key(term: Term) -> FormKey:
    return term.word, term.site, term.variant


def _found(rest: Contest, best: Fit, form: Form) -> tuple[Term, float]:
    """Give the term with its best form, and the form's standard deviation, at most that of its interval."""

    def lost(value: float) -> float:
        term = form.at(value)
        return -rest.joined(term).fit([*rest.terms, term], best).nats

    low, high = form.low, form.high
    found = float(
        minimize_scalar(
            lost, bounds=(low, high), method="bounded", options={"xatol": _WELL * (high - low), "maxiter": _FITS}
        ).x
    )
    step = _ASIDE * (high - low)
    middle = float(np.clip(found, low + step, high - step))
    curvature = (lost(middle - step) - 2.0 * lost(middle) + lost(middle + step)) / step**2
    uniform = (high - low) / np.sqrt(12.0)
    return form.at(found), float(min(1.0 / np.sqrt(curvature), uniform) if curvature > 0 else uniform)

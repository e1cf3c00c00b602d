"""Numbers that laws aren't linear in, searched between those of their grids."""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize_scalar

from chladni.gap.robots.contest import Contest, Fit
from chladni.gap.robots.search import alternatives
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
        rivals = [one.terms[-1] for one in alternatives(contest, best, place, _RIVALS)[1:]]
        rest = small.narrowed([one for one in small.terms if _key(one) != _key(term)])
        # Off its grid a rival may be better than what is best on it.
        for rival in [*(one for one in rivals if _key(one) not in before), term]:
            if rival.form is not None:
                found, spread[_key(rival)] = _found(rest, best, rival.form)
                forms[_key(rival)] = found.form_value
                small = rest.joined(found) if rival is term else small
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

"""The search for what a robot's description lacks: terms are added, exchanged and dropped while that pays."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import partial
from itertools import islice, takewhile

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.term import FOUND, Term

#: Nats that a term would bring at about, and the term.
Promise = tuple[float, Term]
#: Terms that are fitted in full of those that promise most.
_FITTED = 8
#: The same in place of another.
_EXCHANGED = 3
#: Nats by which what is exchanged may promise less: details and prices aren't in a promise.
_BEHIND = 20.0
#: Nats that a move has to bring.
_WORTH = 1.0
_MOST = 60


def searched(
    contest: Contest, begin: Fit | None = None, *, progress: Callable[[float], None] = lambda _: None
) -> Fit:
    """Give the most probable set that moves lead to, from nothing or from another set."""
    best = contest.nothing if begin is None else _tidied(contest, begin)
    for move in range(_MOST):
        more = _best([best, *_more(contest, best)])
        # Far from what is new little changes; before the search ends, all is tried.
        better = _tidied(contest, more, _changed(contest, best, more))
        if better.nats < best.nats + _WORTH:
            better = _tidied(contest, better)
        if better.nats < best.nats + _WORTH and begin is None:
            better = made_alike(contest, better)
        if better.nats < best.nats + _WORTH:
            break
        best = better
        progress(min(0.05 * move, 1.0))
    return best


def _more(contest: Contest, best: Fit) -> list[Fit]:
    """Fit the set with one more of the terms that promise most; or with a word at a whole group of joints."""
    taken = {term.key for term in best.terms}
    promised = _free(taken, contest.promise(best))
    found = [contest.fit([*best.terms, term], best) for _, term in islice(_each(promised), _FITTED)]
    families = [one for group in contest.groups for one in _families(group, promised)]
    found += [contest.fit([*best.terms, *one], best) for _, one in sorted(families, key=_promises)[:_FITTED]]
    if _best(found).nats > best.nats + _WORTH:
        return found
    # Where a description has too much of one thing and too little of another, either alone makes it worse.
    return found + [two for one in found[:_EXCHANGED] for two in _beside(contest, one)]


def _beside(contest: Contest, one: Fit) -> list[Fit]:
    """Fit a second term at the place of the last one."""
    last = one.terms[-1]
    taken = {other.key for other in one.terms}
    near = (
        term for _, term in _each(contest.promise(one)) if term.key not in taken and set(term.rows) & set(last.rows)
    )
    return [contest.fit([*one.terms, term], one) for term in islice(near, _EXCHANGED)]


def _each(promised: Iterable[Promise]) -> Iterator[Promise]:
    """Give of each law the form of its grid that promises most, and what it promises; and the one that was found.

    A promise knows no bounds, which the form that was found may keep better.
    """
    seen = set[tuple[tuple[str, str], str | None, bool]]()
    for nats, term in promised:
        kind = term.key, term.variant, term.form is not None and term.form.place == FOUND
        if kind not in seen:
            seen.add(kind)
            yield nats, term


def _families(sites: Collection[str], promised: Iterable[Promise]) -> list[tuple[float, list[Term]]]:
    """Give the words at several of some joints, all that lack them, and what they promise together."""
    found: dict[tuple[str, str | None, int], list[Promise]] = {}
    for nats, term in _at(sites, promised):
        found.setdefault(term.kind, []).append((nats, term))
    return [(sum(nats for nats, _ in one), [term for _, term in one]) for one in found.values() if len(one) > 1]


def _promises(family: tuple[float, list[Term]]) -> float:
    """Most first."""
    return -family[0]


def made_alike(contest: Contest, best: Fit) -> Fit:
    """Fit at all of a group of like joints, in place of what stands there, the words of one of them.

    Two words that stand for one are exchanged for it one by one only over what is worse. What such an exchange leaves
    to others shows when these are tidied.
    """
    found = [one for group in contest.prior.like for one in _copied(contest, best, group)]
    likely = max(found, key=lambda one: one.nats, default=best)
    return (
        best
        if likely.nats < best.nats - _BEHIND
        else _best([best, _tidied(contest, likely, _changed(contest, best, likely))])
    )


def _copied(contest: Contest, best: Fit, group: Collection[str]) -> Iterator[Fit]:
    rest = contest.fit([term for term in best.terms if term.site not in group], best)
    promised = contest.promise(rest)
    # Of each law the form that promises most.
    here = {site: {_law(one): one for _, one in reversed(_at({site}, promised))} for site in sorted(group)}
    stand = {site: frozenset(_law(one) for one in best.terms if one.site == site) for site in here}
    for laws in dict.fromkeys(stand.values()):
        if any(own != laws for own in stand.values()) and all(laws <= one.keys() for one in here.values()):
            terms = [one[each] for one in here.values() for each in sorted(laws, key=str)]
            yield contest.fit([*rest.terms, *terms], best)


def _law(term: Term) -> tuple[str, str | None]:
    return term.word, term.variant


def _changed(contest: Contest, one: Fit, other: Fit) -> frozenset[int]:
    """Give the rows at which terms act that one of two sets has alone."""
    kept = {id(term) for term in one.terms} & {id(term) for term in other.terms}
    return frozenset[int]().union(
        *(contest.rows(term) for term in (*one.terms, *other.terms) if id(term) not in kept)
    )


def _tidied(contest: Contest, best: Fit, rows: frozenset[int] | None = None) -> Fit:
    """Drop terms, and exchange each for another where it acts, while that helps.

    Parameters
    ----------
    rows
        Where terms act that are tried; all when None.
    """
    while True:
        tried = [place for place, term in enumerate(best.terms) if rows is None or rows & contest.rows(term)]
        found = [one for place in tried for one in alternatives(contest, best, place, _EXCHANGED, _BEHIND)]
        better = _combined(contest, best, [*found, *merged(contest, best, tried), *_exchanged(contest, best, tried)])
        if better is best:
            return best
        # Far from what is new little changes.
        rows, best = _changed(contest, best, better), better


def _combined(contest: Contest, best: Fit, found: Sequence[Fit]) -> Fit:
    """Make the best of some moves, and those beside it that act elsewhere, as far as each makes it better still."""
    helping = sorted((one for one in found if one.nats > best.nats), key=lambda one: -one.nats)
    if not helping:
        return best
    better, taken = helping[0], set(_changed(contest, best, helping[0]))
    for one in helping[1:]:
        rows = _changed(contest, best, one)
        if taken.isdisjoint(rows):
            kept = [term for term in better.terms if term in one.terms or term not in best.terms]
            both = contest.fit([*kept, *(term for term in one.terms if term not in best.terms)], better)
            if both.nats > better.nats:
                better, taken = both, taken | rows
    return better


def _in_place(
    contest: Contest, rest: Fit, best: Fit, count: int, wanted: Callable[[Sequence[Promise]], Iterable[Promise]]
) -> list[Term]:
    """Give what promises most in place of terms of the best set, beside the rest of it.

    Where much is left, all that takes most of it looks alike: so both as the rest is weighed, and as the best set.
    """
    found = {}
    for each in (rest, contest.weighed_as(rest, best.weight)):
        near = islice(_each(wanted(contest.promise(each))), count)
        found.update({id(term): term for _, term in near})
    return list(found.values())


def merged(contest: Contest, best: Fit, tried: Iterable[int]) -> list[Fit]:
    """Fit one term in place of all that stand at a site: two idealisations may be one other law.

    Parameters
    ----------
    tried
        Places of terms, at whose sites that is tried.
    """
    found = []
    sites = {best.terms[place].site for place in tried}
    for site, count in Counter(term.site for term in best.terms).items():
        if count > 1 and site in sites:
            rest = contest.fit([term for term in best.terms if term.site != site], best)
            near = _in_place(contest, rest, best, _EXCHANGED, partial(_at, frozenset({site})))
            found += [contest.fit([*rest.terms, term], rest) for term in near]
    return found


def _exchanged(contest: Contest, best: Fit, tried: Sequence[int]) -> list[Fit]:
    """Fit another word at all joints of a group that have one, as they're made alike; or one term in place of all."""
    found = []
    for group in contest.groups:
        alike = Counter((term.word, term.rare) for term in best.terms if term.site in group)
        kinds = {(term.word, term.rare) for term in (best.terms[place] for place in tried) if term.site in group}
        for kind in (one for one, count in alike.items() if count > 1 and one in kinds):
            own = [term for term in best.terms if term.site in group and (term.word, term.rare) == kind]
            rest = contest.fit([term for term in best.terms if term not in own], best)
            taken = {term.key for term in rest.terms}
            others = _in_place(contest, rest, best, _EXCHANGED, partial(_free, taken))
            free = [one for one in _free(taken, contest.promise(rest)) if one[1].word != kind[0]]
            families = [one for one in _families({term.site for term in own}, free) if len(one[1]) == len(own)]
            found += [rest, *(contest.fit([*rest.terms, term], best) for term in others)]
            found += [
                contest.fit([*rest.terms, *one], best) for _, one in sorted(families, key=_promises)[:_EXCHANGED]
            ]
    return found


def alternatives(contest: Contest, best: Fit, place: int, count: int, behind: float = float("inf")) -> list[Fit]:
    """Fit what could stand in place of a term: nothing, or another term that promises as much.

    Parameters
    ----------
    count
        Terms that are fitted at most.
    behind
        Nats by which they may promise less than the one that stands there.
    """
    rest = [*best.terms[:place], *best.terms[place + 1 :]]
    taken, own = {one.key for one in rest}, best.terms[place]
    without = contest.fit(rest, best)

    def near(promised: Sequence[Promise]) -> Iterator[Promise]:
        least = next(nats for nats, term in promised if term is own) - behind
        likely = takewhile(lambda one: one[0] > least, promised)
        return (one for one in likely if one[1] is not own and one[1].key not in taken)

    others = [contest.fit([*rest, term], best) for term in _in_place(contest, without, best, count, near)]
    # Two forms of a law are one rival.
    of_laws = {(*one.terms[-1].key, one.terms[-1].variant): one for one in sorted(others, key=lambda one: one.nats)}
    return [without, *(one for one in others if one in of_laws.values())]


def _at(sites: Collection[str], promised: Iterable[Promise]) -> list[Promise]:
    return [one for one in promised if one[1].site in sites]


def _free(taken: Collection[tuple[str, str]], promised: Iterable[Promise]) -> list[Promise]:
    return [one for one in promised if one[1].key not in taken]


def _best(fits: Sequence[Fit]) -> Fit:
    return max(fits, key=lambda one: one.nats)

"""Marks one answer against the truth."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chladni_withheld import folders
from chladni_withheld.folders import RESULT_FORMAT, Result, Truth, read_as
from chladni_withheld.vocabulary import FAMILY_OF, OUTSIDE

#: What a case counts as whose diagnosis failed; it's never right.
FAILED = "failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """A cause that was named."""

    effect: str
    site: str
    group: tuple[str, ...]
    probability: float

    def fits(self, effect: str, site: str) -> bool:
        """Whether it's this effect at this site, or at one that the answer says can't be told from it."""
        return self.effect == effect and self.at(site)

    def at(self, site: str) -> bool:
        """Whether its site, or the group of sites that the log can't tell apart, holds this one."""
        return site == self.site or site in self.group


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """One case: what was true, what was answered, and what that is worth.

    Attributes
    ----------
    hidden
        ``(effect, site)`` of what was hidden.
    off
        Parameter beyond its tolerance, or empty.
    causes
        As named, most probable first.
    alternatives
        Words that the answer says can't be told from the first cause.
    naive
        Effect and site that leave the smallest RMS.
    ratio, ratio_tuned
        Effect over noise, before and after tuning; None when nothing was hidden.
    closed
        Share of the gap that was closed, over what the true law closes; None when the answer has none.
    """

    name: str
    kind: str
    coloured: bool
    hidden: tuple[tuple[str, str], ...]
    off: str
    verdict: str
    causes: tuple[Cause, ...]
    naive: tuple[str, str] | None
    ratio: float | None
    ratio_tuned: float | None
    closed: float | None
    alternatives: tuple[str, ...] = ()

    @property
    def first(self) -> Cause | None:
        """First cause of a verdict ``effect``."""
        return self.causes[0] if self.verdict == "effect" and self.causes else None

    @property
    def word_is_right(self) -> bool:
        """Whether the first cause has the word of something hidden."""
        return self.first is not None and self.first.effect in [effect for effect, _ in self.hidden]

    @property
    def family_is_right(self) -> bool:
        """Whether the first cause is of the family of something hidden."""
        families = [FAMILY_OF.get(effect, OUTSIDE.get(effect, "")) for effect, _ in self.hidden]
        return self.first is not None and FAMILY_OF.get(self.first.effect, "?") in families

    @property
    def site_is_right(self) -> bool:
        """Whether the first cause's site, or its group, holds the site of something hidden."""
        return self.first is not None and any(self.first.at(site) for _, site in self.hidden)

    @property
    def is_right(self) -> bool:
        """Whether the first cause is something that was hidden, where it was hidden."""
        return self.first is not None and any(self.first.fits(*one) for one in self.hidden)

    @property
    def is_among_the_alike(self) -> bool:
        """Whether the right word is the first cause's, or one that the answer says the log can't tell from it."""
        words = [effect for effect, _ in self.hidden]
        return self.first is not None and (self.word_is_right or any(one in words for one in self.alternatives))

    def found(self) -> int:
        """How many of the hidden effects were named, at their sites."""
        named = self.causes if self.verdict == "effect" else ()
        return sum(any(cause.fits(*one) for cause in named) for one in self.hidden)

    @property
    def naive_is_right(self) -> bool:
        """Whether the smallest RMS alone names the right effect."""
        return self.naive is not None and self.naive[0] in [effect for effect, _ in self.hidden]


def mark(name: str, truth: Mapping[str, Any], result: Mapping[str, Any], *, path: Path | None = None) -> Mark:
    """Hold an answer against the truth.

    Parameters
    ----------
    result
        ``chladni.gap/1``; anything else is a failed diagnosis.
    path
        The file of the result, which a refusal names; the case where there is none.

    Raises
    ------
    SetupError
        When truth or answer break their format, with the key.
    """
    hidden = read_as(Truth, truth, name, "seal a whole truth")
    answer = None
    if result.get("format") == RESULT_FORMAT:
        answer = read_as(Result, result, str(path or name), "remove this result, and run the case again")
    return _marked(name, hidden, answer)


def _marked(name: str, truth: Truth, result: Result | None) -> Mark:
    answer = result or Result(verdict="unknown")
    named = answer.causes or ()
    closed = answer.gap.closed if answer.gap else None
    return Mark(
        name=name,
        kind=truth.kind,
        coloured=truth.coloured,
        hidden=tuple((one.effect, one.site) for one in truth.effects),
        off=next(iter(truth.off or {}), ""),
        verdict=answer.verdict if result else FAILED,
        causes=tuple(_cause(one) for one in named if one.effect != "parameter"),
        naive=_naive(answer),
        ratio=truth.ratio,
        ratio_tuned=truth.ratio_tuned,
        closed=None if closed is None else closed / (truth.ideal or 1.0),
        alternatives=tuple(one.effect for one in (named[0].alternatives or () if named else ())),
    )


def _cause(one: folders.Cause) -> Cause:
    return Cause(effect=one.effect, site=one.site, group=tuple(one.group or ()), probability=one.probability or 0.0)


def _naive(result: Result) -> tuple[str, str] | None:
    """Largest drop in RMS: said by the result, or the smallest gap of its ranking."""
    if result.naive is not None:
        return result.naive.effect, result.naive.site
    ranked = [(one.gap, place) for place, one in enumerate(result.ranking or ()) if one.gap is not None]
    if not ranked or result.ranking is None:
        return None
    least = result.ranking[min(ranked)[1]]
    return least.effect, least.site

"""Marks one answer against the truth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from chladni.gap.blind.vocabulary import FAMILY_OF, OUTSIDE
from chladni.signals.errors import SetupError

RESULT_FORMAT = "chladni.gap/1"
VERDICTS = ("none", "parameters", "effect", "unknown")
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


def mark(name: str, truth: Mapping[str, Any], result: Mapping[str, Any]) -> Mark:
    """Hold an answer against the truth.

    Parameters
    ----------
    result
        ``chladni.gap/1``; anything else is a failed diagnosis.

    Raises
    ------
    SetupError
        When the answer breaks its format.
    """
    sound = result.get("format") == RESULT_FORMAT
    verdict = str(result.get("verdict")) if sound else FAILED
    if sound and verdict not in VERDICTS:
        raise SetupError(f"{name}: verdict {verdict!r:.40} is none of {', '.join(VERDICTS)}")
    gap = result.get("gap") or {}
    closed, ideal = gap.get("closed"), truth.get("ideal") or 1.0
    try:
        causes = tuple(_cause(one) for one in result.get("causes") or () if one.get("effect") != "parameter")
        naive, alternatives = _naive(result), _alternatives(result)
    except (KeyError, TypeError, AttributeError) as error:
        raise SetupError(f"{name}: causes or ranking of its result break the format: {error}") from error
    return Mark(
        name=name,
        kind=str(truth["kind"]),
        coloured=bool(truth.get("coloured", False)),
        hidden=tuple((str(one["effect"]), str(one["site"])) for one in truth["effects"]),
        off=next(iter(truth.get("off") or {}), ""),
        verdict=verdict,
        causes=causes,
        naive=naive,
        ratio=truth.get("ratio"),
        ratio_tuned=truth.get("ratio_tuned"),
        closed=None if closed is None else float(closed) / float(ideal),
        alternatives=alternatives,
    )


def _cause(one: Mapping[str, Any]) -> Cause:
    group: Sequence[str] = one.get("group") or ()
    return Cause(effect=str(one["effect"]), site=str(one["site"]), group=tuple(str(site) for site in group),
                 probability=float(one.get("probability") or 0.0))  # fmt: skip


def _alternatives(result: Mapping[str, Any]) -> tuple[str, ...]:
    named = list(result.get("causes") or ())
    return tuple(str(one["effect"]) for one in (named[0].get("alternatives") or () if named else ()))


def _naive(result: Mapping[str, Any]) -> tuple[str, str] | None:
    """Largest drop in RMS: said by the result, or the smallest gap of its ranking."""
    told = result.get("naive")
    if told:
        return str(told["effect"]), str(told["site"])
    ranked = [one for one in result.get("ranking") or () if one.get("gap") is not None]
    if not ranked:
        return None
    least = min(ranked, key=lambda one: float(one["gap"]))
    return str(least["effect"]), str(least["site"])

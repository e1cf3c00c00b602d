"""Marks one answer against the truth."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

from chladni_withheld import folders
from chladni_withheld.case import PARAMETER, QUIET, Kind
from chladni_withheld.folders import RESULT_FORMAT, Result, Truth, read_as
from chladni_withheld.vocabulary import FAMILY_OF, OUTSIDE

#: What a case counts as whose diagnosis failed; it's never right.
FAILED = "failed"
#: Effects that move the outputs by at least so many times the noise must be found.
CLEAR_RATIO = 3.0
#: Cases that no word of the run's catalogue is right for, and cases whose model is wrong in itself.
STRANGE: tuple[Kind, ...] = ("leave_out", "outside")
MODEL_WRONG: tuple[Kind, ...] = ("topology", "value", "value_and_effect")
ROBOTS_OWN: tuple[Kind, ...] = ("all_joints", "ordinary", "gains", "afloat")
_NAMEABLE: tuple[Kind, ...] = ("effect", "parameters", "two", "three", *MODEL_WRONG, *ROBOTS_OWN)
#: The number of a robot's cause that is held against the truth, and whether as a share of it.
_VALUES: Mapping[str, tuple[str, bool]] = {
    "delay": ("delay", False), "payload": ("mass", True), "coulomb_friction": ("force", True),
}  # fmt: skip


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
    """One case: what was true, what was answered, and what that is worth. Sites that are pairs are in order.

    Attributes
    ----------
    hidden
        ``(effect, site)`` of what was hidden, wrong values among it.
    off
        Further parameters beyond their tolerance.
    causes
        As named, most probable first.
    alternatives
        Words that the answer says can't be told from the first cause.
    naive
        Effect that leaves the smallest RMS.
    ratio, ratio_tuned
        Effect over noise, before and after tuning; None when nothing was hidden.
    closed
        Share of the gap that was closed, over what the true law closes; None when the answer has none.
    faint_too
        Of what is hidden in all joints, what is too faint to be asked for.
    values
        How far a cause's own number is off, by what was hidden: seconds of a delay, shares of others; infinite where
        it wasn't named.
    gains
        How far each unknown gain of a servo is off, as a share.
    told
        Whether an answer ``unknown`` says where, and of a push when.
    remarked
        Wrong masses whose link a remark names, with the sense in which it's wrong.
    """

    name: str
    kind: Kind
    coloured: bool
    hidden: tuple[tuple[str, str], ...]
    off: tuple[str, ...]
    verdict: str
    causes: tuple[Cause, ...]
    naive: str | None
    ratio: float | None
    ratio_tuned: float | None
    closed: float | None
    alternatives: tuple[str, ...] = ()
    faint_too: tuple[tuple[str, str], ...] = ()
    values: Mapping[tuple[str, str], float] = field(default_factory=dict)
    gains: tuple[float, ...] = ()
    told: bool = False
    remarked: tuple[tuple[str, str], ...] = ()

    @property
    def named(self) -> tuple[Cause, ...]:
        """Causes of a verdict that names any."""
        return self.causes if self.verdict in ("effect", "parameters") else ()

    @property
    def first(self) -> Cause | None:
        """First effect of a verdict ``effect``, beside whatever wrong values."""
        effects = (one for one in self.causes if one.effect != PARAMETER)
        return next(effects, None) if self.verdict == "effect" else None

    @property
    def word_is_right(self) -> bool:
        """Whether the first effect has the word of something hidden."""
        return self.first is not None and self.first.effect in [effect for effect, _ in self.hidden]

    @property
    def family_is_right(self) -> bool:
        """Whether the first effect is of the family of something hidden."""
        return self.first is not None and self._is_sibling(self.first)

    @property
    def site_is_right(self) -> bool:
        """Whether the first effect's site, or its group, holds the site of something hidden."""
        return self.first is not None and any(self.first.at(site) for _, site in self.hidden)

    @property
    def is_right(self) -> bool:
        """Whether the first effect is something that was hidden, where it was hidden."""
        return self.first is not None and any(self.first.fits(*one) for one in self.hidden)

    @property
    def is_among_the_alike(self) -> bool:
        """Whether the right word is the first effect's, or one that the answer says the log can't tell from it."""
        words = [effect for effect, _ in self.hidden]
        return self.first is not None and (self.word_is_right or any(one in words for one in self.alternatives))

    @property
    def naive_is_right(self) -> bool:
        """Whether the smallest RMS alone names the right effect."""
        return self.naive in [effect for effect, _ in self.hidden]

    @property
    def recognised(self) -> bool:
        """Whether a case outside the words was answered ``unknown``, or with what is like that which was hidden."""
        return self.verdict == "unknown" or self.family_is_right or self.is_right

    @property
    def is_clear(self) -> bool:
        """Whether what is hidden stands so far out of the noise that it must be found."""
        return self.ratio is None or self.ratio >= CLEAR_RATIO

    @property
    def is_nameable(self) -> bool:
        """Whether something clear is hidden that words of the catalogue, or parameters, name."""
        return self.kind in _NAMEABLE and self.is_clear

    def found(self, *, least: float = 0.0) -> int:
        """How many of the hidden effects and values were named at their sites, with a probability of `least`."""
        return sum(
            any(cause.fits(*one) and cause.probability >= least for cause in self.named) for one in self._asked
        )

    def all_found(self, *, least: float = 0.0) -> bool:
        """Whether all that is hidden was named, at its sites."""
        return self.found(least=least) == len(self._asked)

    def all_told(self) -> bool:
        """Whether each thing that is hidden was named, or a remark tells it."""
        return all(one in self.remarked or any(cause.fits(*one) for cause in self.named) for one in self._asked)

    def wrongly_named(self, least: float) -> bool:
        """Whether anything was named, with a probability of `least` or more, that isn't true."""
        return any(one.probability >= least and not self._is_true(one) for one in self.named)

    @property
    def whole_is_right(self) -> bool:
        """Whether the answer is what its kind of case asks for."""
        if self.kind in STRANGE:
            return self.recognised
        if self.kind in QUIET:
            return self.verdict == ("parameters" if self.kind == "parameters" else "none")
        return self.is_right if self.kind in ("effect", "faint") else self.all_found()

    @property
    def _true_causes(self) -> tuple[tuple[str, str], ...]:
        return (*self.hidden, *((PARAMETER, name) for name in self.off if (PARAMETER, name) not in self.hidden))

    @property
    def _asked(self) -> tuple[tuple[str, str], ...]:
        return tuple(one for one in self._true_causes if one not in self.faint_too)

    def _is_true(self, cause: Cause) -> bool:
        if self.kind in STRANGE and self._is_sibling(cause):
            return True
        return any(cause.fits(*one) for one in self._true_causes)

    def _is_sibling(self, cause: Cause) -> bool:
        families = [FAMILY_OF.get(effect, OUTSIDE.get(effect, "")) for effect, _ in self.hidden]
        return FAMILY_OF.get(cause.effect, "?") in families


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
    hidden = {(one.effect, _ordered(one.site)): one for one in truth.effects}
    named = [(_cause(one, hidden), one) for one in answer.causes or () if not _is_a_doubtful_gain(one, truth)]
    closed = answer.gap.closed if answer.gap else None
    first = next((one for cause, one in named if cause.effect != PARAMETER), None)
    clear = (one.severity_tuned is None or one.severity_tuned >= CLEAR_RATIO for one in hidden.values())
    return Mark(
        name=name,
        kind=truth.kind,
        coloured=truth.coloured,
        hidden=tuple(hidden),
        off=tuple(truth.off or ()),
        verdict=answer.verdict if result else FAILED,
        causes=tuple(cause for cause, _ in named),
        naive=_naive(answer),
        ratio=truth.ratio,
        ratio_tuned=truth.ratio_tuned,
        closed=None if closed is None else closed / (truth.ideal or 1.0),
        alternatives=tuple(one.effect for one in (first.alternatives or () if first else ())),
        faint_too=tuple(
            key for key, seen in zip(hidden, clear, strict=True) if not seen and truth.kind == "all_joints"
        ),
        values={key: _off(one, named) for key, one in hidden.items() if one.effect in _VALUES},
        gains=tuple(
            abs(_gain(answer, joint, key) / value - 1.0)
            for joint, both in (truth.gains or {}).items()
            for key, value in both.items()
        ),
        told=answer.verdict == "unknown" and any(_tells(answer, one) for one in truth.effects),
        remarked=tuple(key for key, one in hidden.items() if _is_remarked(one, answer.remarks or ())),
    )


def _cause(one: folders.Cause, hidden: Mapping[tuple[str, str], folders.Hidden]) -> Cause:
    """The cause, under the name of what was hidden where that says the same."""
    sites = tuple(_ordered(site) for site in (one.site, *(one.group or ())))
    for (effect, site), truth in hidden.items():
        if any(other.effect == one.effect and _ordered(other.site) in sites for other in truth.also or ()):
            return Cause(effect=effect, site=site, group=(), probability=one.probability or 0.0)
    return Cause(effect=one.effect, site=sites[0], group=sites[1:], probability=one.probability or 0.0)


def _is_a_doubtful_gain(one: folders.Cause, truth: Truth) -> bool:
    """Whether it's a servo's gain that the robot file doubts: true, and not the cause that is asked for."""
    return one.effect == "controller_gain" and one.site in (truth.gains or {})


def _off(hidden: folders.Hidden, named: Sequence[tuple[Cause, folders.Cause]]) -> float:
    """How far the number of what was hidden is off."""
    key, as_share = _VALUES[hidden.effect]
    true = (hidden.parameters or {}).get(key)
    said = next((one for cause, one in named if cause.fits(hidden.effect, _ordered(hidden.site))), None)
    found = _number((said.parameters or {}).get(key)) if said else None
    if found is None or not true:
        return inf
    return abs(found - float(true)) / (abs(float(true)) if as_share else 1.0)


def _number(told: object) -> float | None:
    """A number of an answer, bare or with its sigma and unit."""
    value = told.get("value") if isinstance(told, Mapping) else told
    return float(value) if isinstance(value, int | float) else None


def _gain(answer: Result, joint: str, key: str) -> float:
    """What an answer says a servo's gain is over the one believed: a cause, a tuned number, or as believed."""
    for one in answer.causes or ():
        if one.effect == "controller_gain" and one.site == joint:
            return _number((one.parameters or {}).get(key)) or 1.0
    tuned = (answer.tuned_parameters or {}).get(f"{joint}.{key}")
    value, nominal = _number(tuned), _number(tuned.get("nominal")) if isinstance(tuned, Mapping) else None
    return value / nominal if value and nominal else 1.0


def _tells(answer: Result, hidden: folders.Hidden) -> bool:
    """Whether an answer names the place of what no word says: a force that it tells of, or the largest share."""
    sites = {site for one in (hidden, *(hidden.also or ())) for site in one.site.split("~")}
    where = answer.where or {}
    shares = [one for one in where.get("sites") or () if isinstance(one, Mapping)]
    largest = max(shares, key=lambda one: _number(one.get("share")) or 0.0, default={})
    forces = [one for one in answer.causes or () if one.effect == "external_force"]
    placed = largest.get("name") in sites or any(sites & {one.site, *(one.group or ())} for one in forces)
    if hidden.effect != "push":
        return placed
    spans = [
        (_number((one.parameters or {}).get("start")), _number((one.parameters or {}).get("end"))) for one in forces
    ]
    spans += [(_number(one.get("low")), _number(one.get("high"))) for one in where.get("regimes") or ()
              if isinstance(one, Mapping) and one.get("variable") == "time"]  # fmt: skip
    spans += [
        (_number(one.get("start_s")), _number(one.get("end_s")))
        for one in where.get("times") or ()
        if isinstance(one, Mapping)
    ]
    middle = 0.5 * sum(float((hidden.parameters or {}).get(key, inf)) for key in ("start", "end"))
    return placed and any(low is not None and high is not None and low <= middle <= high for low, high in spans)


def _is_remarked(hidden: folders.Hidden, remarks: Sequence[str]) -> bool:
    """Whether a remark says of a link's mass what is wrong with it: at which link, or what moves with it; and how."""
    link, _, what = hidden.site.rpartition(".")
    numbers = hidden.parameters or {}
    true, nominal = (_number(numbers.get(key)) for key in ("true", "nominal"))
    if hidden.effect != PARAMETER or what != "mass" or true is None or nominal is None:
        return False
    way = "more" if true > nominal else "less"
    says = re.compile(rf"the log asks for .* kg {way} at (.*[ ,])?{re.escape(link)}([ ,].*)?")
    return any(says.fullmatch(one) for one in remarks)


def _ordered(site: str) -> str:
    """A pair in one order: ``b~a`` is ``a~b``."""
    return "~".join(sorted(site.split("~")))


def _naive(result: Result) -> str | None:
    """Largest drop in RMS: said by the result, or the smallest gap of its ranking."""
    if result.naive is not None:
        return result.naive.effect
    ranked = [one for one in result.ranking or () if one.gap is not None]
    return min(ranked, key=lambda one: one.gap or 0.0).effect if ranked else None

"""What is believed of sets of terms before a log is seen: how many words, where, and how alike their numbers are."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, log

import numpy as np

from chladni.gap.calibration import ALIKE, ANOTHER, QUARTER
from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.robots.term import Term
from chladni.robots.robot import Robot, RobotJoint
from chladni.signals.arrays import Real

#: Correlation of a law's numbers at like joints: each differs from what they share by a quarter of that's scale.
_SHARED = 1.0 / (1.0 + QUARTER**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPrior:
    """Prices of words at sites, and the joint normal distribution of their numbers.

    Joints that are made alike differ by chance about what they share, so that their numbers are exchangeable: a
    hierarchical prior (Gelman et al., Bayesian Data Analysis, 3rd edition, section 5.2).

    Attributes
    ----------
    words
        At how many sites each could be, by word and whether it's rare.
    every
        How many words at sites there are.
    like
        Names of joints that are made alike.
    """

    words: Counter[tuple[str, bool]]
    every: int
    like: tuple[frozenset[str], ...]

    @classmethod
    def among(cls, terms: Sequence[Term], robot: Robot) -> "SetPrior":
        """Give the prior of sets of some terms."""
        kinds = {(term.key, term.rare): term for term in terms}
        words = Counter((term.word, term.rare) for term in kinds.values())
        return cls(words=words, every=max(len(kinds), 1), like=like_joints(robot))

    def nats(self, terms: Sequence[Term]) -> float:
        """Nats of a set: each a cause of its own, or a word at several sites, as far as that is less."""
        nats, every = 0.0, log(self.every)
        sites: dict[tuple[str, bool], list[str]] = {}
        for term in terms:
            sites.setdefault((term.word, term.rare), []).append(term.site)
        for word, chosen in sites.items():
            alone = (log(ANOTHER) - every) * (len(chosen) - 1)
            shared = log(ANOTHER) - self._which(word, chosen) if len(chosen) > 1 else -np.inf
            nats += log(ANOTHER) - every + max(alone, shared)
        # What machines rarely have is one thing more than what most have; two joints that are coupled are one thing.
        nats += log(ANOTHER) * sum(term.rare and not term.is_coupling for term in terms)
        nats += log(ANOTHER) * len({term.site for term in terms if term.rare and term.is_coupling})
        # A form that was chosen among several was one of them by chance.
        forms = [term.form for term in terms if term.form is not None]
        nats -= sum(log(one.count) + 0.5 * (one.value / one.usual) ** 2 for one in forms)
        # Tolerances allow for what values are usually wrong by: more is one thing more.
        nats += log(ANOTHER) * sum(term.word == PARAMETER for term in terms)
        # A law that holds a simpler one, with another number, is one thing more.
        return nats + log(ANOTHER) * sum(len(term.scale) - 1 for term in terms if term.rows)

    def _which(self, word: tuple[str, bool], sites: Sequence[str]) -> float:
        """Nats that it takes to say at which sites a word is; or at which of the groups of like joints."""
        # Terms of another contest may be at sites that are left out here.
        each, chosen = log(comb(max(self.words[word], len(sites)), len(sites))), frozenset(sites)
        there = [one for one in self.like if one <= chosen]
        if len(chosen) < len(sites) or chosen != frozenset[str]().union(*there):
            return each
        return min(each, log(comb(len(self.like), len(there))))

    def information(self, terms: Sequence[Term], within: int) -> tuple[Real, float]:
        """Give the information of numbers over their scales, ``[number, number]``, and its determinant's logarithm.

        Parameters
        ----------
        within
            How many numbers of tolerances stand before those of the terms.
        """
        found, nats = np.eye(within + sum(len(term.numbers) for term in terms)), 0.0
        group = {site: place for place, sites in enumerate(self.like) for site in sites}
        place, alike = within, dict[tuple[int, str, str | None, int], list[int]]()
        for term in terms:
            count = len(term.numbers)
            if term.site in group:
                alike.setdefault((group[term.site], term.word, term.variant, count), []).append(place)
            place += count
        for (*_, count), first in alike.items():
            more = len(first) - 1
            if more:
                # Of ones on the diagonal and the correlation beside it: Sherman and Morrison's formula.
                own = (np.eye(1 + more) - _SHARED / (1.0 + more * _SHARED)) / (1.0 - _SHARED)
                for number in range(count):
                    at = np.array(first) + number
                    found[at[:, None], at] = own
                nats -= count * (more * log(1.0 - _SHARED) + log(1.0 + more * _SHARED))
        return found, nats


def like_joints(robot: Robot) -> tuple[frozenset[str], ...]:
    """Give joints that are made alike, as those of legs: as far from the base, that move as many links, as heavy.

    Those with no like are left out.
    """
    groups: list[list[RobotJoint]] = []
    for joint in robot.joints:
        group = next((one for one in groups if _are_alike(robot, one[0], joint)), None)
        if group is None:
            groups.append([joint])
        else:
            group.append(joint)
    return tuple(frozenset(joint.name for joint in one) for one in groups if len(one) > 1)


def _are_alike(robot: Robot, one: RobotJoint, other: RobotJoint) -> bool:
    (place, mass), (own_place, own_mass) = _hangs(robot, one), _hangs(robot, other)
    return one.kind == other.kind and place == own_place and max(mass, own_mass) <= ALIKE * min(mass, own_mass)


def _hangs(robot: Robot, joint: RobotJoint) -> tuple[tuple[int, int], float]:
    """Joints before one, and links behind it; and the mass of these."""
    behind = robot.hanging(joint)
    before = sum(joint.link in robot.hanging(one) for one in robot.joints)
    return (before, len(behind)), float(sum(robot.model.body_mass[1 + robot.links.index(link)] for link in behind))

"""What a hypothesis must bring to be named, in nats."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.gap.diagnosis.pairs import two_act
from chladni.gap.diagnosis.search import ALONE
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.location.locate import Location
from chladni.gap.records.diagnosis import Candidate

#: Nats that a wrong parameter must bring to be named, and an effect: what is modelled is doubted before something is
#: added.
WRONG, NAMED = 3.0, 6.0
#: Nats that a second effect must bring beside the first: a law that differs from the machine's leaves what another
#: effect could mend a little. Where no force at one place could, or the first has no law that could differ, it
#: needn't bring more than a first one.
_ADDED, _ADDED_FOR_SURE = 100.0, 12.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Price:
    """What hypotheses pay.

    Attributes
    ----------
    further
        Nats of a second effect beside a first one.
    sure
        A first one beside which another certainly acts, None when nothing tells.
    """

    further: float
    sure: Candidate | None

    def paid(self, one: Contestant) -> float:
        """Evidence in nats less what a cause, and every further effect, must bring to be named."""
        effects = len(one.hypothesis.effects)
        first = NAMED if effects else WRONG * bool(one.hypothesis.wide)
        further = min(_ADDED_FOR_SURE, self.further) if self.sure in one.hypothesis.named else self.further
        beside = max(effects - 1, 0)
        return one.log_evidence - first - further * min(beside, 1) - _ADDED * max(beside - 1, 0)


def added_nats(location: Location) -> float:
    """Nats that a second effect must bring beside a first one that has details."""
    return _ADDED_FOR_SURE if two_act(location) else _ADDED


def price_among(contestants: Sequence[Contestant], further: float) -> Price:
    """Give what contestants pay that were weighed together; see `Price`."""
    singles = [one for one in contestants if len(one.hypothesis.effects) == 1]
    lead = max(singles, key=lambda one: one.log_evidence, default=None)
    return Price(
        further=further, sure=lead.hypothesis.named[0] if lead is not None and leaves_for_sure(lead) else None
    )


def leaves_for_sure(one: Contestant) -> bool:
    """Whether something acts beside a single effect for certain: it leaves more than noise, and has no details.

    It's a number of a sensor's and no law: what it leaves, something else causes.
    """
    effects = one.hypothesis.effects
    if len(effects) != 1 or one.most_left <= ALONE:
        return False
    return effects[0].kind.clues.exact and effects[0].kind.family == "sensor"

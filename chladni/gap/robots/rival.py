"""Two answers of other words on one log of a robot: which is likelier, and how far the other one is behind."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import DETAILS
from chladni.gap.robots.answer import Answer


@dataclass(frozen=True, slots=True, kw_only=True)
class Rival:
    """An answer that could stand in another one's place, and the nats by which it's behind."""

    answer: Answer
    behind: float


def likelier(one: Answer, other: Answer) -> tuple[Answer, Rival | None]:
    """Give the likelier answer of two first, and the other where it could stand in its place, for it's confirmed.

    Both are weighed by their torques at the second one's noise, and by the error that their simulations leave, as
    details of the named laws.
    """
    of_one, of_other = one.simulated, other.simulated
    if of_one is None or of_other is None or not other.is_confirmed():
        return one, None
    torques = other.solved.best.nats - other.solved.contest.nats_of(one.solved.best.terms)
    ahead = torques + 2.0 * DETAILS * float(np.log(of_one.after / of_other.after))
    if ahead <= 0:
        return one, Rival(answer=other, behind=-ahead)
    return other, Rival(answer=one, behind=ahead) if one.named else None

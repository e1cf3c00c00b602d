"""Sentences on what limits an answer about a robot."""

from collections.abc import Sequence

import numpy as np

from chladni.gap.robots.pushes import Push
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.tuned import Pulled, pulled_masses
from chladni.io.log_info import some_of
from chladni.signals.engineering import engineering

#: Share of a log in which a joint has to move.
_MOVES = 0.05


def remarks_on(solved: Solved, unexplained: Sequence[str], *, named: bool) -> tuple[str, ...]:
    """Say what was left out while reading, what hardly moves, and where and when the named causes leave something."""
    torques = solved.torques
    return (
        *torques.robot.remarks,
        *torques.log.remarks,
        *_of_joints(solved),
        *(of_a_pulled_mass(one) for one in pulled_masses(solved)),
        *(_pushed(one) for one in solved.pushes if named),
        *(
            [f"at {some_of(unexplained)} no word explains what is missing beside the named causes"]
            if named and unexplained
            else []
        ),
    )


def _pushed(one: Push) -> str:
    return (
        f"something pushes at {some_of(one.joints)} from {one.start_s:.2f} s to {one.end_s:.2f} s, by up to "
        f"{engineering(one.torque, None, one.unit)}; those seconds told nothing of the causes"
    )


def of_a_pulled_mass(one: Pulled) -> str:
    """Say by how much the log asks for another mass, and where."""
    first, *others = one.links
    whose = f"{first} with {some_of(others)}" if others else first
    way = "more" if one.change > 0 else "less"
    instead = f", or as well at {some_of(one.instead)}" if one.instead else ""
    return (
        f"the log asks for {engineering(abs(one.change), one.std, 'kg')} {way} at {whose}{instead}, "
        f"{abs(one.over_tolerance):.2g} times the tolerance, which holds it back; weigh it, or raise inertia under "
        "[tolerance]"
    )


def _of_joints(solved: Solved) -> list[str]:
    torques = solved.torques
    found = []
    if torques.log.unmatched:
        found.append(
            f"{some_of(torques.log.unmatched)}: not in the log, taken to rest where the description has them"
        )
    if not np.all(torques.driven):
        names = [one.name for one, there in zip(torques.joints, torques.driven, strict=True) if not there]
        found.append(
            f"{some_of(names)}: no torque is known there (no command and gains, no effort); nothing is told of it"
        )
    still = [
        one.name
        for one, there, driven in zip(
            torques.joints, np.mean(torques.moving[: len(torques.joints)], axis=1), torques.driven, strict=True
        )
        if driven and there < _MOVES
    ]
    if still:
        found.append(f"{some_of(still)}: hardly any motion; move more there to tell friction, inertia and drive")
    return found

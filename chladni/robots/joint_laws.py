"""Laws of joints that MuJoCo hasn't got: loops, ripple, stops, and motors that run ahead of their links."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

if TYPE_CHECKING:
    from chladni.robots.machine import Loop, MachineJoint, Ripple, Transmission
    from chladni.signals.arrays import Mask, Real

#: Resonance of teeth that don't give, against the link, Hz: far above what logs of joints tell.
_TEETH_HZ: Final = 60.0
#: Damping ratio of what lies between a motor and its link.
_DAMPED: Final = 0.05

Step = Callable[["Real", "Real"], None]


def followed(command: Real, step: float) -> Real:
    """Follow a command by at most so much a sample, as drives with a profile do."""
    found, state = np.empty_like(command), float(command[0])
    for place, each in enumerate(command.tolist()):
        state += min(max(each - state, -step), step)
        found[place] = state
    return found


def further_laws(joints: Sequence[MachineJoint], data: Any, dofs: Any) -> list[Step]:
    """Give what adds torques of loops, ripple and stops to MuJoCo's applied ones."""
    found: list[Step] = []
    applied = data.qfrc_applied
    places = np.arange(data.qvel.size)[dofs]
    for row, one in enumerate(joints):
        place = int(places[row])
        if one.ripple is not None:
            found.append(_ripple(one.ripple, row, place, applied))
        if one.stops:
            found.append(_stops(one, row, place, applied))
        if one.loop is not None:
            found.append(_loop(one.loop, row, place, data))
    return found


def _ripple(ripple: Ripple, row: int, place: int, applied: Real) -> Step:
    sine, cosine, wave = ripple.sine, ripple.cosine, 2.0 * np.pi / ripple.period

    def law(position: Real, _: Real) -> None:
        turns = wave * position[row]
        applied[place] -= sine * np.sin(turns) + cosine * np.cos(turns)

    return law


def _stops(one: MachineJoint, row: int, place: int, applied: Real) -> Step:
    def law(position: Real, _: Real) -> None:
        for stop in one.stops:
            applied[place] -= stop.side * stop.stiffness * max(stop.side * position[row] - stop.clearance, 0.0)

    return law


def _loop(loop: Loop, row: int, place: int, data: Any) -> Step:
    applied, state = data.qfrc_applied, [0.0, 0.0]

    def law(position: Real, _: Real) -> None:
        if data.time == 0.0:
            state[:] = 0.0, position[row]
        way = position[row] - state[1]
        # Exact between reversals.
        sense = np.sign(way)
        state[0] = sense - (sense - state[0]) * np.exp(-abs(way) / loop.yields) if way else state[0]
        state[1] = position[row]
        applied[place] -= loop.force * state[0]

    return law


def tooth_of(between: Transmission, link: float) -> float:
    """Stiffness of what lies between a motor and a link with an inertia."""
    if np.isfinite(between.stiffness):
        return between.stiffness
    both = link * between.inertia / (link + between.inertia)
    return float((2.0 * np.pi * _TEETH_HZ) ** 2 * both)


@dataclass(slots=True, eq=False)
class Between:
    """Motors that run ahead of their links by a spring or by play; rows without are rigid.

    Attributes
    ----------
    soft
        ``[joint]``: which ones do.
    """

    soft: Mask
    stiffness: Real
    damping: Real
    gap: Real
    inertia: Real
    at_motor: Mask
    step_s: float
    angle: Real = field(init=False)
    speed: Real = field(init=False)

    @classmethod
    def of(cls, joints: Sequence[MachineJoint], links: Real, step_s: float) -> Self:
        """Give those of joints whose links have inertias ``[joint]``."""
        count = len(joints)
        soft, at_motor = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        stiffness, damping, gap = np.zeros((3, count))
        inertia = np.ones(count)
        for row, (one, link) in enumerate(zip(joints, links.tolist(), strict=True)):
            way = one.transmission
            if way is None:
                continue
            soft[row], at_motor[row], gap[row], inertia[row] = True, way.logs_motor, way.gap, way.inertia
            stiffness[row] = tooth_of(way, link)
            both = link * way.inertia / (link + way.inertia)
            damping[row] = 2.0 * _DAMPED * np.sqrt(stiffness[row] * both)
        return cls(soft, stiffness, damping, gap, inertia, at_motor, step_s)

    @property
    def any(self) -> bool:
        """Whether there's one."""
        return bool(self.soft.any())

    def start(
        self, reading: Real, velocity: Real, torque: Real, kp: Real, passed: Real, rate: Real
    ) -> tuple[Real, Real]:
        """Begin where the log reads; give the links' positions and speeds.

        Springs are wound up by what they pass to their links; what has play begins with its loop in balance.

        Parameters
        ----------
        torque
            That loops would ask for if motors were where the log reads.
        passed, rate
            That reaches the links, and its rate.
        """
        half, plays = 0.5 * self.gap, self.gap > 0.0
        stiffness = np.where(self.soft, self.stiffness, 1.0)
        # kp (command - motor) = stiffness (lead - half the play), from either side that the log reads.
        by_link = (np.abs(torque) + stiffness * half) / (kp + stiffness)
        lead = np.where(self.at_motor, half + np.abs(torque) / stiffness, np.maximum(by_link, 0.0))
        lead = np.where(plays, np.sign(torque) * lead, np.where(self.soft, passed / stiffness, 0.0))
        leading = np.where(self.soft & ~plays, rate / stiffness, 0.0)
        link, speed = (
            np.where(self.at_motor, read - ahead, read) for read, ahead in ((reading, lead), (velocity, leading))
        )
        self.angle, self.speed = link + lead, speed + leading
        return link, speed

    def motor(self, position: Real, velocity: Real) -> tuple[Real, Real]:
        """Angle and speed that the loops work on."""
        return np.where(self.soft, self.angle, position), np.where(self.soft, self.speed, velocity)

    def logged(self, position: Real) -> Real:
        """What the log reads."""
        return np.where(self.at_motor, self.angle, position)

    def passed(self, torque: Real, position: Real, velocity: Real) -> Real:
        """Turn the motors by one implicit step, and give what reaches the links."""
        h, half = self.step_s, 0.5 * self.gap
        twist = self.angle - position
        pressed = twist - np.minimum(np.maximum(twist, -half), half)
        touches = (pressed != 0.0) | (self.gap == 0.0)
        stiffness, damping = self.stiffness * touches, self.damping * touches
        spring = stiffness * pressed
        free = self.inertia * self.speed + h * (torque - spring + (damping + h * stiffness) * velocity)
        self.speed = free / (self.inertia + h * damping + h * h * stiffness)
        self.angle = np.where(self.soft, self.angle + h * self.speed, position)
        given = spring + (damping + h * stiffness) * (self.speed - velocity)
        return np.where(self.soft, given, torque)

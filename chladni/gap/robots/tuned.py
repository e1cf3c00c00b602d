"""What moved within its tolerance: gains of loops and masses of links."""

from collections.abc import Iterator
from dataclasses import dataclass

from chladni.gap.records.diagnosis import FittedNumber
from chladni.gap.robots.solved import Solved
from chladni.robots.dynamics import inertial_numbers

#: Of its tolerance: a number that stays wider isn't told by the log.
_NARROWED = 0.9
#: Tolerances from which a mass was hardly within them: one in twenty that is right is beyond.
_HARDLY = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulled:
    """Links that move as one, and whose mass the log pulls to the end of their tolerance.

    Attributes
    ----------
    links
        The one that a joint moves, and those fixed to it.
    change, std
        Of their mass together, kg, as far as their tolerance lets it.
    over_tolerance
        The change over its standard deviation before the log was seen.
    """

    links: tuple[str, ...]
    change: float
    std: float
    over_tolerance: float


def pulled_masses(solved: Solved) -> Iterator[Pulled]:
    """Give the links, those fixed to each other together, whose masses hardly stay within their tolerance.

    A log doesn't tell masses apart that are fixed to each other; what it pulls one to, all have together.
    """
    robot, numbers = solved.torques.robot, inertial_numbers(solved.torques.robot)
    fixed: dict[int, dict[str, float]] = {}
    for place, link in enumerate(robot.links):
        # MuJoCo's first body is the world.
        body = int(robot.model.body_weldid[1 + place])
        fixed.setdefault(body, {})[link] = robot.tolerance.inertia * float(numbers[place, 0])
    for spreads in fixed.values():
        usual = sum(one**2 for one in spreads.values()) ** 0.5
        change, std = solved.contest.together(solved.best, {f"{link}.mass": one for link, one in spreads.items()})
        if abs(change) > _HARDLY * usual and std < _NARROWED * usual:
            yield Pulled(links=tuple(spreads), change=change, std=std, over_tolerance=change / usual)


def tuned_parameters(solved: Solved) -> dict[str, FittedNumber]:
    """Give what moved within its tolerance: gains of the loops and masses of the links."""
    return {**_tuned_gains(solved), **_tuned_masses(solved)}


def _tuned_gains(solved: Solved) -> dict[str, FittedNumber]:
    torques, found = solved.torques, {}
    for name, both in solved.gains().items():
        row = torques.log.joints.index(name)
        hinge = torques.joints[row].kind == "hinge"
        units = ("N m/rad", "N m s/rad") if hinge else ("N/m", "N s/m")
        for which, (value, std), unit in zip(("kp", "kd"), both, units, strict=True):
            believed = None if name in torques.guessed else float(getattr(torques, which)[row])
            found[f"{name}.{which}"] = FittedNumber(value=value, std=std, unit=unit, nominal=believed)
    return found


def _tuned_masses(solved: Solved) -> dict[str, FittedNumber]:
    robot, numbers, found = solved.torques.robot, inertial_numbers(solved.torques.robot), {}
    for name, (value, std) in solved.contest.tolerances(solved.best).items():
        link, _, what = name.rpartition(".")
        if what != "mass":
            continue
        mass = float(numbers[robot.links.index(link), 0])
        spread = robot.tolerance.inertia * mass
        found[name] = FittedNumber(
            value=mass + spread * value, unit="kg", nominal=mass,
            # What a log doesn't narrow down stays as wide as its tolerance.
            std=spread * std if std < _NARROWED else None,
        )  # fmt: skip
    return found

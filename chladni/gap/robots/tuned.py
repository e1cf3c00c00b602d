"""What moved within its tolerance: gains of loops and masses of links."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from chladni.gap.calibration import COVERAGE
from chladni.gap.records.diagnosis import FittedNumber
from chladni.gap.robots.solved import Solved
from chladni.robots.dynamics import inertial_numbers
from chladni.signals.arrays import Real

#: Of its tolerance: a number that stays wider isn't told by the log.
_NARROWED = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulled:
    """Links that move as one, and whose mass the log pulls beyond its tolerance.

    Attributes
    ----------
    links
        The one that a joint moves, and those fixed to it.
    instead
        First links of others whose mass would explain as much, and that the log can't tell from these.
    change, std
        Of their mass together, kg, that the log asks for where no tolerance holds it back.
    over_tolerance
        The change over its standard deviation before the log was seen.
    """

    links: tuple[str, ...]
    instead: tuple[str, ...]
    change: float
    std: float
    over_tolerance: float


def pulled_masses(solved: Solved) -> Iterator[Pulled]:
    """Give the links, those fixed to each other together, whose masses aren't within their tolerance.

    A log doesn't tell masses apart that are fixed to each other.
    """
    links, usual = _moved_together(solved)
    over = zip(links, usual, strict=True)
    weights = [{f"{link}.mass": part / size for link, part in one.items()} for one, size in over]
    for one in beyond_their_prior(*solved.contest.together(solved.best, weights)) if links else ():
        size = float(usual[one.place])
        yield Pulled(
            links=tuple(links[one.place]), instead=tuple(next(iter(links[other])) for other in one.instead),
            change=one.value * size, std=one.std * size, over_tolerance=one.value,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Beyond:
    """A number that isn't within its prior.

    Attributes
    ----------
    place
        Among all of them.
    instead
        Others that would explain as much: either is within its prior where the other is free.
    value, std
        Where nothing is believed of it.
    """

    place: int
    instead: tuple[int, ...]
    value: float
    std: float


def beyond_their_prior(values: Real, covariance: Real) -> Iterator[Beyond]:
    """Give the numbers that aren't within their prior, by what a fit says of all, most first.

    What a prior holds back pulls at other numbers: so the one that is pulled most is set free before the next is
    looked at. Where all are as their priors say, any is given one time in twenty.

    Parameters
    ----------
    values, covariance
        ``[number]`` and ``[number, number]``, of priors of one deviation each about zero.
    """
    looked_at = np.diag(covariance) < _NARROWED**2
    # As often as one of so many is beyond by chance (Bonferroni).
    beyond = -float(ndtri((1.0 - COVERAGE) / 2.0 / max(int(np.sum(looked_at)), 1)))
    while np.any(looked_at):
        pulls = np.where(looked_at, _pulls(values, covariance), 0.0)
        most = int(np.argmax(pulls))
        if pulls[most] < beyond:
            return
        free = _freed(values, covariance, most)
        alike = np.flatnonzero((pulls > beyond) & (_pulls(*free) < beyond)).tolist()
        instead = [one for one in alike if one != most and _pulls(*_freed(values, covariance, one))[most] < beyond]
        values, covariance = free
        looked_at[[most, *instead]] = False
        yield Beyond(
            place=most, instead=tuple(instead), value=float(values[most]), std=float(np.sqrt(covariance[most, most]))
        )


def _moved_together(solved: Solved) -> tuple[list[dict[str, float]], Real]:
    """Give links that are fixed to each other, with the tolerances of their masses; and that of their sum, kg."""
    robot, numbers = solved.torques.robot, inertial_numbers(solved.torques.robot)
    fixed: dict[int, dict[str, float]] = {}
    for place, link in enumerate(robot.links):
        # MuJoCo's first body is the world.
        body = int(robot.model.body_weldid[1 + place])
        fixed.setdefault(body, {})[link] = robot.tolerance.inertia * float(numbers[place, 0])
    usual = {body: sum(one**2 for one in spreads.values()) ** 0.5 for body, spreads in fixed.items()}
    found = [body for body, size in usual.items() if size > 0]
    return [fixed[body] for body in found], np.array([usual[body] for body in found])


def _pulls(values: Real, covariance: Real) -> Real:
    """``[sum]``: what each is over how far it goes by chance, where its tolerance is right."""
    # Of numbers of unit variance those that the log tells scatter by what it takes of that (law of total variance).
    return np.asarray(np.abs(values) / np.sqrt(np.maximum(1.0 - np.diag(covariance), 1e-9)))


def _freed(values: Real, covariance: Real, place: int) -> tuple[Real, Real]:
    """Give values and covariance where nothing is believed of one of them."""
    moved = covariance[place] / (1.0 - covariance[place, place])
    return values + moved * values[place], covariance + np.outer(moved, covariance[place])


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

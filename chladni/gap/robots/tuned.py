"""What moved within its tolerance: gains of loops and masses of links."""

from chladni.gap.records.diagnosis import FittedNumber
from chladni.gap.robots.solved import Solved
from chladni.robots.dynamics import inertial_numbers

#: Of its tolerance: a number that stays wider isn't told by the log.
_NARROWED = 0.9


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

"""What a word adds to the missing torque of a robot at a site: columns of numbers to be found."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from chladni.gap.robots.row import Parts, parts_of
from chladni.gap.robots.torques import Torques
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real

#: Place of a form that was found, beside those of the grid that it's searched on.
FOUND = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A number of a term.

    Attributes
    ----------
    scale
        Standard deviation before the log is seen: what would be a usual part of the torque.
    least
        What it can't be below, beside the nominal one.
    nominal
        What the description believes, which is added when it's told.
    about
        What it's usually about, before the log is seen, beside the nominal one.
    places
        Whether it only says where the law is: alone it's no sign of it.
    is_exact
        Whether its column is physics, beside numbers of a law that idealises.
    """

    name: str
    unit: str
    scale: float
    least: float = -np.inf
    nominal: float = 0.0
    about: float = 0.0
    places: bool = False
    is_exact: bool = False


#: Of what a limit takes all is missing, within what servos' gains and filtered columns are off by: a form that needs
#: another part is a wrong one.
PART = Number(name="part", unit="1", scale=0.1, least=0.5, about=1.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Form:
    """A number that a law isn't linear in.

    Attributes
    ----------
    name, unit, value
        The number.
    place
        On the grid that it's searched on; `FOUND` when it was searched between.
    low, high
        Between which the best one lies if this is the best of the grid.
    count
        Of the forms that a log could tell apart.
    make
        Gives the law with a value.
    usual
        Standard deviation before the log is seen; nothing is known of it when infinite.
    """

    name: str
    unit: str
    value: float
    place: int
    low: float
    high: float
    count: int
    make: Callable[[float], "Term"]
    usual: float = np.inf

    def term(self) -> "Term":
        """Give the law with this form."""
        return replace(self.make(self.value), form=self)

    def at(self, value: float) -> "Term":
        """Give the law with another value, as one that was found."""
        return replace(self, value=value, place=FOUND).term()


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """A word at a site, with the columns of its numbers.

    Attributes
    ----------
    word, site, variant
        What, where, and which kind of it.
    make
        Gives the columns ``[number, row, coarse]``: missing torque a unit of each number; rows of the loops may be
        left out.
    numbers
        One a column.
    rows
        Of the joints whose law this idealises; none where the physics is exact.
    form
        The number that its columns aren't linear in, if there's one.
    plainer
        The word of the law that is left without the last number; None where none is.
    adds_form
        Whether it's the form that the plainer law lacks, in place of the last number.
    takes
        Whether its first column is torque that a drive was asked for and doesn't give.
    over_gain
        Whether its first number is one over a gain: what is left is in units of what was asked for.
    rare
        Whether few machines have it.
    ratio
        Of what acts between two joints: by which the second moves it, over the first; None of all others.
    inertia
        Gives ``[number, joint, joint, pose]``: inertia that a unit of each number adds, which makes more torque of
        what readings shake by. None where none does.
    reach
        How far the next three numbers, as a vector, can lie from the first as its arm: a mass and its first moment.
    """

    word: str
    site: str
    make: Callable[[], Real]
    numbers: tuple[Number, ...]
    rows: tuple[int, ...] = ()
    variant: str | None = None
    form: Form | None = None
    inertia: Callable[[], Real] | None = None
    reach: float | None = None
    plainer: str | None = None
    adds_form: bool = False
    takes: bool = False
    over_gain: bool = False
    rare: bool = False
    ratio: float | None = None

    @cached_property
    def parts(self) -> Parts:
        """Missing torque a unit of each number, where it acts.

        Made when it's asked for: most words don't take part where a motion is laid out.
        """
        return parts_of(self.make())

    @cached_property
    def added_inertia(self) -> Real | None:
        """``[number, joint, joint, pose]``."""
        return None if self.inertia is None else self.inertia()

    def explains(self, numbers: Real) -> dict[int, Real]:
        """Give ``[coarse]`` by row: missing torque that numbers beside the nominal ones explain."""
        return {row: numbers[acting] @ columns for row, acting, columns in self.parts}

    @cached_property
    def key(self) -> tuple[str, str]:
        """Word and site."""
        return self.word, self.site

    @property
    def is_coupling(self) -> bool:
        """Whether it acts between two joints."""
        return self.ratio is not None

    @cached_property
    def kind(self) -> tuple[str, str | None, int]:
        """What terms of several joints have in common."""
        return self.word, self.variant, 0 if self.form is None else self.form.place

    @property
    def form_value(self) -> float:
        """The form's number; not one where the law has none."""
        return float("nan") if self.form is None else self.form.value

    @property
    def scale(self) -> Real:
        """``[number]``."""
        return np.array([one.scale for one in self.numbers])

    @property
    def least(self) -> Real:
        """``[number]``."""
        return np.array([one.least for one in self.numbers])

    @property
    def about(self) -> Real:
        """``[number]``."""
        return np.array([one.about for one in self.numbers])

    @property
    def nominal(self) -> Real:
        """``[number]``."""
        return np.array([one.nominal for one in self.numbers])

    def holds(self, other: "Term") -> bool:
        """Whether this law without its last number is the other's."""
        return self.plainer == other.word and self.site == other.site


def formed(
    make: Callable[[float], Term], grid: Real, *, name: str, unit: str, count: int | None = None,
    scale: float = np.inf,
) -> list[Term]:  # fmt: skip
    """Give the terms of a law at the values of a form on a growing grid."""
    step = np.diff(grid)
    # Before the first and behind the last as far as to the next; a form that is positive stays so.
    before = grid[0] - step[0] if grid[0] <= 0 or grid[0] > step[0] else 0.1 * grid[0]
    edges = [float(before), *grid.tolist(), float(grid[-1] + step[-1])]
    forms = [
        Form(name=name, unit=unit, value=value, place=place, low=edges[place], high=edges[place + 2],
             count=count or grid.size, make=make, usual=scale)
        for place, value in enumerate(grid.tolist())
    ]  # fmt: skip
    return [one.term() for one in forms]


def at_row(torques: Torques, row: int, *columns: Real) -> Real:
    """Give ``[number, row, coarse]`` of columns of one row."""
    found = np.zeros((len(columns), *torques.missing.shape))
    found[:, row] = columns
    return found


def rotor_at(torques: Torques, row: int, place: int, count: int) -> Real:
    """Give ``[number, joint, joint, 1]`` of some numbers of which one is an inertia that turns with a joint."""
    found = np.zeros((count, len(torques.joints), len(torques.joints), 1))
    found[place, row, row] = 1.0
    return found


def usual(torques: Torques, row: int) -> float:
    """Torque that a joint usually gives."""
    memory = torques.memory
    if "usual" not in memory:
        changes = np.std(torques.drive, axis=1)
        memory["usual"] = np.maximum(changes, torques.highest_noise[: changes.size])
    return float(memory["usual"][row])


def units(joint: RobotJoint) -> tuple[str, str, str]:
    """Of a force, a damping and a stiffness."""
    return ("N m", "N m s/rad", "N m/rad") if joint.kind == "hinge" else ("N", "N s/m", "N/m")


def length(joint: RobotJoint) -> str:
    """Unit of a position."""
    return "rad" if joint.kind == "hinge" else "m"


def law(
    torques: Torques, row: int, word: str, make: Callable[[], tuple[Real, ...]], *numbers: Number,
    variant: str | None = None, rare: bool = False, plainer: str | None = None,
) -> Term:  # fmt: skip
    """Give a law of one joint; `make` gives its columns there."""
    return Term(
        word=word, site=torques.joints[row].name, make=lambda: at_row(torques, row, *make()), numbers=numbers,
        rows=(row,), variant=variant, rare=rare, plainer=plainer,
    )  # fmt: skip

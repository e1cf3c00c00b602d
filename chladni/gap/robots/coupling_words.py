"""Words of what acts between two joints of a chain: friction of gears that run in one another, springs over both."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from chladni.gap.robots.joint_words import spring_numbers
from chladni.gap.robots.motion import rms
from chladni.gap.robots.term import Number, Term, at_row, formed, units, usual
from chladni.gap.robots.torques import Torques
from chladni.signals.arrays import Real

#: Of a spring: by which the second joint winds it up over the first, where a search begins.
_RATIOS = (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)
#: Of gears: whether they turn by the sum or the difference of two speeds.
_SENSES = {"sum": 1.0, "difference": -1.0}

Rows = tuple[int, int]


def couplings(torques: Torques) -> Iterator[Term]:
    """What two joints share of which the second hangs on the first.

    The motor of one may drive through the other, as in wrists and in legs whose motors sit at the hip; a cable, a
    belt or an elastic band may lie over both.
    """
    for first, one in torques.rows:
        behind = torques.robot.hanging(one)
        for second, other in torques.rows:
            if one.kind == other.kind and first != second and other.link in behind:
                rows = first, second
                yield from _friction(torques, rows)
                yield from formed(partial(_spring, torques, rows), np.array(_RATIOS), name="ratio", unit="1")


def _friction(torques: Torques, rows: Rows) -> Iterator[Term]:
    """Friction of the sum or the difference of two speeds."""
    force, damping, _ = units(torques.joints[rows[0]])
    often = _usual(torques, rows)
    for variant, sense in _SENSES.items():
        smooth = _between(torques.velocity, rows, sense)
        dry = Number(name="force", unit=force, scale=often, least=0.0)
        wet = Number(name="coefficient", unit=damping, scale=often / rms(smooth), least=0.0)
        one = partial(Term, site=_site(torques, rows), rows=rows, variant=variant, rare=True, ratio=sense)
        yield one(word="coulomb_friction", numbers=(dry,), make=partial(_rubbing, torques, rows, sense))
        yield one(word="viscous_friction", numbers=(wet,), make=partial(_at, torques, rows, sense, smooth))


def _rubbing(torques: Torques, rows: Rows, sense: float) -> Real:
    fast, slow = _between(torques.fast_velocity, rows, sense), np.hypot(*(torques.slow[row] for row in rows))
    return _at(torques, rows, sense, torques.smooth(np.tanh(fast / slow)))


def _spring(torques: Torques, rows: Rows, ratio: float) -> Term:
    """Spring that winds up with the first joint and, by a ratio, with the second."""
    way = _between(torques.position, rows, ratio)
    numbers = spring_numbers(torques.joints[rows[0]], way, _usual(torques, rows))
    return Term(
        word="joint_spring", site=_site(torques, rows), rows=rows, numbers=numbers, rare=True, ratio=ratio,
        make=partial(_at, torques, rows, ratio, way, np.ones_like(way)),
    )  # fmt: skip


def _usual(torques: Torques, rows: Rows) -> float:
    return min(usual(torques, row) for row in rows)


def _between(of_joints: Real, rows: Rows, ratio: float) -> Real:
    return np.asarray(of_joints[rows[0]] + ratio * of_joints[rows[1]])


def _at(torques: Torques, rows: Rows, ratio: float, *columns: Real) -> Real:
    """Columns of what acts between two joints: a ratio of it acts at the second."""
    return np.asarray(at_row(torques, rows[0], *columns) + ratio * at_row(torques, rows[1], *columns))


def _site(torques: Torques, rows: Rows) -> str:
    return "~".join(torques.joints[row].name for row in rows)

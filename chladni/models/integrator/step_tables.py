"""Coefficients of the schemes at each step length: the sample interval, its half, its quarter, ..."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import sqrt
from typing import NamedTuple

import numpy as np

from chladni.models.integrator.exponential import POWERS, Response, responses
from chladni.models.integrator.hold import Hold
from chladni.models.integrator.plane import Numbers2, Numbers3, Numbers4, Numbers5
from chladni.models.integrator.port_plan import PortPlan
from chladni.signals.arrays import Real

#: Steps are halved at most this often: a millisecond down to a nanosecond.
DEEPEST = 20
#: Inside a step, where the history of a delay line is kept.
HISTORY_NODES = (0.25, 0.5, 0.75)

# Radau IIA collocation with three stages: order 5, stiffly accurate (Hairer & Wanner 1996, section IV.5).
#: Instants of the stages, as fractions of the step.
NODES = np.array([(4 - sqrt(6)) / 10, (4 + sqrt(6)) / 10, 1.0])
#: ``[power, stage]``: the polynomial of degree 2 through 1 at one node and 0 at the others.
LAGRANGE = np.linalg.inv(np.vander(NODES, increasing=True))
#: ``[stage, stage]``: integral of each of them up to each node.
WEIGHTS = (NODES[:, None] ** np.arange(1, 4) / np.arange(1, 4)) @ LAGRANGE
#: Reciprocal of the real eigenvalue of the inverse of WEIGHTS: the weight of the error estimate.
GAMMA = float(1 / min(np.linalg.eigvals(np.linalg.inv(WEIGHTS)), key=lambda value: abs(value.imag)).real)


class SchemeTables(NamedTuple):
    """Coefficients of one scheme, for every step length so far.

    Attributes
    ----------
    advance
        ``[level, state + width, row]``: rows are the state at the end, then the motion at the ports of each stage,
        all without the forces of this step.
    couple
        ``[level, stage, other stage, port, 2 port]``: what the force of the other stage adds to the motion of one.
    gain
        ``[level, stage, port, state]``: what forces add to the state at the end.
    """

    advance: Numbers3
    couple: Numbers5
    gain: Numbers4


class DenseTables(NamedTuple):
    """Motion and outputs inside a step.

    Attributes
    ----------
    advance
        ``[level, instant, state + width, 2 port + output]``.
    couple
        ``[level, instant, power, port, 2 port + output]``.
    fraction
        ``[level, instant]`` where, as a fraction of that level's step.
    """

    advance: Numbers4
    couple: Numbers5
    fraction: Numbers2


@dataclass(slots=True)
class StepTables:
    """Tables that grow as finer steps are needed.

    Attributes
    ----------
    plan, hold, step_s
        The equations, the run of the inputs, the sample interval.
    instants
        Fractions of the sample interval at which outputs are wanted.
    """

    plan: PortPlan
    hold: Hold
    step_s: float
    instants: Real
    explicit: SchemeTables = field(init=False)
    implicit: SchemeTables = field(init=False)
    dense: DenseTables = field(init=False)
    effect: Real = field(init=False)
    _made: list[tuple[SchemeTables, SchemeTables, DenseTables, Real]] = field(init=False, default_factory=list)
    _reach: Real = field(init=False)

    def __post_init__(self) -> None:
        self._reach = _reach(self.plan)
        self.deepen(1)

    @property
    def levels(self) -> int:
        """Step lengths that are ready."""
        return int(self.effect.shape[0])

    def deepen(self, levels: int) -> None:
        """Make the tables for more step lengths."""
        self._made += [self._level(level) for level in range(len(self._made), levels)]
        explicit, implicit, dense, effect = zip(*self._made, strict=True)
        self.explicit = SchemeTables(*map(_stack, zip(*explicit, strict=True)))
        self.implicit = SchemeTables(*map(_stack, zip(*implicit, strict=True)))
        self.dense = DenseTables(*map(_stack, zip(*dense, strict=True)))
        self.effect = _stack(effect)

    def _level(self, level: int) -> tuple[SchemeTables, SchemeTables, DenseTables, Real]:
        local = np.mod(self.instants * 2.0**level, 1.0)
        wanted = np.concatenate([local, HISTORY_NODES if self.plan.delay_s.size else ()])
        found = responses(
            self.plan.a,
            self.plan.b,
            self.plan.g,
            self.hold,
            step_s=self.step_s / 2.0**level,
            kink_at=np.mod(self.hold.kink_at * 2.0**level, 1.0),
            fractions=np.concatenate([[0.5], NODES, wanted]),
        )
        middle, *nodes = found[: 1 + len(NODES)]
        return (
            _explicit(self.plan, middle, nodes[-1]),
            _implicit(self.plan, nodes),
            _dense(self.plan, self.hold, found[1 + len(NODES) :], wanted),
            np.abs(nodes[-1].force[0].T) * self._reach,
        )


def _stack(arrays: Sequence[Real]) -> Real:
    # The order in memory is part of the type that a kernel is compiled for: always the same.
    return np.ascontiguousarray(np.stack(arrays))


def _motion(plan: PortPlan, response: Response) -> Real:
    return plan.motion_state @ response.state + plan.motion_column @ response.column


def _explicit(plan: PortPlan, middle: Response, end: Response) -> SchemeTables:
    """Krogstad's scheme (2005): forces at the start, in the middle, there again, at the end; motions after each."""
    first, second, third = end.force
    gain = np.stack([first - 3 * second + 2 * third, *2 * [2 * second - 2 * third], 2 * third - second])
    force = np.zeros((4, *gain.shape))
    force[0, 0] = middle.force[0]
    force[1, :2] = middle.force[0] - 4 * middle.force[1], 4 * middle.force[1]
    force[2, 0], force[2, 2] = first - 2 * second, 2 * second
    force[3] = gain
    return _scheme(plan, [end.state, _motion(plan, middle), _motion(plan, end)], force, gain)


def _implicit(plan: PortPlan, nodes: list[Response]) -> SchemeTables:
    """Collocation of the port forces at Radau's nodes, the last of which is the end of the step."""
    # LAGRANGE[power, stage] turns forces at the nodes into a polynomial.
    force = np.stack([np.einsum("ks,knp->snp", LAGRANGE, node.force) for node in nodes])
    return _scheme(plan, [nodes[-1].state, *(_motion(plan, node) for node in nodes)], force, force[-1])


def _scheme(plan: PortPlan, rows: list[Real], force: Real, gain: Real) -> SchemeTables:
    """Lay out for the kernels: ``force [stage, other, state, port]``, ``gain [stage, state, port]``."""
    return SchemeTables(
        advance=np.ascontiguousarray(np.vstack(rows).T),
        couple=np.ascontiguousarray(np.swapaxes(plan.motion_state @ force, -1, -2)),
        gain=np.ascontiguousarray(np.swapaxes(gain, -1, -2)),
    )


def _dense(plan: PortPlan, hold: Hold, found: list[Response], wanted: Real) -> DenseTables:
    state = np.vstack([plan.motion_state, plan.c])
    column = np.vstack([plan.motion_column, plan.d])
    advance = np.zeros((len(found), plan.a.shape[0] + hold.width, len(state)))
    couple = np.zeros((len(found), POWERS, plan.g.shape[1], len(state)))
    for place, each in enumerate(found):
        advance[place] = (state @ each.state + column @ each.column).T
        couple[place] = np.swapaxes(state @ each.force, 1, 2)
    return DenseTables(advance=advance, couple=couple, fraction=wanted)


def _reach(plan: PortPlan) -> Real:
    """``[port, state]``: 1 where the force of a port can reach the state at all; rounding reaches everywhere."""
    reach = (plan.a != 0) | np.eye(len(plan.a), dtype=bool)
    for _ in range(max(1, len(plan.a)).bit_length()):
        reach = (reach.astype(float) @ reach) > 0
    return np.asarray((reach.astype(float) @ (plan.g != 0)).T > 0, dtype=np.float64)

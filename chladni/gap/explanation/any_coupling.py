"""Whether velocities of bodies that push each other explain a gap: a linear law, whatever joins the bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.location.locate import Location, tuned_stepwise
from chladni.gap.plant.further_numbers import with_further
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Real

_Pair = tuple[str, str]
#: Of the damping that would make a body's own oscillation critical: a step of a coefficient.
_STEP = 0.05
#: Steps that a coefficient may take from zero, and those of its tolerance that a parameter may.
_FREE, _BOUNDED = 1e4, 3.0
#: Coefficients that differ by less than this share are the same.
_NEARLY = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """Forces ``f_i = -sum_j C_ij v_j`` of bodies' velocities beside those of the model.

    Attributes
    ----------
    chi
        Misfit over what noise alone leaves, with the parameters refitted under it.
    first, second
        The two bodies that push each other most.
    on_first, on_second
        C from the second's velocity to the force on the first, and the other way round, SI: equal as of a damper
        between them, opposite as where a wheel spins.
    units
        Of these two.
    """

    chi: float
    first: str
    second: str
    on_first: float
    on_second: float
    units: tuple[str, str]

    def sentence(self) -> str:
        """Say which force acts where, and what does that."""
        first, second = (
            f"{-size:.3g} {unit} times the velocity of {other} on {body}"
            for size, unit, body, other in (
                (self.on_first, self.units[0], self.first, self.second),
                (self.on_second, self.units[1], self.second, self.first),
            )
        )
        return f"forces of {first} and {second}{self._meaning()}"

    def _meaning(self) -> str:
        larger = max(abs(self.on_first), abs(self.on_second))
        if abs(self.on_first - self.on_second) < _NEARLY * larger:
            return ", as of a damper between them that the model lacks"
        if abs(self.on_first + self.on_second) < _NEARLY * larger:
            return ", as where a wheel spins between them"
        return ""


def any_coupling(location: Location) -> Coupling | None:
    """Fit a force on each body from each body's velocity; None for a model of fewer than two bodies.

    It is linear in what moves, so no parameters of bodies and joints, sensors or inputs do the same but by chance:
    errors of a sensor leave the others alone, and a late command acts along its own way.
    """
    nominal = location.problem.model.compile()
    bodies = [port.name for port in nominal.ports if port.kind == "body"]
    if len(bodies) < 2:
        return None
    steps = _steps(nominal, bodies)
    there = np.concatenate([location.tuned.z, np.zeros(len(steps))])
    limit = np.repeat([_BOUNDED, _FREE], [location.tuned.z.size, len(steps)])
    problems = [_coupled(one, steps) for one in (*location.segments, location.problem)]
    found = tuned_stepwise(problems, there, limit)
    size = dict(zip(steps, found.z[location.tuned.z.size :].tolist(), strict=True))
    # In steps, so that heavy bodies' coefficients don't hide those of light ones.
    pairs = [(one, other) for place, one in enumerate(bodies) for other in bodies[place + 1 :]]
    first, second = max(pairs, key=lambda pair: abs(size[pair]) + abs(size[pair[::-1]]))
    return Coupling(
        chi=found.chi,
        first=first,
        second=second,
        on_first=size[first, second] * steps[first, second],
        on_second=size[second, first] * steps[second, first],
        units=(_unit(nominal, first, second), _unit(nominal, second, first)),
    )


def _unit(compiled: CompiledModel, on: str, of: str) -> str:
    forced, moving = (compiled.ports[compiled.port_index(name, "body")] for name in (on, of))
    return f"{forced.unit} s/{moving.displacement_unit}"


def _steps(compiled: CompiledModel, bodies: list[str]) -> dict[_Pair, float]:
    """Step of each coefficient, SI: of the pair's mass at the middle one of the natural frequencies."""
    rates = np.abs(np.linalg.eigvals(compiled.a))
    moving = rates[rates > 1e-6 * rates.max(initial=0.0)]
    omega = float(np.median(moving)) if moving.size else 1.0
    places = [compiled.port_index(name, "body") for name in bodies]
    # What a force adds to its own body's velocity is one over its mass.
    light = np.einsum("bs,sb->b", compiled.velocity_state[places], compiled.g[:, places])
    root = dict(zip(bodies, (light**-0.5).tolist(), strict=True))
    return {(one, other): _STEP * omega * root[one] * root[other] for one in bodies for other in bodies}


def _coupled(problem: LinearProblem, steps: Mapping[_Pair, float]) -> LinearProblem:
    """Give the problem with coefficients in steps behind its parameters."""
    bodies = list(dict.fromkeys(one for one, _ in steps))
    size = np.array(list(steps.values()))

    def make(parameters: Mapping[str, float], numbers: Real) -> CompiledModel:
        compiled = problem.model.with_values(parameters).compile()
        return _with_forces(compiled, bodies, (size * numbers).reshape(len(bodies), len(bodies)))

    return with_further(problem, len(steps), make)


def _with_forces(compiled: CompiledModel, bodies: Sequence[str], matrix: Real) -> CompiledModel:
    """Let velocities of bodies push each other."""
    at = [compiled.port_index(name, "body") for name in bodies]
    state, column = matrix @ compiled.velocity_state[at], matrix @ compiled.velocity_column[at]
    return replace(
        compiled,
        a=compiled.a - compiled.g[:, at] @ state,
        b=compiled.b - compiled.g[:, at] @ column,
        c=compiled.c - compiled.h[:, at] @ state,
        d=compiled.d - compiled.h[:, at] @ column,
    )

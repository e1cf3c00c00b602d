"""A law at a port: force from displacement, velocity, time and its own states."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

#: ``law(d, s, t, parameters, state, rates) -> force``, see `PortLaw`.
LawFunction = Callable[[float, float, float, Any, Any, Any], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PortLaw:
    """A law attached to a port of a compiled model.

    `function` is a plain Python function, written in the subset that numba compiles (`math`, arithmetic, branches,
    loops, indexing)::

        def law(d, s, t, parameters, state, rates):
            # d displacement, s velocity at the port, t seconds; `parameters` and `state` are read by index.
            rates[0] = ...           # time derivative of state[0], one for each state
            return force

    It must be a pure function of its arguments (but for writing `rates`), because the integrator tries steps and
    throws some away. The integrator compiles it once; called as Python with lists it's the same law, which is what
    the tests integrate with SciPy.

    Attributes
    ----------
    port
        Index into the model's ports.
    function
        At the top of a module, not a closure: what varies comes in `parameters`.
    parameters
        Numbers in the order that the function reads.
    state
        Initial values of the law's own states.
    """

    port: int
    function: LawFunction
    parameters: tuple[float, ...] = ()
    state: tuple[float, ...] = ()

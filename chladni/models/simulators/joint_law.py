"""Laws at a joint of a simulator, asked at each of its steps."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.models.core.port_law import PortLaw

#: Of a law's state, or of `LEAST_STATE` where that is more: the step of the difference that tells how stiff it is.
NUDGE = 1e-6
LEAST_STATE = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLaw:
    """Everything that resists the motion of one joint, beside what the simulator knows itself.

    Attributes
    ----------
    laws
        Their forces add up. A simulator in machine code takes them from here; one in Python calls `started`.

    Examples
    --------
    >>> def viscous(d, s, t, parameters, state, rates):
    ...     return parameters[0] * s
    >>> law = JointLaw(laws=(PortLaw(port=0, function=viscous, parameters=(2.0,)),)).started()
    >>> law(0.1, 3.0, 0.0)
    6.0
    """

    laws: tuple[PortLaw, ...]

    def started(self) -> "RunningLaw":
        """Give the law at the start of a run, with states of its own."""
        return RunningLaw(self.laws)


class RunningLaw:
    """A joint's law during one run: call it once a step, with time running forward."""

    __slots__ = ("_laws", "_states", "_time_s", "trace")

    def __init__(self, laws: Sequence[PortLaw]) -> None:
        self._laws = laws
        self._states = [list(law.state) for law in laws]
        self._time_s: float | None = None
        #: Time, displacement, velocity and force of each call.
        self.trace: list[tuple[float, float, float, float]] = []

    def __call__(self, d: float, s: float, t: float) -> float:
        """Give the force that resists: it acts with the opposite sign on the joint's second body.

        Parameters
        ----------
        d, s
            Displacement and velocity of the joint, second body against first; rad and rad/s where it rotates.
        t
            Seconds from the start of the log. The laws' states move on by what has passed since the last call.
        """
        step_s = 0.0 if self._time_s is None else t - self._time_s
        self._time_s = t
        force = 0.0
        for law, state in zip(self._laws, self._states, strict=True):
            _advance(law, state, d, s, t, step_s)
            force += law.function(d, s, t, law.parameters, state, [0.0] * len(state))
        self.trace.append((t, d, s, force))
        return force


def _advance(law: PortLaw, state: list[float], d: float, s: float, t: float, step_s: float) -> None:
    """Move a law's states by one step, in place."""
    if not state or step_s <= 0:
        return
    rates = [0.0] * len(state)
    law.function(d, s, t, law.parameters, state, rates)
    moved = []
    # A bristle bends within microns, far stiffer than the simulator's step: linearly implicit, state by state.
    for place, value in enumerate(state):
        nudge = NUDGE * max(abs(value), LEAST_STATE)
        nudged, rates_there = list(state), [0.0] * len(state)
        nudged[place] = value + nudge
        law.function(d, s, t, law.parameters, nudged, rates_there)
        slope = min((rates_there[place] - rates[place]) / nudge, 0.0)
        moved.append(value + step_s * rates[place] / (1.0 - step_s * slope))
    state[:] = moved

"""A Python function as a simulator."""

from collections.abc import Mapping
from dataclasses import dataclass
from threading import Lock
from typing import Protocol

import numpy as np

from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Port, Terminal
from chladni.models.core.simulation import PortMotion
from chladni.models.simulators.joint_law import JointLaw, RunningLaw
from chladni.models.simulators.simulator import SimulatorResponse
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: Nobody's function needs to bear being called by several threads at once.
_ONE_AT_A_TIME = Lock()


class SimulatorFunction(Protocol):
    """What `callable_simulator` takes."""

    def __call__(
        self,
        inputs: Real,
        sample_rate_hz: float,
        values: Mapping[str, float],
        joint_laws: Mapping[str, RunningLaw],
    ) -> Real:
        """Give ``[output, sample]`` for ``[input, sample]``; `values` holds every parameter, by name.

        At each of its steps the function asks each law ``law(d, s, t) -> force`` for the force that resists the
        joint's motion, with time from 0 on; a function without joints is given none.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class CallableSimulator:
    """Implements `Simulator` by a `SimulatorFunction`; made by `callable_simulator`."""

    name: str
    parameters: Parameters
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    joints: tuple[Port, ...]
    function: SimulatorFunction

    def respond(
        self,
        inputs: Real,
        sample_rate_hz: float,
        *,
        values: Mapping[str, float],
        joint_laws: Mapping[str, JointLaw],
    ) -> SimulatorResponse:
        """Call the function.

        Raises
        ------
        ModelError
            When it gives another shape than ``[output, sample]``, numbers that aren't finite, or asks no law.
        """
        running = {name: law.started() for name, law in joint_laws.items()}
        numbers = self.parameters.with_values(values).numbers()
        try:
            # A run that leaves the numbers is told below, once.
            with _ONE_AT_A_TIME, np.errstate(all="ignore"):
                outputs = np.asarray(self.function(inputs, sample_rate_hz, numbers, running), dtype=np.float64)
        except ArithmeticError as error:
            raise ModelError(f"simulator {self.name!r}: its function diverges ({error})") from error
        expected = (len(self.outputs), inputs.shape[1])
        if outputs.shape != expected:
            raise ModelError(
                f"simulator {self.name!r}: its function gave shape {outputs.shape}; [output, sample] = {expected} "
                "was expected"
            )
        bad = np.argwhere(~np.isfinite(outputs))
        if bad.size:
            row, sample = bad[0]
            raise ModelError(
                f"simulator {self.name!r}: output {self.outputs[row].name!r} is {outputs[row, sample]} at "
                f"{sample / sample_rate_hz:g} s; it diverges, or its inputs are in other units"
            )
        times_s = np.arange(inputs.shape[1]) / sample_rate_hz
        return SimulatorResponse(
            outputs=outputs,
            motions=tuple(self._motion(name, law, times_s) for name, law in running.items()),
        )

    def _motion(self, name: str, law: RunningLaw, times_s: Real) -> PortMotion:
        if not law.trace:
            raise ModelError(
                f"simulator {self.name!r}: its function never asked the law at joint {name!r}; call "
                f"joint_laws[{name!r}](d, s, t) at each step, or leave the joint out"
            )
        # The function's steps need not fall on samples.
        asked = np.array(law.trace)
        rows = [np.interp(times_s, asked[:, 0], asked[:, column]) for column in (1, 2, 3)]
        return PortMotion(name=name, kind="joint", displacement=rows[0], velocity=rows[1], force=rows[2])


def callable_simulator(
    function: SimulatorFunction,
    *,
    name: str,
    inputs: tuple[Terminal, ...],
    outputs: tuple[Terminal, ...],
    joints: tuple[Port, ...] = (),
    parameters: Parameters | None = None,
) -> CallableSimulator:
    """Let a Python function stand in for a model.

    Parameters
    ----------
    function
        ``function(inputs, sample_rate_hz, values, joint_laws) -> outputs``, see `SimulatorFunction`. It must be
        pure: the same arguments give the same answer.
    name
        For people.
    inputs, outputs
        Names, SI units and the channels of the log.
    joints
        Places where the function asks laws for a force: ``Port(name="elbow", kind="joint", unit="N m", ...)``.
    parameters
        What may be tuned, each with its tolerance; nothing by default.

    Raises
    ------
    ModelError
        When a name is used twice, or a joint is of another kind.

    Examples
    --------
    >>> def halve(inputs, sample_rate_hz, values, joint_laws):
    ...     return values["gain"] * inputs
    >>> from chladni.models.core.parameter import Parameter
    >>> half = callable_simulator(
    ...     halve,
    ...     name="half",
    ...     inputs=(Terminal(name="u", unit="N"),),
    ...     outputs=(Terminal(name="y", unit="N"),),
    ...     parameters=Parameters((Parameter(name="gain", value=0.5, low=0.1, high=1.0),)),
    ... )
    >>> half.respond(np.array([[2.0, 4.0]]), 10.0, values={"gain": 0.25}, joint_laws={}).outputs
    array([[0.5, 1. ]])
    """
    names = [*(each.name for each in (*inputs, *outputs)), *(each.name for each in joints)]
    for each in names:
        if names.count(each) > 1:
            raise ModelError(f"simulator {name!r}: the name {each!r} is used twice; a site is told by its name alone")
    for joint in joints:
        if joint.kind != "joint":
            raise ModelError(f"simulator {name!r}: {joint.name!r} is of kind {joint.kind}; laws act at a joint")
    return CallableSimulator(
        name=name,
        parameters=parameters or Parameters(()),
        inputs=inputs,
        outputs=outputs,
        joints=joints,
        function=function,
    )

"""What a simulator has to offer to take part in a diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, Self, runtime_checkable

from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Port, Terminal
from chladni.models.core.simulation import PortMotion
from chladni.models.simulators.joint_law import JointLaw
from chladni.signals.arrays import Real
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SimulatorResponse(Value):
    """What a simulator answers.

    Attributes
    ----------
    outputs
        ``[output, sample]`` in the order of the simulator's outputs, SI.
    motions
        Displacement, velocity and force at each joint that carried a law, sample by sample.
    """

    outputs: Real
    motions: tuple[PortMotion, ...] = ()

    def __post_init__(self) -> None:
        self._freeze()


class Simulator(Protocol):
    """A system that only a program of somebody else can simulate.

    `callable_simulator` and `mujoco_simulator` make one; a class of your own with these members is one too.
    """

    @property
    def name(self) -> str:
        """Its name, for people."""

    @property
    def parameters(self) -> Parameters:
        """The numbers that may be tuned, with their tolerances; may be empty."""

    @property
    def inputs(self) -> tuple[Terminal, ...]:
        """What drives it, and the channels of a log that hold it."""

    @property
    def outputs(self) -> tuple[Terminal, ...]:
        """What its sensors give, and the channels of a log that hold it."""

    @property
    def joints(self) -> tuple[Port, ...]:
        """Places where a law of force can act between two bodies, of kind ``joint``; may be empty."""

    def respond(
        self,
        inputs: Real,
        sample_rate_hz: float,
        *,
        values: Mapping[str, float],
        joint_laws: Mapping[str, JointLaw],
    ) -> SimulatorResponse:
        """Simulate from the start of the log; pure: the same arguments give the same answer.

        Parameters
        ----------
        inputs
            ``[input, sample]``, SI.
        sample_rate_hz
            Of inputs and outputs.
        values
            Parameters that differ from `parameters`, by name.
        joint_laws
            By joint; each must be asked at every step, see `JointLaw`.

        Raises
        ------
        ModelError
            When the simulation diverges.
        """


@runtime_checkable
class RefinableSimulator(Simulator, Protocol):
    """A simulator that can tell the error of its own step."""

    def refined(self) -> Self:
        """Give the same with steps half as long."""

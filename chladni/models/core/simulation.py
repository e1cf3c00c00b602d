"""What a simulation gives: signals, motion at the ports, and how it was made."""

from dataclasses import dataclass

from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PortMotion(Value):
    """What happened at a port that carries laws.

    Attributes
    ----------
    name, kind
        The port, see `chladni.models.core.port.Port`.
    displacement, velocity
        ``[sample]``.
    force
        ``[sample]``: the sum of the port's laws, without the linear spring and damper.
    """

    name: str
    kind: str
    displacement: Real
    velocity: Real
    force: Real

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Simulation(Value):
    """Result of `simulate`.

    Attributes
    ----------
    model
        Name of the model.
    inputs
        What drove it, as commanded: before any effect at an input. Channels are named by the log's channel where
        the model gives one, else by the input.
    outputs
        What its sensors would record, named likewise.
    states
        ``[state, sample]`` of the linear part.
    state_names
        One for each row of `states`.
    motions
        One for each port that carries a law.
    flags
        Sentences about where the model left its validity.
    refined_steps
        Steps between samples that were halved because a law was stiff or switched.
    """

    model: str
    inputs: TimeSeries
    outputs: TimeSeries
    states: Real
    state_names: tuple[str, ...]
    motions: tuple[PortMotion, ...] = ()
    flags: tuple[str, ...] = ()
    refined_steps: int = 0

    def __post_init__(self) -> None:
        self._freeze()

    def motion(self, name: str) -> PortMotion:
        """Motion at the named port; `ModelError` naming those there are when it's missing."""
        for motion in self.motions:
            if motion.name == name:
                return motion
        raise ModelError(
            f"no law acts at {name!r}; laws act at: {', '.join(motion.name for motion in self.motions) or 'no port'}"
        )

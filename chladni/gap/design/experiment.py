"""An experiment that could be done next: what it changes, what drives the machine in it, and what it would bring."""

from dataclasses import dataclass
from typing import Literal

from chladni.gap.calibration import BEYOND_DOUBT
from chladni.models.core.model import Model
from chladni.signals.arrays import Real
from chladni.signals.value import Value

Change = Literal["nothing", "level", "repeats", "band", "sweep", "slow", "sensor", "position"]

_KINDS: tuple[tuple[Change, ...], ...] = (
    ("nothing",),
    ("level", "repeats"),
    ("band", "sweep", "slow"),
    ("sensor",),
    ("position",),
)
#: What changes ask of people, from a knob that is turned to a machine that is rebuilt: a rank.
EFFORT = {change: float(rank) for rank, kind in enumerate(_KINDS) for change in kind}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Experiment(Value):
    """One way to measure again.

    Attributes
    ----------
    words
        What to do, as the beginning of a sentence.
    model
        With the inputs where they act in this experiment.
    inputs
        ``[input, sample]``, SI.
    start
        Times the initial states of the log; 0 from rest.
    repeats
        Records of the same input that are averaged.
    further
        Added to the effort of its kind: a level that is changed more, more records.
    """

    change: Change
    words: str
    model: Model
    inputs: Real
    start: float = 0.0
    repeats: int = 1
    further: float = 0.0

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def effort(self) -> float:
        """Rank among changes, the least first."""
        return EFFORT[self.change] + self.further


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """One further measurement.

    Attributes
    ----------
    change, words
        What is done differently.
    effort
        Rank among changes, the least first.
    nats, now_nats
        Log evidence between the best candidate and the nearest of the others that is expected of a log like the one
        at hand and this measurement together, and of such a log alone.
    """

    change: Change
    words: str
    effort: float
    nats: float
    now_nats: float

    @property
    def tells(self) -> bool:
        """Whether it tells candidates apart that the log leaves close."""
        return self.nats > 2.0 * self.now_nats + BEYOND_DOUBT

    @property
    def sigmas(self) -> float:
        """As many standard deviations of a normal error have the same log evidence, ``sqrt(2 nats)``."""
        return float((2.0 * self.nats) ** 0.5)

    @property
    def now_sigmas(self) -> float:
        """The same of a log like the one at hand."""
        return float((2.0 * self.now_nats) ** 0.5)

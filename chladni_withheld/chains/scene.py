"""A hidden effect whose size is still open, and what it is drawn from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from chladni_withheld.chains.plan import Bench, Hidden


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """An effect of any size: a larger `size` moves the outputs more.

    Attributes
    ----------
    hidden
        ``hidden(size)``, the effect itself.
    least, most
        Sizes between which it is what its word says.
    """

    hidden: Callable[[float], Hidden]
    least: float = 1e-3
    most: float = 30.0


def draft(effect: str, site: str, law: str, numbers: Callable[[float], Mapping[str, float]], *, least: float = 1e-3,
          most: float = 30.0, source: str = "") -> Draft:  # fmt: skip
    """Give the draft of a law whose numbers follow from the size."""

    def hidden(size: float) -> Hidden:
        return Hidden(effect=effect, site=site, law=law, numbers=numbers(size), source=source)

    return Draft(hidden=hidden, least=least, most=most)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What a draft is drawn from: the bench without the effect, and how strongly everything there moves.

    Attributes
    ----------
    numbers
        True numbers of the plan.
    moving
        RMS of what `simulation.built` watches, and of the outputs: ``joint1.d``, ``input1.u``, ``sensor1``.
    """

    bench: Bench
    numbers: Mapping[str, float]
    moving: Mapping[str, float]
    rng: np.random.Generator = field(default_factory=np.random.default_rng)

    @property
    def interval(self) -> float:
        """Seconds between samples."""
        return 1.0 / self.bench.rate_hz

    @property
    def seconds(self) -> float:
        """Length of the log."""
        return self.bench.samples / self.bench.rate_hz

    def between(self, low: float, high: float) -> float:
        """Draw evenly."""
        return float(self.rng.uniform(low, high))

    def about(self, low: float, high: float) -> float:
        """Draw evenly in the logarithm."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def sign(self) -> float:
        """Plus or minus one."""
        return float(self.rng.choice((-1.0, 1.0)))

    def one_of(self, *words: str) -> str:
        """Draw a word."""
        return str(self.rng.choice(words))

    def ripple_shape(self) -> dict[str, float]:
        """Draw a phase, and shares and phases of a second and third harmonic: teeth are no sines."""
        return {
            "phase": self.between(-3, 3),
            "second": self.between(0.05, 0.3), "second_phase": self.between(-3, 3),
            "third": self.between(0.02, 0.12), "third_phase": self.between(-3, 3),
        }  # fmt: skip

    def force_at(self, joint: str) -> float:
        """RMS force that a joint holds: its spring's, or where it has none what the inputs push."""
        held = self.stiffness(joint) * self.moving[f"{joint}.d"]
        pushed = max((value for name, value in self.moving.items() if name.endswith(".u")), default=0.0)
        return float(held) if held > 0 else float(self.moving.get("drive.force", pushed))

    def mass(self, body: str) -> float:
        """True mass or inertia of a body."""
        return self.numbers[self.bench.plan.inertia_of(body)]

    def stiffness(self, joint: str) -> float:
        """True stiffness of a joint; zero at a free guide and in a drive."""
        return self.bench.plan.of_joint(self.numbers, joint, "stiffness")


#: Draws an effect at a site.
Drafter = Callable[[Scene, str], Draft]

"""Trials: an effect's force along a motion that is known, before any simulation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, PortKind
from chladni.signals.arrays import Complex, Real

Numbers = Mapping[str, float]
#: What enters an effect's law nonlinearly: logarithms, but for angles and the like.
Shape = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Force:
    """Force of a law at a port, but for some amplitudes.

    Attributes
    ----------
    fixed
        ``[line]`` spectrum of the part that has no free amplitude, or None.
    basis
        ``[amplitude, line]`` spectra of the parts whose amplitudes are found by regression.
    """

    fixed: Complex | None = None
    basis: Complex

    @classmethod
    def of(cls, *parts: Complex) -> "Force":
        """Give a force of free amplitudes."""
        return cls(basis=np.stack(parts))

    @classmethod
    def known(cls, spectrum: Complex) -> "Force":
        """Give a force without free amplitudes."""
        return cls(fixed=spectrum, basis=np.zeros((0, spectrum.size), dtype=np.complex128))


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One form of an effect at a site: a family of laws over a few numbers.

    Attributes
    ----------
    variant, source
        As `chladni.attached` takes them.
    build
        ``build(shape)`` gives the force along the known motion, see `Shape`.
    grid
        Shapes to begin with: one that is empty when nothing enters nonlinearly.
    values
        ``values(shape, amplitudes)`` gives the effect's parameters, or None where they make no such effect.
    parameters
        How many numbers the effect has in all: what its freedom costs.
    """

    variant: str | None = None
    source: str | None = None
    build: Callable[[Shape], Force]
    grid: Sequence[Shape] = field(default=((),))
    values: Callable[[Shape, Real], Numbers | None]
    parameters: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrialMotion:
    """What sensors tell of the motion at a site, along which trials go.

    Attributes
    ----------
    name, kind
        The site.
    compiled
        The model without the effect.
    force
        ``[sample]`` that the model lacks there, as in `Port`: a joint's resists, an input's adds to the command, an
        output's to what is measured.
    displacement, velocity
        ``[sample]`` at the port; of an input the command, of an output the signal without its error.
    sample_rate_hz
        Samples a second.
    frequency_hz
        ``[line]`` on which forces are weighed.
    believed
        ``[line]`` share of the force's power that is no noise.
    spectrum
        ``spectrum(signal)`` gives ``[line]`` of a signal ``[sample]``.
    band_hz
        Where the excitation has power.
    outputs
        ``[sample]`` that each sensor showed, by name.
    position_at
        ``position_at(port)`` gives ``[sample]`` the displacement at another port of the model.
    """

    name: str
    kind: PortKind
    compiled: CompiledModel
    force: Real
    displacement: Real
    velocity: Real
    sample_rate_hz: float
    frequency_hz: Real
    believed: Real
    spectrum: Callable[[Real], Complex]
    band_hz: tuple[float, float]
    outputs: Mapping[str, Real]
    position_at: Callable[[int], Real]

    @property
    def time_s(self) -> Real:
        """``[sample]`` from the start of the record."""
        return np.asarray(np.arange(self.force.size) / self.sample_rate_hz, dtype=np.float64)

    @property
    def s(self) -> Complex:
        """``[line]`` j omega."""
        return np.asarray(2j * np.pi * self.frequency_hz, dtype=np.complex128)

    @property
    def port(self) -> Port:
        """The site's port, with the spring and the damper that the model gives a joint."""
        return self.compiled.ports[self.compiled.port_index(self.name, self.kind)]

    @property
    def is_still(self) -> bool:
        """Whether no signal is there that an effect could change."""
        return not np.any(self.displacement)


def logarithms(*axes: Sequence[float]) -> tuple[Shape, ...]:
    """Give every combination of positive numbers, as logarithms.

    Examples
    --------
    >>> logarithms((1.0,), (1.0, 1.0))
    ((0.0, 0.0), (0.0, 0.0))
    """
    shapes: list[Shape] = [()]
    for axis in axes:
        shapes = [(*shape, float(np.log(value))) for shape in shapes for value in axis]
    return tuple(shapes)


def numbers(shape: Shape) -> list[float]:
    """Give the positive numbers of a shape."""
    return [float(np.exp(one)) for one in shape]


def proportional(spectrum: Complex, name: str, *, sign: float = 1.0) -> Trial:
    """Give the trial of a force that one number is the factor of; it must have the sign."""
    return Trial(
        build=lambda _: Force.of(spectrum),
        values=lambda _, a: {name: float(a[0])} if sign * a[0] > 0 else None, parameters=1,
    )  # fmt: skip


def shaped(force: Callable[[float], Complex], grid: Sequence[float], name: str, variant: str | None = None) -> Trial:
    """Give the trial with one number and no free amplitude: what acts is a signal in another shape."""
    return Trial(
        variant=variant, build=lambda shape: Force.known(force(numbers(shape)[0])),
        grid=logarithms(grid), values=lambda shape, _: {name: numbers(shape)[0]}, parameters=1,
    )  # fmt: skip


def positive(amplitudes: Real, **values: float) -> Numbers | None:
    """Give the values as they are where the first amplitude is positive, else None."""
    return {name: float(value) for name, value in values.items()} if amplitudes[0] > 0 else None


def rms(signal: Real) -> float:
    """Give the root mean square; 1 of a signal without any, whose size no grid could follow."""
    return float(np.sqrt(np.mean(signal**2))) or 1.0

"""Trials: effects with the force that they would give along a recovered motion, before any simulation."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.gap.plant.places import Site

Matrix = NDArray[np.float64]
Spectrum = NDArray[np.complex128]
Numbers = Mapping[str, float]
#: Logarithms of what enters an effect's law nonlinearly.
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

    fixed: Spectrum | None = None
    basis: Spectrum

    @classmethod
    def of(cls, *parts: Spectrum) -> "Force":
        """Give a force of free amplitudes."""
        return cls(basis=np.stack(parts))

    @classmethod
    def known(cls, spectrum: Spectrum) -> "Force":
        """Give a force without free amplitudes."""
        return cls(fixed=spectrum, basis=np.zeros((0, spectrum.size), dtype=np.complex128))


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One form of an effect at one site: a family of laws over a few numbers.

    Attributes
    ----------
    effect, site, variant, source
        As `chladni.attached` takes them; `site` with its kind.
    build
        ``build(shape)`` gives the force along the recovered motion; `shape` holds logarithms.
    grid
        Shapes to begin with: one that is empty when nothing enters nonlinearly.
    values
        ``values(shape, amplitudes)`` gives the effect's parameters, or None where they make no such effect.
    parameters
        How many numbers the effect has in all: what its freedom costs.
    """

    effect: str
    site: Site
    variant: str | None = None
    source: str | None = None
    build: Callable[[Shape], Force]
    grid: Sequence[Shape] = field(default=((),))
    values: Callable[[Shape, Matrix], Numbers | None]
    parameters: int


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

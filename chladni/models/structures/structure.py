"""Lumped structures: bodies that move along one axis, joined by springs and dampers."""

from copy import copy
from dataclasses import dataclass
from math import pi
from typing import Literal, Self

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Vector
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

GROUND = "ground"

Motion = Literal["translation", "rotation"]

# A double pole at zero, such as of a free body, comes out as a pair that is apart by the root of the rounding.
AT_REST = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A rigid body with one degree of freedom.

    Attributes
    ----------
    mass
        In kg; of a body that rotates its moment of inertia in kg m^2.
    position
        In m, for drawing only.
    motion
        Along an axis, or about one.
    """

    name: str
    mass: float
    position: Vector = (0.0, 0.0, 0.0)
    motion: Motion = "translation"

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass > 0):
            what, unit = ("mass", "kg") if self.motion == "translation" else ("inertia", "kg m^2")
            raise ModelError(f"body {self.name!r}: {what} {self.mass} {unit} must be finite and positive")


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """A spring and a damper in parallel between two bodies, or between ``ground`` and a body.

    In N/m and N s/m; between bodies that rotate in N m/rad and N m s/rad.
    """

    name: str
    between: tuple[str, str]
    stiffness: float
    damping: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "between", tuple(self.between))
        for what, number in (("stiffness", self.stiffness), ("damping", self.damping)):
            if not (np.isfinite(number) and number >= 0):
                raise ModelError(f"joint {self.name!r}: {what} {number} must be finite and not negative")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NaturalModes(Value):
    """Closed-form modes of a structure, by rising frequency.

    Attributes
    ----------
    frequency_hz
        ``[mode]``, undamped natural frequency abs(pole)/(2 pi).
    damping_ratio
        ``[mode]``, -Re(pole)/abs(pole).
    shapes
        ``[mode, body]`` complex, largest component 1.
    """

    frequency_hz: Real
    damping_ratio: Real
    shapes: Complex

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True)
class Structure:
    """Bodies and joints: M x'' + C x' + K x = f.

    Raises
    ------
    ModelError
        When names repeat, a joint names a body that isn't there, has one thing at both ends, or joins a body that
        moves along the axis to one that rotates about it.

    Examples
    --------
    >>> one = Structure(
    ...     bodies=(Body(name="mass", mass=1.0),),
    ...     joints=(Joint(name="spring", between=("ground", "mass"), stiffness=(2 * pi * 10) ** 2, damping=0.0),),
    ... )
    >>> one.natural_modes().frequency_hz.round(6)
    array([10.])
    """

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]

    def __post_init__(self) -> None:
        # A structure is the key of its equations, which a list can't be.
        for name in ("bodies", "joints"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        taken = {GROUND}
        for name in [*(body.name for body in self.bodies), *(joint.name for joint in self.joints)]:
            if name in taken:
                raise ModelError(f"the name {name!r} is taken; names are unique and {GROUND!r} is reserved")
            taken.add(name)
        for joint in self.joints:
            self._require_ends(joint)

    def with_parts(self, bodies: tuple[Body, ...], joints: tuple[Joint, ...]) -> Self:
        """Give the structure with other numbers: parts of the same names, ends and motions, in the same order."""
        # What was checked when it was wired holds for any numbers.
        other = copy(self)
        object.__setattr__(other, "bodies", bodies)
        object.__setattr__(other, "joints", joints)
        return other

    def mass_matrix(self) -> Real:
        """``[body, body]`` in kg."""
        return np.diag([body.mass for body in self.bodies])

    def stiffness_matrix(self) -> Real:
        """``[body, body]`` in N/m."""
        return self._assemble([joint.stiffness for joint in self.joints])

    def damping_matrix(self) -> Real:
        """``[body, body]`` in N s/m."""
        return self._assemble([joint.damping for joint in self.joints])

    def receptance(self, frequency_hz: Real) -> Complex:
        """Displacement of each body per force on each body, (K + j omega C - omega^2 M)^-1.

        Parameters
        ----------
        frequency_hz
            ``[frequency]``.

        Returns
        -------
        ``[body, body, frequency]`` in m/N.
        """
        omega = 2 * pi * frequency_hz[:, None, None]
        elastic = self.stiffness_matrix() + 1j * omega * self.damping_matrix()
        inverse = np.asarray(np.linalg.inv(elastic - omega**2 * self.mass_matrix()), dtype=np.complex128)
        return np.moveaxis(inverse, 0, -1)

    def accelerance(self, frequency_hz: Real) -> Complex:
        """Acceleration of each body per force on each body, ``[body, body, frequency]`` in (m/s^2)/N."""
        return self.receptance(frequency_hz) * -((2 * pi * frequency_hz) ** 2)

    def natural_modes(self) -> NaturalModes:
        """Modes from the eigenvalues of the state matrix (Ewins 2000, section 2.7)."""
        count = len(self.bodies)
        inverse_mass = np.linalg.inv(self.mass_matrix())
        state = np.block(
            [
                [np.zeros((count, count)), np.eye(count)],
                [-inverse_mass @ self.stiffness_matrix(), -inverse_mass @ self.damping_matrix()],
            ]
        )
        poles, vectors = np.linalg.eig(state)
        oscillating = np.flatnonzero(poles.imag > AT_REST * np.abs(poles).max(initial=0.0))
        chosen = oscillating[np.argsort(np.abs(poles[oscillating]))]
        shapes = vectors[:count, chosen].T
        largest = np.argmax(np.abs(shapes), axis=1, keepdims=True)
        return NaturalModes(
            frequency_hz=np.abs(poles[chosen]) / (2 * pi),
            damping_ratio=-poles[chosen].real / np.abs(poles[chosen]),
            shapes=shapes / np.take_along_axis(shapes, largest, axis=1),
        )

    def acceleration(self, force: Real, *, at: str, sample_rate_hz: float) -> Real:
        """Steady acceleration of every body under a force that repeats with the record.

        The product with the accelerance at each line of the record's Fourier series is exact for such a force:
        no hold, no transient, no integration error.

        Parameters
        ----------
        force
            ``[sample]`` in N, taken as one period and without content at or above half the sample rate.
        at
            Body that the force acts on.
        sample_rate_hz
            Samples a second.

        Returns
        -------
        ``[body, sample]`` in m/s^2.
        """
        frequency_hz = np.asarray(np.fft.rfftfreq(force.size, 1 / sample_rate_hz), dtype=np.float64)
        # The static line of a free structure has no bounded displacement, but its acceleration is read at f > 0 only.
        accelerance = np.zeros((len(self.bodies), frequency_hz.size), dtype=complex)
        accelerance[:, 1:] = self.accelerance(frequency_hz[1:])[:, self.body_index(at)]
        return np.fft.irfft(accelerance * np.fft.rfft(force), n=force.size)

    def body_index(self, name: str) -> int:
        """Row of the named body; `ModelError` naming those there are when it's missing."""
        for row, body in enumerate(self.bodies):
            if body.name == name:
                return row
        raise ModelError(f"no body {name!r}; bodies: {', '.join(body.name for body in self.bodies)}")

    def pattern(self, between: tuple[str, str]) -> Real:
        """``[body]``: +1 at the second end, -1 at the first, 0 at the ground.

        The motion between two ends is its product with the motion of all bodies; a force between them acts along it.
        """
        pattern = np.zeros(len(self.bodies))
        for end, sign in zip(between, (-1.0, 1.0), strict=True):
            if end != GROUND:
                pattern[self.body_index(end)] += sign
        return pattern

    def joint_named(self, name: str) -> Joint:
        """Give the named joint; `ModelError` naming those there are when it's missing."""
        for joint in self.joints:
            if joint.name == name:
                return joint
        raise ModelError(f"no joint {name!r}; joints: {', '.join(joint.name for joint in self.joints) or 'none'}")

    def motion_of(self, joint: Joint) -> Motion:
        """Whether a joint is between bodies that translate or that rotate."""
        moving = next(end for end in joint.between if end != GROUND)
        return self.bodies[self.body_index(moving)].motion

    def _require_ends(self, joint: Joint) -> None:
        first, second = joint.between
        if first == second:
            raise ModelError(f"joint {joint.name!r}: both ends are {first!r}; a joint joins two different ones")
        try:
            motions = {self.bodies[self.body_index(end)].motion for end in joint.between if end != GROUND}
        except ModelError as error:
            raise ModelError(f"joint {joint.name!r}: {error}") from None
        if len(motions) > 1:
            raise ModelError(
                f"joint {joint.name!r}: {first!r} and {second!r} can't be joined, one translates and one rotates"
            )

    def _assemble(self, coefficients: list[float]) -> Real:
        # K = sum of k p p^T over the joints: symmetric, and without a row for the ground, which doesn't move.
        patterns = np.array([self.pattern(joint.between) for joint in self.joints])
        patterns = patterns.reshape(len(self.joints), len(self.bodies))
        matrix: Real = patterns.T @ (np.asarray(coefficients)[:, None] * patterns)
        return matrix

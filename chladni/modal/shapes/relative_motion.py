"""Motion of each body relative to its neighbour at each resonance."""

from dataclasses import dataclass
from math import hypot, isfinite, nan, pi, sqrt

import numpy as np

from chladni.modal.shapes.neighbours import Neighbours, neighbours
from chladni.signals.arrays import Complex, Real
from chladni.signals.geometry import Geometry
from chladni.signals.mode_set import ModeSet
from chladni.signals.relative_motion import RelativeMotion


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointMotion:
    """Motion of two neighbours along the common direction in which they move most against each other.

    Attributes
    ----------
    first, second
        Complex motion of either, in the scale of the shape.
    first_weights, second_weights
        ``[channel]`` real: `first` and `second` are these times the shape.
    """

    first: complex
    second: complex
    first_weights: Real
    second_weights: Real

    @property
    def weights(self) -> Real:
        """``[channel]`` real: `relative` is these times the shape."""
        return self.first_weights - self.second_weights

    @property
    def relative(self) -> complex:
        """Motion of the first relative to the second."""
        return self.first - self.second


def relative_motion(modes: ModeSet, geometry: Geometry) -> tuple[RelativeMotion, ...]:
    """Rank the joints of each mode by how far the two bodies move against each other.

    Parameters
    ----------
    geometry
        Its lines say who is whose neighbour; see `neighbours` for what is done without.

    Returns
    -------
    By mode, and within each mode the greatest ratio first; pairs without a common direction (ratio None) last.

    Notes
    -----
    ratio = abs(phi_a - phi_b)/max(abs(phi)), along one common direction. Of several common directions (triaxial
    sensors) the one with the greatest ratio is taken: the first left singular vector of [Re, Im] of the difference.
    Opposite directions are one axis with the sign changed; sensors that are turned against each other compare in the
    directions that both sets span. `ratio_std` takes the errors of the components as independent, which the
    components of one mode are roughly: they share only the one that is 1 by convention.

    The gains are those of a damper c and a spring k between the two, from the first-order change of the pole,
    delta lambda = -(c lambda + k) (delta psi)^2/a with modal A a (Adhikari 1999, AIAA Journal 37(11)). For a real
    shape of unit modal mass that is delta zeta = c (delta phi)^2/(2 omega), delta omega = k (delta phi)^2/(2 omega);
    in a complex mode a damper can do less than that, or even take damping away. Stated when the modes are scaled in
    kilograms: by a force in N and responses that are translations.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.provenance import Provenance
    >>> one = np.ones(1)
    >>> modes = ModeSet(
    ...     frequency_hz=10 * one, frequency_std_hz=0.01 * one, damping_ratio=0.01 * one, damping_std=1e-4 * one,
    ...     shapes=np.array([[1.0, 0.8, -0.5]], complex), shape_std=np.zeros((1, 3), complex),
    ...     channels=tuple(Channel(name=name) for name in ("/base.x", "/arm.x", "/wrist.x")), provenance=Provenance(),
    ... )
    >>> [(joint.between, round(joint.ratio, 2)) for joint in relative_motion(modes, Geometry())]
    [(('/arm.x', '/wrist.x'), 1.3), (('/base.x', '/arm.x'), 0.2)]
    """
    pairs = neighbours(modes.channels, geometry)
    mass = kilogram_scale(modes)
    found = []
    for mode in range(modes.frequency_hz.size):
        joints = [_joint(modes, mode, pair, float(mass[mode])) for pair in pairs]
        # A ratio that isn't there ranks below zero.
        found += sorted(joints, key=lambda joint: -1.0 if joint.ratio is None else joint.ratio, reverse=True)
    return tuple(found)


def joint_motion(shape: Complex, pair: Neighbours) -> JointMotion | None:
    """Give the motion of two neighbours in one shape ``[channel]``; None without a common direction."""
    if pair.first.shape[0] == 0:
        return None
    difference = (pair.first - pair.second) @ shape
    # Real and imaginary part are the motion at two moments a quarter of a period apart: one direction serves both.
    left, _, _ = np.linalg.svd(np.stack([difference.real, difference.imag], axis=1))
    along = left[:, 0]
    first, second = along @ pair.first, along @ pair.second
    return JointMotion(
        first=complex(first @ shape), second=complex(second @ shape), first_weights=first, second_weights=second
    )


def magnitude_std(value: complex, std_real: float, std_imag: float) -> float:
    """One sigma of abs(value) from those of its parts, taken as independent."""
    size = abs(value)
    if size == 0:
        # No direction to project on: the mean over all directions.
        return hypot(std_real, std_imag) / sqrt(2)
    return hypot(value.real / size * std_real, value.imag / size * std_imag)


def kilogram_scale(modes: ModeSet) -> Real:
    """``[mode]`` modal mass in kg, NaN where the modes have none, or one in other units."""
    unknown = np.full(modes.frequency_hz.size, nan)
    if modes.scale is None:
        return unknown
    force = [channel.unit for channel in modes.references if channel.name == modes.scale.reference]
    motion = [channel.unit for channel in modes.channels if channel.name == modes.scale.response]
    if force != ["N"] or not motion or motion[0] not in ("m", "m/s", "m/s^2"):
        return unknown
    mass = modes.scale.modal_mass
    return np.where(np.isfinite(mass) & (mass > 0), mass, nan)


def _joint(modes: ModeSet, mode: int, pair: Neighbours, mass: float) -> RelativeMotion:
    shape = modes.shapes[mode].astype(np.complex128)
    motion = joint_motion(shape, pair)
    if motion is None:
        return RelativeMotion(mode=mode, between=pair.between, ratio=None, ratio_std=None)
    largest = float(np.max(np.abs(shape)))
    std_real = float(np.linalg.norm(motion.weights * modes.shape_std[mode].real))
    std_imag = float(np.linalg.norm(motion.weights * modes.shape_std[mode].imag))
    std = magnitude_std(motion.relative, std_real, std_imag) / largest
    gain, stiffness_gain_hz = _gains(modes, mode, motion, mass)
    return RelativeMotion(
        mode=mode,
        between=pair.between,
        ratio=abs(motion.relative) / largest,
        ratio_std=std if isfinite(std) else None,
        damping_gain=gain,
        stiffness_gain_hz=stiffness_gain_hz,
    )


def _gains(modes: ModeSet, mode: int, motion: JointMotion, mass: float) -> tuple[float | None, float | None]:
    """Added damping ratio per N s/m and natural frequency in Hz per N/m, from the change of the pole."""
    used = np.flatnonzero(motion.weights)
    # In radians delta phi would make the gain one for a rotary damper.
    translations = all(modes.channels[row].unit in ("m", "m/s", "m/s^2") for row in used)
    if not (isfinite(mass) and translations) or modes.scale is None:
        return None, None
    damping = float(modes.damping_ratio[mode])
    swing = sqrt(1 - damping**2)
    # The change of the pole is -lambda times this for each N s/m, and minus this for each N/m.
    reach = motion.relative**2 / complex(modes.scale.modal_a[mode])
    along_pole = -damping * reach.real + swing * reach.imag
    return -swing * reach.imag, -along_pole / (2 * pi)

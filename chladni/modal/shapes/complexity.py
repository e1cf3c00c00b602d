"""How far a modal vector is from one whose points all move in phase or against phase."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value

# Below the smallest normal number a quotient overflows; no motion is that small.
_LEAST = np.finfo(np.float64).tiny


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeanPhase(Value):
    """The straight line through the origin of the complex plane that fits a shape best.

    Attributes
    ----------
    phase_deg
        ``[mode]`` direction of the line, above -90 to 90 degrees; NaN for a single channel, as the deviation.
    deviation_deg
        ``[mode]`` mean phase deviation (MPD) from it, weighted by amplitude: 0 for a shape in one phase, 45 for one
        whose phases are spread evenly.
    """

    phase_deg: Real
    deviation_deg: Real

    def __post_init__(self) -> None:
        self._freeze()


def phase_collinearity(shapes: ArrayLike) -> Real:
    """Modal phase collinearity (MPC): 1 for shapes that move in one phase, 0 for phases without direction.

    Pappa, Elliott & Schenk (1993), "Consistent-mode indicator for the eigensystem realization algorithm", J.
    Guidance, Control and Dynamics 16(5): with eigenvalues l1 >= l2 of the matrix of second moments of real and
    imaginary parts, MPC = ((l1 - l2)/(l1 + l2))^2, which is abs(phi^T phi)^2/(phi^H phi)^2. Moments are about the
    origin, not about the mean: a body that moves as one is as collinear as any.

    Parameters
    ----------
    shapes
        ``[mode, channel]`` real or complex; a single shape ``[channel]`` counts as one mode.

    Returns
    -------
    ``[mode]``, 0 to 1; NaN for a single channel, whose one component has no phase to compare with.

    Raises
    ------
    EstimateError
        When a shape is zero, has no channel, or holds NaN or infinity.

    Examples
    --------
    >>> phase_collinearity([[1.0, -0.5], [1.0, 1j]])
    array([1., 0.])
    """
    phi = _scaled(shapes)
    if phi.shape[1] == 1:
        return np.full(len(phi), np.nan)
    lengths = np.sum(np.abs(phi) ** 2, axis=1)
    collinearity: Real = (np.abs(np.sum(phi**2, axis=1)) / lengths) ** 2
    return np.minimum(collinearity, 1.0)


def mean_phase(shapes: ArrayLike) -> MeanPhase:
    """Mean phase and mean phase deviation of each shape.

    The line is the first right singular vector of [Re phi, Im phi]: it has the least summed squares of distances
    (Heylen, Lammens & Sas 1997; Reynders, Houbrechts & De Roeck 2012, Mech. Syst. Signal Process. 29).

    Parameters
    ----------
    shapes
        ``[mode, channel]`` real or complex; a single shape ``[channel]`` counts as one mode.

    Raises
    ------
    EstimateError
        When a shape is zero, has no channel, or holds NaN or infinity.

    Examples
    --------
    >>> found = mean_phase([1 + 1j, -2 - 2j])
    >>> found.phase_deg.round(9), found.deviation_deg.round(9)
    (array([45.]), array([0.]))
    """
    phi = _scaled(shapes)
    if phi.shape[1] == 1:
        return MeanPhase(phase_deg=np.full(len(phi), np.nan), deviation_deg=np.full(len(phi), np.nan))
    _, _, right = np.linalg.svd(np.stack([phi.real, phi.imag], axis=2), full_matrices=False)
    cosine, sine = right[:, 0, 0], right[:, 0, 1]
    turned = phi * (cosine - 1j * sine)[:, None]
    # The arc tangent keeps all digits near 0 and 90 degrees, where the arc cosine of the ratio loses half of them.
    deviation = np.arctan2(np.abs(turned.imag), np.abs(turned.real))
    weight = np.abs(phi)
    phase_deg = np.degrees(np.arctan2(sine, cosine))
    # A line has two directions; the one to the right is given.
    phase_deg = np.where(
        phase_deg > 90.0, phase_deg - 180.0, np.where(phase_deg <= -90.0, phase_deg + 180.0, phase_deg)
    )
    return MeanPhase(
        phase_deg=phase_deg,
        deviation_deg=np.degrees(np.sum(weight * deviation, axis=1) / np.sum(weight, axis=1)),
    )


def deviation_from_noise(shapes: ArrayLike, shape_std: ArrayLike) -> Real:
    """Mean phase deviation that the uncertainty of a real shape gives alone.

    An error of standard deviation s across the line turns a component of amplitude A by s sqrt(2/pi)/A on average,
    which the weights A turn into sqrt(2/pi) sum(s)/sum(A), for small angles.

    Parameters
    ----------
    shapes, shape_std
        ``[mode, channel]``; one sigma of the real part + j one sigma of the imaginary part, as in `ModeSet`.

    Returns
    -------
    ``[mode]`` in degrees, at most 45; 0 where the uncertainty is unknown (NaN).
    """
    phi = _scaled(shapes)
    scale = np.max(np.abs(np.atleast_2d(np.asarray(shapes, dtype=np.complex128))), axis=1, keepdims=True)
    std = np.atleast_2d(np.asarray(shape_std, dtype=np.complex128)) / scale
    angle = np.radians(mean_phase(phi).phase_deg)[:, None]
    across = np.hypot(std.real * np.sin(angle), std.imag * np.cos(angle))
    angles = np.sqrt(2 / np.pi) * np.nansum(across, axis=1) / np.sum(np.abs(phi), axis=1)
    return np.asarray(np.minimum(np.degrees(angles), 45.0), dtype=np.float64)


def _scaled(shapes: ArrayLike) -> Complex:
    phi = np.atleast_2d(np.asarray(shapes, dtype=np.complex128))
    if phi.ndim != 2 or phi.shape[1] == 0:
        raise EstimateError(f"shapes have shape {phi.shape}; they are [mode, channel] with at least one channel")
    largest = np.max(np.abs(phi), axis=1, keepdims=True)
    if not np.all(np.isfinite(largest)) or np.any(largest < _LEAST):
        raise EstimateError("a shape is zero at all channels, or holds NaN or infinity; leave it out")
    return np.asarray(phi / largest, dtype=np.complex128)

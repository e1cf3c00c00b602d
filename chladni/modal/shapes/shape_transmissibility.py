"""How vibration passes along the structure at each resonance, read from the shapes."""

from cmath import phase
from dataclasses import dataclass
from math import degrees, hypot, isfinite

import numpy as np

from chladni.modal.shapes.neighbours import Neighbours, neighbours
from chladni.modal.shapes.relative_motion import joint_motion
from chladni.signals.geometry import Geometry
from chladni.signals.mode_set import ModeSet


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeTransmissibility:
    """Motion of one neighbour over that of the other in one mode.

    Attributes
    ----------
    mode
        Row of the mode.
    between
        The two points, in the order of the line: from the first to the second.
    ratio, ratio_std
        abs(phi_second)/abs(phi_first) along the common direction in which the two move most against each other, and
        one sigma of it; None when there's no such direction or the first doesn't move.
    phase_deg
        By how much the second leads the first, above -180 to 180 degrees; None likewise.
    """

    mode: int
    between: tuple[str, str]
    ratio: float | None
    ratio_std: float | None
    phase_deg: float | None


def shape_transmissibility(modes: ModeSet, geometry: Geometry) -> tuple[ShapeTransmissibility, ...]:
    """Give the amplitude ratio of neighbours in each mode, along the lines of the setup file.

    At a resonance the structure moves in the shape of that mode, so that the ratio is the transmissibility there,
    whatever excites it. Between resonances it depends on the excitation: see
    `chladni.spectral.transmissibility.transmissibility`, which measures it.

    Returns
    -------
    By mode, pairs in the order of the lines; see `neighbours` for what is done without.

    Notes
    -----
    sigma of the ratio r: r sqrt((sigma_1/abs(phi_1))^2 + (sigma_2/abs(phi_2))^2), the larger of the two parts of each
    sigma taken.
    """
    pairs = neighbours(modes.channels, geometry)
    return tuple(_step(modes, mode, pair) for mode in range(modes.frequency_hz.size) for pair in pairs)


def _step(modes: ModeSet, mode: int, pair: Neighbours) -> ShapeTransmissibility:
    motion = joint_motion(modes.shapes[mode].astype(np.complex128), pair)
    if motion is None or motion.first == 0:
        return ShapeTransmissibility(mode=mode, between=pair.between, ratio=None, ratio_std=None, phase_deg=None)
    ratio = abs(motion.second) / abs(motion.first)
    parts = modes.shape_std[mode]
    sigma = np.maximum(parts.real, parts.imag)
    first_std = float(np.linalg.norm(motion.first_weights * sigma))
    second_std = float(np.linalg.norm(motion.second_weights * sigma))
    std = hypot(ratio * first_std, second_std) / abs(motion.first)
    return ShapeTransmissibility(
        mode=mode,
        between=pair.between,
        ratio=ratio,
        ratio_std=std if isfinite(std) else None,
        phase_deg=degrees(phase(motion.second / motion.first)) if motion.second else None,
    )

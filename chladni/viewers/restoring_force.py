"""What all pictures of a restoring-force surface share: which samples, which range, which colours."""

from typing import Literal

import numpy as np

from chladni.gap.records.diagnosis import RestoringForce
from chladni.signals.arrays import Bytes, Index, Real

Over = Literal["displacement", "velocity"]

# Enough to see a surface, few enough that dots can be told apart.
POINTS = 3000
# A few wild samples of a recovered force must not flatten all others.
SHOWN, ROOM = 99.5, 1.15
LAW_ROOM = 1.05
# A mean that is such a share of the motion is none.
CENTRED = 1e-6
# Blue against orange, grey in the middle: seen on paper and on black, told apart with any colour vision.
SIGNED = np.array([(0, 114, 178), (158, 158, 158), (213, 94, 0)], dtype=np.float64)


def spread_out(surface: RestoringForce) -> Index:
    """Samples to draw, evenly over time."""
    return spread_over(surface.force.size)


def spread_over(samples: int) -> Index:
    """As many of some samples as can be told apart as dots, evenly over time."""
    return np.unique(np.linspace(0, samples - 1, min(POINTS, samples)).astype(np.intp))


def motion(surface: RestoringForce, over: Over) -> Real:
    """``[sample]`` of the displacement or the velocity."""
    return surface.displacement if over == "displacement" else surface.velocity


def motion_name(surface: RestoringForce, over: Over) -> str:
    """Name of the displacement or the velocity, on an axis."""
    if over == "velocity":
        return "Velocity"
    # Recovered line by line, a motion has no mean: its zero isn't the sensor's.
    centred = abs(float(np.mean(surface.displacement))) < CENTRED * _reach(surface.displacement)
    return "Displacement from its mean" if centred else "Displacement"


def motion_unit(surface: RestoringForce, over: Over) -> str:
    """Unit of the displacement or the velocity."""
    return surface.displacement_unit if over == "displacement" else f"{surface.displacement_unit}/s"


def other(over: Over) -> Over:
    """Give the velocity for the displacement, and the reverse."""
    return "velocity" if over == "displacement" else "displacement"


def force_range(surface: RestoringForce) -> tuple[float, float]:
    """Forces that a picture shows, as much below zero as above; of the law all that is drawn."""
    reach = ROOM * _reach(surface.force)
    if surface.law_force is not None:
        # Of a spring that hardens the rare ends of the range are what tells it.
        reach = max(reach, LAW_ROOM * float(np.abs(surface.law_force[spread_out(surface)]).max(initial=0.0)))
    return -reach, reach


def motion_reach(surface: RestoringForce, over: Over) -> float:
    """Motion that has full colour."""
    return _reach(motion(surface, over))


def signed_colours(share: Real) -> Bytes:
    """Give ``[..., rgb]`` of shares from -1 to 1; what lies outside has the colour of the end."""
    place = np.clip(np.nan_to_num(share), -1, 1) + 1
    parts = [np.interp(place, np.arange(len(SIGNED)), SIGNED[:, part]) for part in range(3)]
    return np.stack(parts, axis=-1).astype(np.uint8)


def _reach(values: Real) -> float:
    # Something must be left of a force that is zero nearly always, and of one that is zero throughout.
    return float(np.percentile(np.abs(values), SHOWN)) or float(np.abs(values).max()) or 1.0

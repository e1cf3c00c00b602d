"""Springs that slide at a yield each (Jenkins's elements), along a motion that is known."""

import numpy as np

from chladni.models.integrator.machine_code import machine_code
from chladni.signals.arrays import Real


def stops_along(displacement: Real, yields: Real, stiffnesses: Real) -> Real:
    """Force of all springs in parallel, ``[sample]`` in N, from rest; exact where turns are samples.

    Parameters
    ----------
    displacement
        ``[sample]``, m.
    yields, stiffnesses
        ``[element]``, m above 0, and N/m.
    """
    force = np.zeros_like(displacement)
    _march(np.ascontiguousarray(displacement), yields, stiffnesses, np.zeros_like(yields), force)
    return force


@machine_code
def _march(displacement: Real, yields: Real, stiffnesses: Real, stretched: Real, force: Real) -> None:
    for sample in range(1, displacement.size):
        way = displacement[sample] - displacement[sample - 1]
        for place in range(yields.size):
            stretched[place] = min(max(stretched[place] + way, -yields[place]), yields[place])
            force[sample] += stiffnesses[place] * stretched[place]

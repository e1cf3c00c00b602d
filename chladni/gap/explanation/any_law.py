"""Whether a gap follows what moves at a site, by any law at all: no name is asked for."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.followed import followed
from chladni.gap.explanation.screen import Screen
from chladni.gap.explanation.trial import Force, Trial
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site

Matrix = NDArray[np.float64]
#: Points of a law of the way, and of one of the pace beside it; of a law of both along each; samples of a filter.
_WAY, _PACE, _BOTH, _FILTER = 60, 16, 8, 24


def left_by_any_law(location: Location, located: Located, site: Site) -> float:
    """Share of the gap that a force at a site leaves which follows the motion there, or the inputs.

    At a joint the force is the sum of any function of the displacement and any of the velocity, or any smooth
    function of both; at an input any function of the command and any filter of all inputs; elsewhere such a filter.
    Functions are sums of hats whose amplitudes are found by the screen, with the parameters refitted under them.

    Returns
    -------
    Misfit beyond noise over that of the tuned model alone, 0 to 1.
    """
    problem = location.problem
    motion = recovered(problem, located.profile, site)
    screen = Screen(problem, located.profile, site)
    gap = max(location.tuned.chi - 1.0, 1e-12)
    left = [1.0]
    for force in _forces(problem, motion):
        start = screen.weigh(_trial(site, force), ())
        found = followed(screen, start) if start is not None else None
        if found is not None:
            left.append((found[0].chi - 1.0) / gap)
    return float(np.clip(min(left), 0.0, 1.0))


def _forces(problem: LinearProblem, motion: Recovered) -> Iterator[Force]:
    way, pace = motion.displacement, motion.velocity
    if motion.site.kind == "joint":
        yield _force(motion, [*_hats(way, _WAY), *_hats(pace, _PACE)])
        yield _force(motion, [one * other for one in _hats(way, _BOTH) for other in _hats(pace, _BOTH)])
        return
    delayed = [np.roll(row, late) for row in problem.measurement.inputs for late in range(_FILTER)]
    yield _force(motion, [*delayed, *(_hats(way, _PACE) if motion.site.kind == "input" else [])])


def _force(motion: Recovered, parts: list[Matrix]) -> Force:
    return Force.of(*(motion.spectrum(one) for one in parts))


def _trial(site: Site, force: Force) -> Trial:
    return Trial(
        effect="any law", site=site, build=lambda _: force, values=lambda *_: {}, parameters=len(force.basis)
    )


def _hats(signal: Matrix, count: int) -> list[Matrix]:
    """Hat functions of a signal ``[sample]`` between points with equally many samples."""
    points = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, count)))
    return [np.interp(signal, points, one) for one in np.eye(points.size)]

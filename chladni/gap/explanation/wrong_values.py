"""Wrong values: parameters far outside their tolerance, found one after another, alone or beside an unknown force."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import BEGUN, FORMS, LESS, LOCATED, SAME, SLIP_FACTOR
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.location.locate import Located, Location, tuned_stepwise
from chladni.gap.location.profile import Profile, profile_at, promises
from chladni.gap.plant.places import Site
from chladni.gap.plant.tunable import Tunables
from chladni.gap.side_by_side import side_by_side
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: Of a value, where its search begins: a resonance apart on a short segment.
_UPWARD = np.geomspace(np.log(SAME), np.log(SLIP_FACTOR), LOCATED)
_E_FOLDS = (*-_UPWARD, *_UPWARD)


@dataclass(frozen=True, slots=True)
class _Doubted:
    """Parameters that may go anywhere, and the profile with them."""

    places: tuple[int, ...]
    profile: Profile


def wrong_values(location: Location, tunables: Tunables) -> list[Hypothesis]:
    """Give the hypotheses that one, two, ... parameters are outside of their tolerance.

    Forward selection: each parameter is tried from factors of a tenth to ten of its value, on short segments first,
    which forgive a resonance that lies elsewhere; the best is freed, and the next one looked for beside it.
    """
    found = _selected(location, tunables, location.tuned, ())
    return [Hypothesis(start_z=one.profile.z) for one in found]


def with_wrong_values(location: Location, located: Located, tunables: Tunables) -> Located | None:
    """Give a place again with the values that are wrong beside the force there; None where none explains more.

    A value that is wrong elsewhere hides what acts at the place, and a force there hides the value.
    """
    sites = tuple(place.sites[0] for place in located.places)
    found = _selected(location, tunables, located.profile, sites)
    return Located(places=located.places, profile=found[-1].profile) if found else None


def _selected(location: Location, tunables: Tunables, start: Profile, sites: Sequence[Site]) -> list[_Doubted]:
    found = [_Doubted((), start)]
    while tunables.names and len(found) <= FORMS:
        tried = _next(location, tunables, found[-1], sites)
        if tried is None or tried.profile.cost > LESS * found[-1].profile.cost:
            break
        found.append(tried)
    return found[1:]


def _next(location: Location, tunables: Tunables, known: _Doubted, sites: Sequence[Site]) -> _Doubted | None:
    """Free the parameter that explains most beside those that are free."""
    problems = (*location.segments, location.problem)
    ways = [_promised(location, tunables, known, sites)]
    # Beside a force any segment is explained by any value: only the slopes on the record tell.
    ways += [] if sites else [_scanned(location, tunables, known)]
    # The best starts by either way: misfits of one way aren't those of the other, and both may end elsewhere.
    best = [sorted(way, key=lambda one: one[0])[: BEGUN // len(ways)] for way in ways]
    starts = [(place, z) for way in best for _, place, z in way]

    def freed(one: tuple[int, Real]) -> _Doubted | None:
        places = (*known.places, one[0])
        limits = tunables.limits([tunables.names[place] for place in places])
        try:
            return _Doubted(places, tuned_stepwise(problems, one[1], limits, sites))
        except (ModelError, np.linalg.LinAlgError):
            return None

    found = [one for one in side_by_side(freed, starts) if one is not None]
    return min(found, key=lambda one: one.profile.cost, default=None)


_Start = tuple[float, int, Real]


def _promised(location: Location, tunables: Tunables, known: _Doubted, sites: Sequence[Site]) -> Iterator[_Start]:
    """Misfit that each parameter promises along its slope, with where that leads."""
    z, names = known.profile.z, tunables.names
    places = [place for place in range(len(names)) if place not in known.places]
    free = [names[place] for place in known.places]
    limits = [tunables.limits([*free, names[place]]) for place in places]
    for place, (step, misfit) in zip(places, promises(location.problem, sites, z, limits), strict=True):
        if _may_go(names[place], float(z[place] + step[place])):
            start = np.array(z)
            start[place] += step[place]
            yield misfit, place, start


def _scanned(location: Location, tunables: Tunables, known: _Doubted) -> Iterator[_Start]:
    """Misfit of each parameter at each factor, the others as they are; the best of each."""
    problem = location.segments[0]
    for place, name in enumerate(tunables.names):
        tried: list[_Start] = []
        for folds in _E_FOLDS if place not in known.places else ():
            z = np.array(known.profile.z)
            z[place] = folds / tunables.tolerance[place]
            with suppress(ModelError, np.linalg.LinAlgError):
                tried += [(profile_at(problem, (), z).misfit, place, z)] if _may_go(name, z[place]) else []
        if tried:
            yield min(tried, key=lambda one: one[0])


def _may_go(name: str, z: float) -> bool:
    """Whether a value may be wrong this way: a body heavier than its tolerance carries something, an effect."""
    return not (z > 0 and is_inertia(name))


def is_inertia(name: str) -> bool:
    """Whether a parameter is what a body resists acceleration with, in a structure or a drive.

    Examples
    --------
    >>> [is_inertia(name) for name in ("arm.mass", "reduced_mass", "inertia", "arm.damping")]
    [True, True, True, False]
    """
    return name.split(".")[-1] in ("mass", "inertia", "reduced_mass")

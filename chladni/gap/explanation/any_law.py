"""Whether a gap follows what moves at a site, by any law at all: no name is asked for."""

from collections.abc import Iterator
from math import sqrt

import numpy as np
from scipy.ndimage import uniform_filter1d

from chladni.gap.calibration import FILTER_SAMPLES, LAW_POINTS, LINES_APART, PACE_POINTS, RIDGE, TONE_LINES, ZERO
from chladni.gap.explanation.followed import followed
from chladni.gap.explanation.screen import Screen
from chladni.gap.explanation.trial import SiteTrial
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.models.effects.trial import Force, Trial
from chladni.signals.arrays import Real

#: Points of a law of both along each: as many numbers as one of the way alone.
_BOTH_POINTS = round(sqrt(LAW_POINTS))


def left_by_any_law(location: Location, located: Located, site: Site) -> float:
    """Share of the gap that a force at a site leaves which follows the motion there, or the inputs, 0 to 1.

    At a joint the force is the sum of any function of the displacement and any of the velocity, any smooth function
    of both, or the displacement times a tone, as of a stiffness that turns with a shaft; at an input any function of
    the command, any smooth one of it and its slope, and any filter of all inputs; elsewhere such a filter. Functions
    are sums of hats whose amplitudes are found by the screen, with the parameters refitted under them. It's the
    misfit beyond noise over that of the tuned model alone.
    """
    problem = location.problem
    motion = recovered(problem, located.profile, site)
    screen = Screen(problem, located.profile, site)
    gap = max(location.tuned.chi - 1.0, RIDGE)
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
        yield _force(motion, [*hats(way, LAW_POINTS), *hats(pace, PACE_POINTS)])
        yield _force(motion, _both(way, pace))
        yield _force(motion, [way * tone for tone in _tones(motion)])
        return
    delayed = [np.roll(row, late) for row in problem.measurement.inputs for late in range(FILTER_SAMPLES)]
    if motion.site.kind == "input":
        # A limit of slew follows the command's way and pace.
        delayed += [*hats(way, PACE_POINTS), *_both(way, np.gradient(way))]
    yield _force(motion, delayed)


def _both(way: Real, pace: Real) -> list[Real]:
    return [one * other for one in hats(way, _BOTH_POINTS) for other in hats(pace, _BOTH_POINTS)]


def _tones(motion: Recovered) -> list[Real]:
    """Cosine and sine, and their octave's, of the tone that stands out of force times displacement."""
    count = motion.force.size
    product = motion.force * motion.displacement
    power = np.abs(np.fft.rfft((product - product.mean()) * np.hanning(count))) ** 2
    # A running sum forgets what is far below the largest line, and leaves its rounding there.
    least = np.finfo(np.float64).eps * power.max() + ZERO
    above = power / np.maximum(uniform_filter1d(power, TONE_LINES, mode="reflect"), least)
    line = int(np.argmax(above[LINES_APART:-1])) + LINES_APART
    # Between lines by a parabola through the logarithms: over hundreds of turns a line's width is too much.
    below, at, beyond = np.log(np.maximum(power[line - 1 : line + 2], ZERO))
    bend = below - 2.0 * at + beyond
    turns = line + (0.5 * (below - beyond) / bend if bend < 0 else 0.0)
    angle = 2.0 * np.pi * turns * np.arange(count) / count
    return [np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)]


def _force(motion: Recovered, parts: list[Real]) -> Force:
    return Force.of(*(motion.spectrum(one) for one in parts))


def _trial(site: Site, force: Force) -> SiteTrial:
    form = Trial(build=lambda _: force, values=lambda *_: {}, parameters=len(force.basis))
    return SiteTrial(site=site, form=form)


def hats(signal: Real, count: int) -> list[Real]:
    """Give hat functions of a signal ``[sample]``, one for each of `count` points with equally many samples between.

    Points that coincide, of a signal that rests, count once. The functions add up to one.
    """
    points = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, count)))
    return [np.interp(signal, points, one) for one in np.eye(points.size)]

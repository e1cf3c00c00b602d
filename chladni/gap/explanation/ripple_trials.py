"""Ripple of an actuator: a force periodic in the position of the place where the input acts."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.explanation.joint_trials import ripples
from chladni.gap.explanation.trial import Trial
from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site


def ripple_at_input(problem: LinearProblem, motion: Recovered, site: Site) -> Iterator[Trial]:
    """Give the trials when the input acts at a place that moves."""
    compiled = problem.view(np.zeros(len(problem.tunables.names))).compiled
    if any((port.name, port.kind) == (site.name, "actuation") for port in compiled.ports):
        position = motion.position_at(problem, compiled.port_index(site.name, "actuation"))
        yield from ripples(motion, position)

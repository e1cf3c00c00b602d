"""Whether a joint that remembers its way explains a gap, as rubber does: a linear law that is no word."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np

from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.location.locate import Located, Location, tuned_stepwise
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.further_numbers import with_further
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.linear_feedback import state, velocity, with_feedback, with_rate, with_states
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError

#: Branches a decade of frequency: of closer ones only the sum can be told, since each loses over a decade.
_A_DECADE = 2
#: The lowest corner lies so many times below the band.
_BELOW = 10.0
#: Step of a branch's stiffness over the force that the joint lacks by its way: its prior's size, which only matters
#: where the sensors tell nothing, as below the band of accelerometers.
_STEP = 1.0
#: Steps that a branch may take, and those of its tolerance that a parameter may.
_FREE, _BOUNDED = 1e4, 3.0
#: Frequencies of the band at which a loss is looked at, and the share of the largest that noise may make of none.
_LOOKED, _NONE = 50, 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Relaxation:
    """A joint's stiffness that rises with frequency, and what it loses meanwhile.

    Attributes
    ----------
    joint
        Where.
    chi
        Misfit over what noise alone leaves, with the parameters refitted under it.
    band_hz
        That moved.
    rise
        Of the stiffness over that band, SI.
    loss
        Largest imaginary part of the stiffness in that band that the relaxing adds, SI.
    unit
        Of both.
    numbers
        That were fitted.
    """

    joint: str
    chi: float
    band_hz: tuple[float, float]
    rise: float
    loss: float
    unit: str
    numbers: int

    def sentence(self) -> str:
        """Say which force acts where, and what does that."""
        low, high = self.band_hz
        return (
            f"a stiffness of {self.joint} that rises by {self.rise:.3g} {self.unit} from {low:.3g} to {high:.3g} Hz "
            f"with a loss of up to {self.loss:.3g} {self.unit}, as rubber's does"
        )


def any_relaxation(location: Location, located: Located, joint: Site) -> Relaxation | None:
    """Fit Maxwell's branches to a joint of a place, their corners even over the decades of the band that moved.

    A sum of such branches is what any material does that relaxes (Ferry, *Viscoelastic Properties of Polymers*, 3rd
    ed., chapter 3). Its force has no resonance of its own, so that it does what a mass on a soft mount does only
    where that is damped so much that it shows none either. Any signs are fitted, since of close branches only the sum
    can be told; None where that sum would give energy instead of losing it, or no fit converges.
    """
    compiled = location.problem.model.compile()
    port = compiled.port_index(joint.name, "joint")
    low_hz, high_hz = excited_band_hz(location.problem.measurement)
    # What has its corner far below is stiff in all of the band.
    lowest_hz = low_hz / _BELOW
    corners = 2 * np.pi * np.geomspace(lowest_hz, high_hz, 2 + int(_A_DECADE * np.log10(high_hz / lowest_hz)))
    motion = recovered(location.problem, located.profile, joint)
    way, force = float(np.std(motion.displacement)), float(np.std(motion.force))
    if way <= 0 or force <= 0:
        return None
    step, start = _STEP * force / way, located.profile.z
    problems = [_relaxing(one, port, corners, step) for one in (*location.segments, location.problem)]
    limit = np.repeat([_BOUNDED, _FREE], [start.size, corners.size])
    try:
        found = tuned_stepwise(problems, np.concatenate([start, np.zeros(corners.size)]), limit)
    except (ModelError, np.linalg.LinAlgError):
        return None
    stiffness = _stiffness(step * found.z[start.size :], corners, np.geomspace(low_hz, high_hz, _LOOKED))
    loss, rise = stiffness.imag, stiffness.real[-1] - stiffness.real[0]
    if rise <= 0 or loss.min() < -_NONE * loss.max():
        return None
    shape = compiled.ports[port]
    return Relaxation(
        joint=joint.name,
        chi=found.chi,
        band_hz=(low_hz, high_hz),
        rise=float(rise),
        loss=float(loss.max()),
        unit=f"{shape.unit}/{shape.displacement_unit}",
        numbers=corners.size,
    )


def _stiffness(branches: Real, corners: Real, frequency_hz: Real) -> Complex:
    """``[frequency]`` complex stiffness of branches."""
    s = 2j * np.pi * frequency_hz[:, None]
    return np.asarray((s / (s + corners)) @ branches, dtype=np.complex128)


def _relaxing(problem: LinearProblem, port: int, corners: Real, step: float) -> LinearProblem:
    """Give the problem with the branches' stiffnesses, in steps, behind its parameters."""

    def make(parameters: Mapping[str, float], numbers: Real) -> CompiledModel:
        return _with_branches(problem.model.with_values(parameters).compile(), port, corners, step * numbers)

    return with_further(problem, corners.size, make)


def _with_branches(compiled: CompiledModel, port: int, corners: Real, stiffness: Real) -> CompiledModel:
    """Let stretched springs creep back: ``z_i' = s - w_i z_i``, a force of ``k_i z_i`` that resists."""
    first = len(compiled.states)
    compiled = with_states(compiled, [f"relaxation {place}" for place in range(corners.size)])
    stretches = [state(compiled, first + place) for place in range(corners.size)]
    speed = velocity(compiled, port)
    for place, (stretch, corner) in enumerate(zip(stretches, corners, strict=True)):
        compiled = with_rate(compiled, first + place, speed + stretch.scaled(-corner))
    forces = (stretch.scaled(k) for stretch, k in zip(stretches, stiffness, strict=True))
    return with_feedback(compiled, port, reduce(add, forces))[0]

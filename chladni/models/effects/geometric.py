"""Geometric stiffness: a spring at an angle, whose force along the joint bends because it turns as it stretches."""

from collections.abc import Iterator
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, positive, rms
from chladni.signals.arrays import Real

#: Angles in degrees at which a spring may stand: at 90 it's a cube, near 0 it hardly turns, at 63 and 117 the cube
#: changes its sign.
_ANGLES_DEG = (30.0, 60.0, 75.0, 90.0, 105.0, 120.0, 150.0)
#: Share of its force beside a straight line below which it's a spring along the joint.
_STRAIGHT = 0.02


def turning(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give what a spring at an angle does beyond its stiffness at rest; parameters stiffness, along, across, length.

    ``stiffness ((L - length) (along + d)/L - (along/length)^2 d)``, L = sqrt((along + d)^2 + across^2)
    """
    along = parameters[1] + d
    stretched = hypot(along, parameters[2])
    share = parameters[1] / parameters[3]
    # Where both ends meet the spring has no direction.
    pull = 0.0 if stretched <= 0.0 else (stretched - parameters[3]) * along / stretched
    return float(parameters[0] * (pull - share * share * d))


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    length, angle = values["length"], values["angle"]
    return values["stiffness"], length * cos(angle), length * sin(angle), length


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    d, reach = motion.displacement, rms(motion.displacement)

    def build(shape: Shape) -> Force:
        length, angle = np.exp(shape[0]), shape[1]
        along = length * np.cos(angle) + d
        stretched = np.maximum(np.hypot(along, length * np.sin(angle)), 1e-9 * length)
        return Force.of(motion.spectrum((stretched - length) * along / stretched - np.cos(angle) ** 2 * d))

    def values(shape: Shape, a: Real) -> Numbers | None:
        # A spring that stands the other way round, or is turned by a whole turn, is the same.
        angle = float(np.arccos(np.cos(shape[1])))
        return positive(a, stiffness=a[0], length=float(np.exp(shape[0])), angle=angle)

    # From a spring that turns over to one that only begins to turn. The length alone, at a wrong angle, runs away.
    lengths = np.log(reach * np.geomspace(2.0, 30.0, 5)).tolist()
    grid = tuple((length, float(np.radians(angle))) for length in lengths for angle in _ANGLES_DEG)
    yield Trial(build=build, grid=grid, values=values, parameters=3)


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether its force along the motion is a straight line's: of one far shorter, or longer, than its way."""
    d, _ = fitted.motion()
    length, angle = fitted.values["length"], fitted.values["angle"]
    along = length * np.cos(angle) + d
    stretched = np.maximum(np.hypot(along, length * np.sin(angle)), 1e-9 * length)
    pull = (stretched - length) * along / stretched
    force = pull - np.cos(angle) ** 2 * d
    line = np.polynomial.Polynomial.fit(d, force, 1)
    # In line with the joint nothing is left but rounding.
    return bool(np.std(force - line(d)) < max(_STRAIGHT * np.std(force), 1e-9 * np.std(pull)))


GEOMETRIC = EffectKind(
    name="geometric",
    said="geometric stiffness",
    family="stiffness",
    meaning="a spring at an angle, which turns as the joint moves",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="stiffness", value=1e4, unit="N/m", low=0.0, high=1e8, minimum=0.0, maximum=1e15,
                meaning="of the spring along itself",
            ),
            Parameter(
                name="length", value=0.05, unit="m", low=1e-3, high=10.0, minimum=1e-9, maximum=1e6,
                meaning="of the spring at rest, where it pulls nothing",
            ),
            Parameter(
                name="angle", value=pi / 2, unit="rad", low=0.1, high=3.0, minimum=0.0, maximum=3.141593,
                meaning="between the spring at rest and the joint's direction",
            ),
        )
    ),
    optional=("angle",),
    neutral={"stiffness": 0.0},
    clues=Clues(trials=_trials, sizes=("stiffness",), is_degenerate=_is_degenerate),
    variants=(
        Variant(
            name="spring",
            attach=LawAtPort(law=turning, numbers=_numbers),
            formula="F = stiffness ((L - length) (x + d)/L - cos(angle)^2 d), L = sqrt((x + d)^2 + h^2), "
            "x = length cos(angle), h = length sin(angle)",
            fitted=("angle",),
        ),
    ),
)  # fmt: skip

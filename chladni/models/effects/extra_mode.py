"""An extra mode: an oscillator attached to a body, such as a cable, a panel, a tool."""

from collections.abc import Iterator
from math import pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_feedback import (
    displacement,
    ground_acceleration,
    state,
    velocity,
    with_feedback,
    with_rate,
    with_states,
)
from chladni.models.effects.resonances import resonances
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Complex, Real


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Add position and velocity of a mass that hangs on the body by a spring and a damper."""
    # The oscillator's position, not its stretch, is the state: the stretch would need the body's acceleration.
    port, place = compiled.port_index(site.name, "body"), len(compiled.states)
    shaking = ground_acceleration(compiled, port).padded(2)
    names = (f"{site.name}.{site.effect}.displacement", f"{site.name}.{site.effect}.velocity")
    compiled = with_states(compiled, names)
    omega = 2 * pi * values["frequency"]
    position, speed = state(compiled, place), state(compiled, place + 1)
    # Only now, since rows of the model have become wider by the two states.
    stretch = position + displacement(compiled, port).scaled(-1.0)
    slip = speed + velocity(compiled, port).scaled(-1.0)
    pull = stretch.scaled(omega**2) + slip.scaled(2 * values["damping_ratio"] * omega)
    compiled = with_rate(compiled, place, speed)
    compiled = with_rate(compiled, place + 1, pull.scaled(-1.0) + shaking.scaled(-1.0))
    return with_feedback(compiled, port, pull.scaled(values["mass"]))[0]


#: A mount that resonates this far above all that moved amplifies its load's pull there by less than a quarter: that
#: is a mass. Below it's an oscillator, whose resonance shows.
STIFF_MOUNT = 2.2
#: Damping ratio from which an attached mass is no oscillator: critical damping is 1, and fits aren't exact.
_DASHPOT = 2.0


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    acceleration = motion.s * motion.spectrum(motion.velocity)
    low_hz, stiff_hz = motion.band_hz[0], STIFF_MOUNT * motion.band_hz[1]
    # A lightly damped oscillator pulls the other way a little beside its resonance: a grid alone may step over it.
    estimated = resonances(
        motion.spectrum(motion.force), -acceleration, motion.believed, motion.frequency_hz, (low_hz, stiff_hz)
    )
    spread = np.geomspace(max(low_hz, 0.5), stiff_hz, 45).tolist()
    yield Trial(
        build=lambda shape: pull(motion, acceleration, shape),
        grid=[*logarithms(spread, (0.003, 0.01, 0.03)), *estimated],
        values=lambda shape, a: oscillator(shape, a) if numbers(shape)[0] <= stiff_hz else None, parameters=3,
    )  # fmt: skip


def pull(motion: TrialMotion, acceleration: Complex, shape: Shape) -> Force:
    """Give what an oscillator of a frequency in Hz and a damping ratio pulls with at a body that accelerates."""
    frequency, damping = numbers(shape)
    omega, s = 2 * np.pi * frequency, motion.s
    turning = s**2 + 2 * damping * omega * s + omega**2
    # It swings at the start already, and still at the end.
    share = (omega**2 + 2 * damping * omega * s) / turning
    return Force.of(-acceleration * share, omega / turning, s / turning)


def oscillator(shape: Shape, amplitudes: Real) -> Numbers | None:
    """Give the values of an oscillator that pulls so; None without a mass."""
    if amplitudes[0] <= 0:
        return None
    frequency, damping = numbers(shape)
    return {"mass": float(amplitudes[0]), "frequency": frequency, "damping_ratio": damping}


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether it never swings.

    Resonant well above all that moved, it's a mass; as far below, or where it doesn't swing once, it stands still
    and its mount is a spring to there; one that is damped far too much to swing is a mass that a dashpot carries.
    """
    swings = fitted.values["damping_ratio"] < _DASHPOT
    lowest_hz = max(1.0 / fitted.duration_s, fitted.band_hz[0] / STIFF_MOUNT)
    return not (swings and lowest_hz < fitted.values["frequency"] < STIFF_MOUNT * fitted.band_hz[1])


EXTRA_MODE = EffectKind(
    name="extra_mode",
    said="an extra mode",
    family="attachment",
    meaning="an oscillator attached to the body: cable, panel, tool, payload",
    sites=("body",),
    parameters=Parameters(
        (
            Parameter(name="mass", value=0.1, unit="kg", low=0.0, high=100.0, minimum=0.0, maximum=1e9),
            Parameter(
                name="frequency", value=50.0, unit="Hz", low=0.1, high=5e3, minimum=1e-6, maximum=1e7,
                meaning="of the oscillator with the body held still",
            ),
            Parameter(
                name="damping_ratio", value=0.02, unit="1", low=0.0, high=0.5, minimum=0.0, maximum=100.0,
                meaning="likewise",
            ),
        )
    ),
    neutral={"mass": 0.0},
    linear=True,
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate, sizes=("mass",), exact=True, several=True),
    variants=(
        Variant(
            name="oscillator",
            attach=attach,
            formula="f = mass (w^2 (q - d) + 2 damping_ratio w (q' - s)), mass q'' = -f, w = 2 pi frequency",
        ),
    ),
)  # fmt: skip

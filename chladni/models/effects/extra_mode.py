"""An extra mode: an oscillator attached to a body, such as a cable, a panel, a tool."""

from math import pi

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
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


EXTRA_MODE = EffectKind(
    name="extra_mode",
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
    variants=(
        Variant(
            name="oscillator",
            attach=attach,
            formula="f = mass (w^2 (q - d) + 2 damping_ratio w (q' - s)), mass q'' = -f, w = 2 pi frequency",
        ),
    ),
)  # fmt: skip

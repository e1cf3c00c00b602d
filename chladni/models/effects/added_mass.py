"""Added mass: a body that is heavier than modelled."""

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.extra_mode import attach as attach_oscillator
from chladni.models.effects.linear_feedback import ground_acceleration, rate, velocity, with_feedback


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Let the mass resist the body's acceleration: ``f = -mass a``, solved for the acceleration that it lowers."""
    port = compiled.port_index(site.name, "body")
    # What the ground's shaking does is no part of a motion that is measured from the ground.
    acceleration = rate(compiled, velocity(compiled, port), site.name) + ground_acceleration(compiled, port)
    return with_feedback(compiled, port, acceleration.scaled(-values["mass"]))[0]


ADDED_MASS = EffectKind(
    name="added_mass",
    family="attachment",
    meaning="more mass than modelled: an unmodelled payload, a sensor",
    sites=("body",),
    parameters=Parameters(
        (Parameter(name="mass", value=0.1, unit="kg", low=0.0, high=100.0, minimum=0.0, maximum=1e9),)
    ),
    # Less mass than modelled is a wrong parameter, not something unmodelled: the bound is zero.
    neutral={"mass": 0.0},
    linear=True,
    variants=(
        Variant(name="rigid", attach=attach, formula="f = -mass a"),
        Variant(
            name="mounted",
            attach=attach_oscillator,
            formula="as extra_mode, resonant above what the excitation reaches",
            parameters=Parameters(
                (
                    Parameter(
                        name="frequency", value=1000.0, unit="Hz", low=10.0, high=1e4, minimum=1e-6, maximum=1e7,
                        meaning="`mounted`: of the mass on its mount",
                    ),
                    Parameter(
                        name="damping_ratio", value=0.05, unit="1", low=0.0, high=0.5, minimum=0.0, maximum=100.0,
                        meaning="`mounted`: likewise",
                    ),
                )
            ),
            fitted=("frequency",),
        ),
    ),
)  # fmt: skip

"""AC coupling: an amplifier that keeps what is steady away."""

from math import pi

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import high_pass


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``p/(p + w_c)`` behind the sensor."""
    # Down to zero nothing is held back; the state would stay at rest and only cost time.
    if values["corner"] == 0:
        return compiled
    return pass_through(compiled, site, high_pass(2 * pi * values["corner"]))


AC_COUPLING = EffectKind(
    name="ac_coupling",
    family="sensor",
    meaning="first-order high-pass in the amplifier or the sensor",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="corner", value=0.5, unit="Hz", low=0.0, high=20.0, minimum=0.0, maximum=1e7,
                meaning="where 3 dB are lost",
            ),
        )
    ),
    neutral={"corner": 0.0},
    linear=True,
    variants=(
        Variant(name="first_order", attach=attach, formula="y_recorded/y = p/(p + 2 pi corner)"),
    ),
)  # fmt: skip

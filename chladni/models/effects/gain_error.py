"""Gain error: a sensitivity that differs from the calibration, sign included."""

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import gain


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Multiply the signal."""
    return pass_through(compiled, site, gain(values["gain"]))


GAIN_ERROR = EffectKind(
    name="gain_error",
    family="sensor",
    meaning="sensitivity that differs from the calibration, sign included",
    sites=("input", "output"),
    parameters=Parameters(
        (Parameter(name="gain", value=1.1, unit="1", low=-1.5, high=1.5, minimum=-1e6, maximum=1e6),)
    ),
    neutral={"gain": 1.0},
    linear=True,
    variants=(Variant(name="factor", attach=attach, formula="y_recorded = gain y, or u_acts = gain u"),),
)

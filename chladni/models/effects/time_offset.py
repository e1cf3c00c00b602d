"""Time offset: one channel's clock is late or early."""

from dataclasses import replace

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import output_row


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Shift what is recorded; what a controller sees isn't shifted, since its clock isn't the log's."""
    # Several effects may shift one channel: its logger and its sensor.
    offsets = list(compiled.output_offsets_s)
    offsets[output_row(compiled, site.name)] += values["offset"]
    return replace(compiled, output_offsets_s=tuple(offsets))


TIME_OFFSET = EffectKind(
    name="time_offset",
    family="sensor",
    meaning="this channel's clock is late or early",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="offset", value=1e-3, unit="s", low=-0.1, high=0.1, minimum=-1e3, maximum=1e3,
                meaning="positive: recorded late",
            ),
        )
    ),
    neutral={"offset": 0.0},
    linear=True,
    variants=(Variant(name="shift", attach=attach, formula="y_recorded(t) = y(t - offset)"),),
)  # fmt: skip

"""Cross axis: a sensor that also feels another measured direction."""

from collections.abc import Iterator

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_feedback import (
    displacement,
    output,
    with_displacement,
    with_feedback,
    with_output,
)
from chladni.models.effects.signal_path import free_port, is_in_loop, output_row
from chladni.models.effects.trial import Force, Trial, TrialMotion
from chladni.signals.arrays import Complex
from chladni.signals.errors import ModelError


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Add a share of the other output, as its own effects leave it so far."""
    if site.source is None or site.source == site.name:
        raise ModelError(f"{site.effect} at {site.name!r}: name another output as its source")
    row = output_row(compiled, site.name)
    if any(place == row for place, _ in compiled.output_maps):
        raise ModelError(
            f"{site.effect} at {site.name!r}: a sensor feels another direction before its samples are changed; "
            "list it before clipping, quantization and other effects on samples"
        )
    # In a loop the share must be a force at the port, so that laws behind it see it too.
    in_loop = is_in_loop(compiled, site)
    if in_loop:
        compiled, port = free_port(compiled, site)
    added = output(compiled, output_row(compiled, site.source)).scaled(values["coefficient"])
    if not in_loop:
        return with_output(compiled, row, output(compiled, row) + added)
    compiled, added = with_feedback(compiled, port, added)
    return with_displacement(compiled, port, displacement(compiled, port) + added)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    units = {one.name: one.unit for one in motion.compiled.outputs}
    for name, samples in motion.outputs.items():
        if name != motion.name and units[name] == units[motion.name]:
            yield _trial(name, motion.spectrum(samples))


def _trial(source: str, spectrum: Complex) -> Trial:
    return Trial(
        source=source, build=lambda _: Force.of(spectrum), values=lambda _, a: {"coefficient": float(a[0])},
        parameters=1,
    )  # fmt: skip


CROSS_AXIS = EffectKind(
    name="cross_axis",
    said="cross-axis sensitivity",
    family="sensor",
    meaning="the sensor also feels another measured direction",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="coefficient", value=0.05, unit="1", low=-0.3, high=0.3, minimum=-1e6, maximum=1e6,
                meaning="share of the other output that is felt",
            ),
        )
    ),
    neutral={"coefficient": 0.0},
    linear=True,
    needs_source=True,
    clues=Clues(trials=_trials, sizes=("coefficient",), exact=True),
    variants=(Variant(name="share", attach=attach, formula="y_recorded = y + coefficient y_from"),),
)  # fmt: skip

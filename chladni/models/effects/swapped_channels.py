"""Swapped channels: two signals of a log stand under each other's name."""

from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.pair import pair_of
from chladni.models.effects.signal_path import output_row
from chladni.signals.errors import ModelError


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Record each of both with all that acts on it under the other one's name; a controller sees what it saw."""
    pair = pair_of(compiled, site.name, "output_pair")
    if pair is None:
        raise ModelError(f"{site.effect} at {site.name!r}: name two outputs, as in left~right")
    if values["swapped"] == 0.0:
        return compiled
    first, second = (output_row(compiled, one) for one in pair)
    order = np.arange(len(compiled.outputs))
    order[[first, second]] = second, first
    return replace(
        compiled,
        c=compiled.c[order],
        d=compiled.d[order],
        h=compiled.h[order],
        output_maps=tuple((int(order[row]), action) for row, action in compiled.output_maps),
        output_offsets_s=tuple(compiled.output_offsets_s[row] for row in order),
    )


def _check(values: Values) -> str:
    return "" if values["swapped"] in (0.0, 1.0) else f"swapped = {values['swapped']:g} must be 1 or 0"


def _no_trials(_motion: object) -> tuple[()]:
    # An error of two sensors at once: no error at one place prints it.
    return ()


SWAPPED_CHANNELS = EffectKind(
    name="swapped_channels",
    said="swapped channels",
    family="sensor",
    meaning="two channels stand under each other's name",
    sites=("output_pair",),
    parameters=Parameters(
        (
            Parameter(
                name="swapped", value=1.0, unit="1", low=0.0, high=1.0, minimum=0.0, maximum=1.0, role="function",
                meaning="1, or 0 for channels that aren't",
            ),
        )
    ),
    optional=("swapped",),
    neutral={"swapped": 0.0},
    check=_check,
    linear=True,
    clues=Clues(trials=_no_trials, exact=True),
    variants=(
        Variant(name="exchanged", attach=attach, formula="first_recorded = second, second_recorded = first"),
    ),
)  # fmt: skip

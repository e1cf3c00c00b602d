"""Time offset: one channel's clock is late or early."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import output_row
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Shift what is recorded; what a controller sees isn't shifted, since its clock isn't the log's."""
    # Several effects may shift one channel: its logger and its sensor.
    offsets = list(compiled.output_offsets_s)
    offsets[output_row(compiled, site.name)] += values["offset"]
    return replace(compiled, output_offsets_s=tuple(offsets))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    yield from (_trial(motion, sign) for sign in (1.0, -1.0))


def _trial(motion: TrialMotion, sign: float) -> Trial:
    """Signal that comes late or, with a negative sign, early: shapes hold logarithms, which have none."""
    y, s = motion.spectrum(motion.displacement), motion.s

    def shifted(shape: Shape) -> Force:
        return Force.known(y * np.expm1(-s * sign * numbers(shape)[0]))

    offsets = (np.geomspace(0.03, 60.0, 24) / motion.sample_rate_hz).tolist()
    return Trial(
        build=shifted, values=lambda shape, _: {"offset": sign * numbers(shape)[0]}, grid=logarithms(offsets),
        parameters=1,
    )  # fmt: skip


TIME_OFFSET = EffectKind(
    name="time_offset",
    said="a time offset",
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
    clues=Clues(trials=_trials, exact=True),
    variants=(Variant(name="shift", attach=attach, formula="y_recorded(t) = y(t - offset)"),),
)  # fmt: skip

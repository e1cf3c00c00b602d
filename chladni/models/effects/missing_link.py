"""A missing link: a spring and a damper between two bodies, or to the ground, that the model has no joint for."""

from collections.abc import Iterator

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_feedback import displacement, velocity, with_feedback
from chladni.models.effects.pair import with_pair_port
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion
from chladni.signals.arrays import Real


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Let the link resist what moves its ends apart: ``F = stiffness d + damping s``."""
    compiled, port = with_pair_port(compiled, site.name)
    way, pace = displacement(compiled, port), velocity(compiled, port)
    force = way.scaled(values["stiffness"]) + pace.scaled(values["damping"])
    return with_feedback(compiled, port, force)[0]


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    way, pace = motion.spectrum(motion.displacement), motion.spectrum(motion.velocity)

    def of_both(_: Shape, a: Real) -> Numbers | None:
        return {"stiffness": float(a[0]), "damping": float(a[1])} if np.all(a > 0) else None

    def of_one(name: str) -> Trial:
        other = {"stiffness": "damping", "damping": "stiffness"}[name]
        spectrum = way if name == "stiffness" else pace
        return Trial(
            build=lambda _: Force.of(spectrum),
            values=lambda _, a: {name: float(a[0]), other: 0.0} if a[0] > 0 else None, parameters=1,
        )  # fmt: skip

    yield Trial(build=lambda _: Force.of(way, pace), values=of_both, parameters=2)
    yield of_one("stiffness")
    yield of_one("damping")


MISSING_LINK = EffectKind(
    name="missing_link",
    said="a missing link",
    family="coupling",
    meaning="a spring and damper between two bodies, or a body and the ground, that the model has no joint for",
    sites=("pair",),
    parameters=Parameters(
        (
            Parameter(name="stiffness", value=1e4, unit="N/m", low=0.0, high=1e9, minimum=0.0, maximum=1e15),
            Parameter(name="damping", value=0.0, unit="N s/m", low=0.0, high=1e5, minimum=0.0, maximum=1e12),
        )
    ),
    optional=("damping",),
    neutral={"stiffness": 0.0, "damping": 0.0},
    linear=True,
    clues=Clues(trials=_trials, sizes=("stiffness", "damping"), exact=True),
    variants=(
        Variant(name="spring_damper", attach=attach, formula="F = stiffness d + damping s", fitted=("damping",)),
    ),
)

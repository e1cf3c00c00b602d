"""Gyroscopic coupling: each of two bodies is pushed by the other one's velocity, and no energy is lost."""

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_feedback import velocity, with_feedback
from chladni.models.effects.pair import pair_of
from chladni.signals.errors import ModelError


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Push the second body along the first one's velocity, and the first one against the second one's."""
    pair = pair_of(compiled, site.name, "pair")
    if pair is None or "ground" in pair:
        raise ModelError(f"{site.effect} at {site.name!r}: a rotor couples two bodies; the ground has no velocity")
    first, second = (compiled.port_index(one, "body") for one in pair)
    compiled = with_feedback(compiled, first, velocity(compiled, second).scaled(-values["coefficient"]))[0]
    return with_feedback(compiled, second, velocity(compiled, first).scaled(values["coefficient"]))[0]


def _no_trials(_motion: object) -> tuple[()]:
    # Two forces that are no pair's action and reaction: no force at one place prints them.
    return ()


GYROSCOPIC = EffectKind(
    name="gyroscopic",
    said="gyroscopic coupling",
    family="coupling",
    meaning="a rotor couples two directions: each is pushed by the other one's velocity",
    sites=("pair",),
    parameters=Parameters(
        (
            Parameter(
                name="coefficient", value=1.0, unit="N s/m", low=-1e3, high=1e3, minimum=-1e12, maximum=1e12,
                meaning="of two tilts the rotor's polar inertia times its speed",
            ),
        )
    ),
    neutral={"coefficient": 0.0},
    linear=True,
    clues=Clues(trials=_no_trials, sizes=("coefficient",), exact=True, between_linked=True),
    variants=(
        Variant(name="skew", attach=attach, formula="f_first = -coefficient s_2, f_second = coefficient s_1"),
    ),
)  # fmt: skip

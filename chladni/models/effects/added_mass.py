"""Added mass: a body that is heavier than modelled."""

from collections.abc import Iterator

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.extra_mode import STIFF_MOUNT, oscillator, pull
from chladni.models.effects.extra_mode import attach as attach_oscillator
from chladni.models.effects.linear_feedback import ground_acceleration, rate, velocity, with_feedback
from chladni.models.effects.trial import Trial, TrialMotion, logarithms, numbers, proportional
from chladni.models.effects.wrong_unit import APART, short


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Let the mass resist the body's acceleration: ``f = -mass a``, solved for the acceleration that it lowers."""
    port = compiled.port_index(site.name, "body")
    # What the ground's shaking does is no part of a motion that is measured from the ground.
    acceleration = rate(compiled, velocity(compiled, port), site.name) + ground_acceleration(compiled, port)
    return with_feedback(compiled, port, acceleration.scaled(-values["mass"]))[0]


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    acceleration = motion.s * motion.spectrum(motion.velocity)
    yield proportional(-acceleration, "mass")
    # A mount bends a little below its resonance; above the excitation it's a mass, whatever holds it.
    stiff_hz = STIFF_MOUNT * motion.band_hz[1]
    yield Trial(
        variant="mounted", build=lambda shape: pull(motion, acceleration, shape),
        grid=logarithms((stiff_hz * np.array([1.1, 2.0, 4.0])).tolist(), (0.05,)),
        values=lambda shape, a: oscillator(shape, a) if numbers(shape)[0] > stiff_hz else None, parameters=3,
    )  # fmt: skip


def _doubts(site: str, values: Values, modelled: Parameters) -> Iterator[str]:
    for number in filter(None, (modelled.get(f"{site}.{word}") for word in ("mass", "inertia"))):
        doubt = mass_doubt(site, values["mass"], number.value, number.unit)
        if doubt is not None:
            yield doubt


def mass_doubt(site: str, added: float, modelled: float, unit: str) -> str | None:
    """Give a sentence on an added mass that is many times what the model has there.

    Examples
    --------
    >>> mass_doubt("carriage", 10.0, 5.0, "kg")
    >>> print(mass_doubt("carriage", 101.2, 0.095, "kg"))
    What is added at carriage is 1100 times the 0.095 kg that the model has there: check that number and its unit.
    """
    if not added > APART * modelled > 0:
        return None
    return (
        f"What is added at {site} is {short(added / modelled)} times the {modelled:.3g} {unit} that the model has "
        "there: check that number and its unit."
    )


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
    clues=Clues(trials=_trials, details=("damping_ratio",), sizes=("mass",), exact=True, doubts=_doubts),
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

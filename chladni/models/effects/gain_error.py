"""Gain error: a sensitivity that differs from the calibration, sign included."""

from collections.abc import Iterator

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import gain
from chladni.models.effects.trial import Force, Trial, TrialMotion
from chladni.models.effects.wrong_unit import CONVERSIONS, EXACTLY, is_apart, near, short


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Multiply the signal."""
    return pass_through(compiled, site, gain(values["gain"]))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.kind == "input" and motion.is_still:
        return
    spectrum = motion.spectrum(motion.displacement)
    yield Trial(
        build=lambda _: Force.of(spectrum), values=lambda _, a: {"gain": 1.0 + float(a[0])}, parameters=1,
    )  # fmt: skip


def _doubts(site: str, values: Values, _modelled: Parameters) -> Iterator[str]:
    doubt = gain_doubt(site, values["gain"])
    if doubt is not None:
        yield doubt


def gain_doubt(site: str, gain: float) -> str | None:
    """Give a sentence on a gain that a wrong sign or unit rather than a sensitivity has.

    Examples
    --------
    >>> gain_doubt("tip", 1.3)
    >>> print(gain_doubt("tip", -1.004))
    A gain of -1 at tip is a reversed sign: check which way its channel counts.
    >>> print(gain_doubt("tip", -0.102))
    A gain of -0.102 at tip is the factor between g and m/s^2: check the unit of its channel.
    >>> print(gain_doubt("motor", 7.1e-4))
    A gain of 0.00071 at motor is rather that of a wrong unit: check the unit of its channel.
    """
    if gain == 0.0:
        return None
    if near(-gain, 1.0, 1.0 + EXACTLY):
        return f"A gain of -1 at {site} is a reversed sign: check which way its channel counts."
    for factor, words in CONVERSIONS:
        if near(abs(gain), factor, 1.0 + EXACTLY):
            return f"A gain of {gain:.3g} at {site} is the factor {words}: check the unit of its channel."
    if not is_apart(abs(gain)):
        return None
    return f"A gain of {short(gain)} at {site} is rather that of a wrong unit: check the unit of its channel."


GAIN_ERROR = EffectKind(
    name="gain_error",
    said="a gain error",
    family="sensor",
    meaning="sensitivity that differs from the calibration, sign included",
    sites=("input", "output"),
    parameters=Parameters(
        (Parameter(name="gain", value=1.1, unit="1", low=-1.5, high=1.5, minimum=-1e6, maximum=1e6),)
    ),
    neutral={"gain": 1.0},
    linear=True,
    clues=Clues(trials=_trials, exact=True, doubts=_doubts),
    variants=(Variant(name="factor", attach=attach, formula="y_recorded = gain y, or u_acts = gain u"),),
)

"""Effects and causes in the words of people."""

from collections.abc import Mapping

from chladni.gap.records.diagnosis import PARAMETER, Cause, FittedNumber
from chladni.gap.records.robot import site_words
from chladni.models.effects.catalogue import CATALOGUE, spoken_effect
from chladni.signals.engineering import engineering

# A sigma so many times the value tells nothing of it. What can't be negative is fitted by its logarithm: a sigma of
# its own size is a factor of e. What has a sign may well be known to be near zero, beside other numbers of its law.
WIDE_POSITIVE, WIDE_SIGNED = 1.0, 100.0
NOT_DETERMINED = "not determined"


def effect_name(effect: str) -> str:
    """Give an effect's word as one says it; a wrong value is one, too.

    Examples
    --------
    >>> effect_name("coulomb_friction"), effect_name("parameter")
    ('Coulomb friction', 'a wrong value')
    """
    return "a wrong value" if effect == PARAMETER else spoken_effect(effect)


def effect_heading(effect: str) -> str:
    """Give an effect's word for a table: without an article.

    Examples
    --------
    >>> effect_heading("extra_mode"), effect_heading("parameter")
    ('extra mode', 'wrong value')
    """
    return effect_name(effect).removeprefix("a ").removeprefix("an ")


def effect_at(effect: str, site: str) -> str:
    """Say an effect with its site.

    Examples
    --------
    >>> effect_at("delay", "hammer"), effect_at("base_vibration", "ground"), effect_at("parameter", "elbow.damping")
    ('a delay at hammer', 'base vibration of the ground', 'a wrong value of elbow.damping')
    """
    joined = "of the" if site == "ground" else "of" if effect == PARAMETER else "at"
    return f"{effect_name(effect)} {joined} {site_words(site)}"


def cause_phrase(cause: Cause) -> str:
    """Say a cause with its size and site, such as ``Coulomb friction of 8.10 ± 0.20 N at elbow``."""
    said = effect_at(cause.effect, cause.site)
    telling = _telling(cause)
    if not telling:
        return said
    if len(telling) == 1:
        (number,) = telling.values()
        # A bare number says nothing without its name: "a gain error of 0.92" could be a loss of 8 or of 92 %.
        if number.unit != "1":
            head = effect_name(cause.effect)
            size = printed_number(cause, *telling) if is_determined(cause, *telling) else "undetermined size"
            return f"{head} of {size}{said.removeprefix(head)}"
    numbers = ", ".join(f"{name.replace('_', ' ')} {printed_number(cause, name)}" for name in telling)
    return f"{said} ({numbers})"


def cause_law(cause: Cause) -> str:
    """Give the law of a cause in one line, with its variant's name; the effect's meaning where there's no law."""
    kind = CATALOGUE.get(cause.effect)
    # Of effects that aren't ours the record isn't here; their word must do.
    if kind is None:
        return ""
    heard = f", heard from {cause.source}" if cause.source else ""
    return f"{kind.meaning}{heard}: {kind.variant(cause.variant).formula}{_variant(cause)}"


def cause_heading(cause: Cause) -> str:
    """Give a cause's word for a table, with the form of its law where there are several."""
    return f"{effect_heading(cause.effect)}{_variant(cause)}"


def _variant(cause: Cause) -> str:
    kind = CATALOGUE.get(cause.effect)
    if kind is None or cause.variant is None or len(kind.variants) < 2:
        return ""
    return f" ({cause.variant.replace('_', ' ')})"


def _telling(cause: Cause) -> Mapping[str, FittedNumber]:
    """Parameters that make the effect's size: those that must be given; all, of effects that aren't ours."""
    if cause.effect == PARAMETER:
        return {}
    kind = CATALOGUE.get(cause.effect)
    # What may be left out (an asymmetry, the width over which a sign is made smooth) isn't its size.
    needed = cause.parameters if kind is None else kind.required
    return {name: cause.parameters[name] for name in needed if name in cause.parameters}


def is_determined(cause: Cause, name: str) -> bool:
    """Whether the log tells a parameter of a cause; what was held is what it is."""
    number, kind = cause.parameters[name], CATALOGUE.get(cause.effect)
    if number.std is None:
        return True
    # Effects of somebody's own aren't in the catalogue: their signs aren't known.
    known = kind.parameters_of(cause.variant).get(name) if kind is not None else None
    positive = known is not None and known.minimum >= 0
    return number.std <= (WIDE_POSITIVE if positive else WIDE_SIGNED) * abs(number.value)


def printed_number(cause: Cause, name: str) -> str:
    """Print a parameter of a cause with one sigma, or that it isn't determined."""
    number = cause.parameters[name]
    # Such as a constant force that only accelerometers saw: its value would be read, its sigma not.
    return engineering(number.value, number.std, number.unit) if is_determined(cause, name) else NOT_DETERMINED

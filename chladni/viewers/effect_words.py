"""Effects and causes in the words of people."""

from collections.abc import Mapping

from chladni.gap.records.diagnosis import Cause, FittedNumber
from chladni.models.effects.catalogue import CATALOGUE
from chladni.viewers.engineering import engineering

PARAMETER = "parameter"

# With an article where the field uses one.
_SPOKEN: Mapping[str, str] = {
    "coulomb_friction": "Coulomb friction",
    "stribeck_friction": "Stribeck friction",
    "quadratic_damping": "quadratic damping",
    "hardening_stiffness": "hardening stiffness",
    "softening_stiffness": "softening stiffness",
    "backlash": "backlash",
    "one_sided_stop": "a one-sided stop",
    "hysteresis": "hysteresis",
    "extra_mode": "an extra mode",
    "added_mass": "added mass",
    "varying_stiffness": "varying stiffness",
    "delay": "a delay",
    "lag": "a lag",
    "saturation": "saturation",
    "dead_zone": "a dead zone",
    "rate_limit": "a rate limit",
    "ripple": "ripple",
    "gain_error": "a gain error",
    "cross_axis": "cross-axis sensitivity",
    "mounting_resonance": "a mounting resonance",
    "ac_coupling": "AC coupling",
    "time_offset": "a time offset",
    "clipping": "clipping",
    "quantization": "quantization",
    "base_vibration": "base vibration",
    "tonal_disturbance": "a tonal disturbance",
    PARAMETER: "a wrong value",
}


def effect_name(effect: str) -> str:
    """Give an effect's word as one says it; words of somebody's own effects lose their underscores.

    Examples
    --------
    >>> effect_name("coulomb_friction"), effect_name("extra_mode"), effect_name("magnetic_brake")
    ('Coulomb friction', 'an extra mode', 'magnetic brake')
    """
    return _SPOKEN.get(effect, effect.replace("_", " "))


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
    return f"{effect_name(effect)} {joined} {site}"


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
            return f"{head} of {_printed(number)}{said.removeprefix(head)}"
    numbers = ", ".join(f"{name.replace('_', ' ')} {_printed(number)}" for name, number in telling.items())
    return f"{said} ({numbers})"


def cause_law(cause: Cause) -> str:
    """Give the law of a cause in one line, with its variant's name; the effect's meaning where there's no law."""
    kind = CATALOGUE.get(cause.effect)
    # Of effects that aren't ours the record isn't here; their word must do.
    if kind is None:
        return ""
    form = kind.variant(cause.variant)
    heard = f", heard from {cause.source}" if cause.source else ""
    named = f" ({form.name})" if len(kind.variants) > 1 else ""
    return f"{kind.meaning}{heard}: {form.formula}{named}"


def _telling(cause: Cause) -> Mapping[str, FittedNumber]:
    """Parameters that make the effect's size: those that must be given; all, of effects that aren't ours."""
    if cause.effect == PARAMETER:
        return {}
    kind = CATALOGUE.get(cause.effect)
    # What may be left out (an asymmetry, the width over which a sign is made smooth) isn't its size.
    needed = cause.parameters if kind is None else kind.required
    return {name: cause.parameters[name] for name in needed if name in cause.parameters}


def _printed(number: FittedNumber) -> str:
    return engineering(number.value, number.std, number.unit)

"""``NAME=VALUE`` and ``EFFECT@SITE:NAME=VALUE`` as people write them on a command line."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from chladni.signals.errors import SetupError

if TYPE_CHECKING:
    from chladni.models.core.model import Effect, Model


def with_settings(model: "Model", settings: Sequence[str]) -> "Model":
    """Give the model with ``NAME=VALUE`` applied; a value may carry a unit: ``elbow.stiffness=0.6 kN/mm``.

    Raises
    ------
    SetupError
        When a text is no such pair, or its unit isn't the parameter's.
    ModelError
        When the model has no such parameter, or the value is impossible.
    """
    values: dict[str, float] = {}
    for text in settings:
        name, value = _pair(text, "--set")
        if name in values:
            raise SetupError(f"--set {name} is given twice")
        values[name] = _number(value, model.parameters.require(name).unit, f"--set {text}")
    return model.with_values(values) if values else model


def effect_of(text: str) -> "Effect":
    """Read an effect such as ``coulomb_friction@elbow:force=8.1,offset=0.2``.

    ``variant=WORD`` chooses a variant of the law, ``from=OUTPUT`` names the source of cross-axis sensitivity.

    Raises
    ------
    SetupError
        When the text isn't of that form.
    ModelError
        When the effect or a parameter is unknown or impossible.
    """
    from chladni.models.effects.attached_effect import attached

    head, _, tail = text.partition(":")
    effect, at, site = head.partition("@")
    if not (effect and at and site):
        raise SetupError(f"--effect {text!r} is not of the form EFFECT@SITE:NAME=VALUE,NAME=VALUE")
    words: dict[str, str] = {}
    values: dict[str, float] = {}
    for part in filter(None, tail.split(",")):
        name, value = _pair(part, "--effect")
        if name in ("variant", "from"):
            words[name] = value
        else:
            values[name] = _number(value, None, f"--effect {text}")
    return attached(effect, site, values, variant=words.get("variant"), source=words.get("from"))


def _pair(text: str, flag: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name.strip() and equals and value.strip()):
        raise SetupError(f"{flag} {text!r} is not of the form NAME=VALUE")
    return name.strip(), value.strip()


def _number(text: str, unit: str | None, where: str) -> float:
    """Read a plain number as SI; one with a unit is converted, and the unit must be the expected one."""
    from chladni.signals.units import parse_quantity

    try:
        return float(text)
    except ValueError:
        value, found = parse_quantity(text)
    if unit is not None and found != unit:
        raise SetupError(f"{where}: {text!r} is in {found}, the parameter in {unit}")
    return value

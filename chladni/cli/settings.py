"""``NAME=VALUE`` and ``EFFECT@SITE:NAME=VALUE`` as people write them on a command line."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from chladni.signals.errors import SetupError
from chladni.signals.text_reading import real_number

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


def named_numbers(texts: Sequence[str], flag: str, units: Mapping[str, str]) -> dict[str, float]:
    """Read ``NAME=VALUE`` of a flag that may be repeated; a value may carry a unit, and comes in SI.

    Raises
    ------
    SetupError
        When a text is no such pair, a name is given twice, or a unit isn't that of the name.
    """
    values: dict[str, float] = {}
    for text in texts:
        name, value = _pair(text, flag)
        if name in values:
            raise SetupError(f"{flag} {name} is given twice")
        values[name] = _number(value, units.get(name), f"{flag} {text}")
    return values


def effect_of(text: str, model: "Model") -> "Effect":
    """Read an effect such as ``coulomb_friction@elbow:force=8.1,offset=0.2``, meant for a site of `model`.

    ``variant=WORD`` chooses a variant of the law, ``from=OUTPUT`` names the source of cross-axis sensitivity. Units
    are those of the site: the force of friction is in N m at a joint that rotates.

    Raises
    ------
    SetupError
        When the text isn't of that form, a number is given twice or its unit isn't the parameter's.
    ModelError
        When the effect or a parameter is unknown or impossible.
    """
    from chladni.models.effects.attached_effect import attached

    head, _, tail = text.partition(":")
    effect, at, site = head.partition("@")
    if not (effect and at and site):
        raise SetupError(f"--effect {text!r} is not of the form EFFECT@SITE:NAME=VALUE,NAME=VALUE")
    given: dict[str, str] = {}
    for part in filter(None, tail.split(",")):
        name, value = _pair(part, "--effect")
        if name in given:
            raise SetupError(f"--effect {text}: {name} is given twice")
        given[name] = value
    variant, source = given.pop("variant", None), given.pop("from", None)
    units = _units(effect, site, variant, model)
    values = {name: _number(value, units.get(name), f"--effect {text}") for name, value in given.items()}
    return attached(effect, site, values, variant=variant, source=source)


def _units(effect: str, site: str, variant: str | None, model: "Model") -> dict[str, str]:
    """Units of an effect's parameters at a site; none for words and sites that will be refused anyway."""
    from chladni.models.effects.catalogue import CATALOGUE
    from chladni.models.files.site_units import compiled_site_units, known_site, units_at

    kind = CATALOGUE.get(effect)
    if kind is None:
        return {}
    compiled = model.compile()
    units = dict(compiled_site_units(compiled))
    if model.kind == "scheme":
        # At a block an effect may sit before it or behind it, with another unit each.
        units = {terminal.name: units[terminal.name] for terminal in compiled.inputs}
    there = units_at(site, units) if known_site(site, units) else None
    if there is None:
        return {}
    return {one.name: there.of(one.unit) for one in kind.parameters_of(kind.variant(variant).name).values()}


def _pair(text: str, flag: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name.strip() and equals and value.strip()):
        raise SetupError(f"{flag} {text!r} is not of the form NAME=VALUE")
    return name.strip(), value.strip()


def _number(text: str, unit: str | None, where: str) -> float:
    """Read a plain number as SI; one with a unit is converted, and the unit must be the expected one."""
    from chladni.signals.units import parse_quantity

    try:
        return real_number(text)
    except ValueError:
        try:
            value, found = parse_quantity(text)
        except SetupError as error:
            raise SetupError(f"{where}: {error}") from error
    if unit is not None and found != unit:
        raise SetupError(f"{where}: {text!r} is in {found}, the parameter in {unit}")
    return value

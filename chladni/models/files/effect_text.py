"""Writing what models of all kinds have in a file: known effects, and tolerances."""

from collections.abc import Sequence

from chladni.models.core.model import Effect
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.files.file_reading import SOURCE
from chladni.models.files.toml_text import Entry
from chladni.signals.errors import ModelError


def effect_tables(effects: Sequence[Effect]) -> list[dict[str, Entry]]:
    """Tables ``[[effect]]``.

    Raises
    ------
    ModelError
        When an effect isn't one of the vocabulary: a file couldn't say what it does.
    """
    return [_effect_table(effect) for effect in effects]


def _effect_table(effect: Effect) -> dict[str, Entry]:
    if not isinstance(effect, AttachedEffect) or CATALOGUE.get(effect.effect) is not effect.kind:
        raise ModelError(f"effect {effect.effect!r} at {effect.site!r} is none of the catalogue: no file can hold it")
    parameters: dict[str, Entry] = dict(effect.values)
    if effect.source is not None:
        parameters[SOURCE] = effect.source
    return {"effect": effect.effect, "site": effect.site, "variant": effect.variant, "parameters": parameters}

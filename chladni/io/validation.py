"""Content of files against a pydantic model: every mistake with its place, what was found, what would be right."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from chladni.signals.wording import MOST_SHOWN, near_words, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from pydantic import BaseModel

    Loc = tuple[str | int, ...]

ModelT = TypeVar("ModelT", bound="BaseModel")

_RULES: Final = {
    "string_type": "must be text in quotes",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "bool_type": "must be true or false",
    "list_type": "must be a list in brackets",
    "tuple_type": "must be a list in brackets",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "finite_number": "must be finite, not inf or nan",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Mistake:
    """One mistake.

    Attributes
    ----------
    loc
        Where, such as ``("channel", 2, "unit")``.
    text
        Makes what is told: of very many, most never are.
    too_long
        Whether a list has more entries than are read.
    """

    loc: Loc
    text: Callable[[], str]
    too_long: bool


def validated(
    content: object, model: type[ModelT], *, context: object = None
) -> tuple[ModelT | None, tuple[Mistake, ...]]:
    """Validate content against a model: what was read, None when there are mistakes.

    Parameters
    ----------
    context
        Handed to the model's validators.
    """
    # Pydantic takes a quarter of a second, and most commands read no such file.
    from pydantic import ValidationError

    try:
        return model.model_validate(content, context=context), ()
    except ValidationError as error:
        found = []
        for one in error.errors(include_url=False):
            loc = tuple(part for part in one["loc"] if isinstance(part, int) or not part.startswith("function-"))
            text = partial(_mistake, one["type"], one["msg"], one["input"], loc, model)
            found.append(Mistake(loc=loc, text=text, too_long=one["type"] == "too_long"))
        return None, tuple(found)


def place_words(loc: Loc) -> str:
    """``("channel", 2, "unit")`` as people count: ``[[channel]] 3 unit: ``."""
    if not loc:
        return ""
    parts = []
    for part, following in zip(loc, (*loc[1:], None), strict=True):
        if isinstance(part, int):
            parts.append(str(part + 1))
        else:
            short = part if len(part) <= MOST_SHOWN else f"{part[:MOST_SHOWN]}..."
            parts.append(f"[[{short}]]" if isinstance(following, int) and len(parts) == 0 else short)
    return f"{' '.join(parts)}: "


def _mistake(kind: str, message: str, found: object, loc: Loc, model: type[BaseModel]) -> str:
    if kind == "missing":
        return "is missing, and is needed"
    if kind == "extra_forbidden":
        known = _known_keys(model, loc[:-1])
        near = near_words(str(loc[-1]), known)
        advice = f"did you mean {near[0]}?" if near else f"known keys: {', '.join(known)}"
        return f"unknown key; {advice}"
    if kind == "too_long":
        return message.replace("List should have", "must have").replace(" after validation", "")
    if kind == "value_error" and isinstance(found, dict):
        return message.removeprefix("Value error, ")
    rule = _RULES.get(kind, message.removeprefix("Value error, ").replace("Input should", "must", 1))
    return f"found {shown(found)}; {rule}"


def _known_keys(model: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """Keys that the table at `loc` may have."""
    current: Any = model
    for part in loc:
        if isinstance(part, str):
            field = current.model_fields.get(part)
            current = None if field is None else _model_in(field.annotation)
        if current is None:
            return []
    return [field.alias or name for name, field in current.model_fields.items()]


def _model_in(annotation: Any) -> Any:
    """Model inside an annotation such as ``list[Point]``, or None."""
    if hasattr(annotation, "model_fields"):
        return annotation
    inner: Iterable[Any] = getattr(annotation, "__args__", ())
    return next((model for model in map(_model_in, inner) if model is not None), None)

"""The documents of a campaign as they are read back: truths, results and cases, with all that a score goes by.

What else stands in them is passed over: a result may be that of another program.
"""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, model_validator

from chladni.gap.blind.case_draw import Kind
from chladni.gap.blind.vocabulary import WORDS
from chladni.io.validation import ModelT, validated
from chladni.signals.errors import SetupError
from chladni.signals.wording import MOST_SHOWN, counted

RESULT_FORMAT = "chladni.gap/1"
_MOST_TOLD = 3

Text = Annotated[str, Field(min_length=1, max_length=1000)]
Number = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _word(text: str) -> str:
    if text not in WORDS:
        raise ValueError("must be an effect of the vocabulary")
    return text


def _seal(found: object) -> str:
    if not isinstance(found, str) or re.fullmatch("[0-9a-f]{64}", found) is None:
        raise ValueError("must be 64 hexadecimal digits")
    return found


def read_as(document: type[ModelT], content: Mapping[str, Any], where: str, remedy: str) -> ModelT:
    """Give content as a document of its kind.

    Raises
    ------
    SetupError
        With the first mistakes, each with its key, what was found and what would be right; and the remedy.
    """
    read, mistakes = validated(content, document)
    if read is not None:
        return read
    told = [f"{_key(one.loc)}{one.text()}" for one in mistakes[:_MOST_TOLD]]
    more = len(mistakes) - len(told)
    told += [f"and {counted(more, 'more mistake')}"] if more else []
    raise SetupError(f"{where}: {'; '.join(told)}; {remedy}")


def _key(loc: tuple[str | int, ...]) -> str:
    """``("causes", 0, "effect")`` as programs write it: ``causes[0].effect: ``."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part[:MOST_SHOWN]}" for part in loc)
    return f"{path.removeprefix('.')}: " if loc else ""


class _Document(BaseModel):
    # Strict: "0.5" is no number, and 1 no truth value.
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True, strict=True)


class Named(_Document):
    """An effect and its site."""

    effect: Text
    site: Text


class SealedCase(_Document):
    """``chladni.blind-case/1``."""

    seal: Annotated[str, PlainValidator(_seal)]
    leave_out: list[Annotated[str, AfterValidator(_word)]] = []


class Truth(_Document):
    """``chladni.blind-truth/1``: what was hidden, how far it is off the noise, and what was sealed with it."""

    kind: Kind
    effects: list[Named]
    coloured: bool = False
    off: dict[str, Any] | None = None
    ratio: Number | None = None
    ratio_tuned: Number | None = None
    ideal: Annotated[float, Field(gt=0.0)] | None = None
    files: dict[str, str] | None = None

    @model_validator(mode="after")
    def _hides_something(self) -> Self:
        if not self.effects and self.kind not in ("none", "parameters"):
            raise ValueError(f"kind is {self.kind}, and effects holds none")
        return self


class OtherEffect(_Document):
    """An effect that can't be told from the one that is named."""

    effect: Text


class Cause(Named):
    """A cause that was named."""

    group: list[Text] | None = None
    probability: Share | None = None
    alternatives: list[OtherEffect] | None = None


class Ranked(Named):
    """A candidate and the gap that it leaves."""

    gap: Number | None = None


class Gap(_Document):
    """How much of the gap was closed."""

    closed: Share | None = None


class Result(_Document):
    """``chladni.gap/1``, an answer."""

    verdict: Literal["none", "parameters", "effect", "unknown"]
    causes: list[Cause] | None = None
    ranking: list[Ranked] | None = None
    naive: Named | None = None
    gap: Gap | None = None

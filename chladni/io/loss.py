"""What isn't in what was read of a log: lost in the container or in its messages, or left out as a whole."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from chladni.io.gathering import LostMessages
from chladni.io.mcap.damage import Damage


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """One thing that is not in what was read.

    Attributes
    ----------
    what
        What was found, and what became of it.
    offset
        First byte of the damaged place in the file; None for messages that are whole but can't be used.
    record
        Kind of the damaged record or stretch.
    lost_messages
        How many messages are missing because of it; None when that can't be known.
    """

    what: str
    offset: int | None
    record: str
    lost_messages: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Unread:
    """A topic, or a field of one, that no channel of the log was made of.

    Attributes
    ----------
    topic, field
        What it is; the field is empty where all of the topic is meant.
    reason
        Why, as what follows the name in a sentence.
    messages
        How many the topic has; None for a field, or where the log doesn't tell.
    complete
        Whether nothing is missing: it holds no signal, or can be read by name.
    """

    topic: str
    field: str = ""
    reason: str
    messages: int | None = None
    complete: bool = False

    @property
    def name(self) -> str:
        """Path of the topic or of the field."""
        return f"{self.topic}.{self.field}" if self.field else self.topic

    def to_json(self) -> dict[str, Any]:
        """Give it as ``chladni info --json`` does."""
        return {"name": self.name, "reason": self.reason, "messages": self.messages}


def losses(damage: Iterable[Damage], lost: LostMessages) -> tuple[Loss, ...]:
    """Give damage of the file in its order, then messages that could not be used."""
    in_file = [
        Loss(what=one.what, offset=one.offset, record=one.record, lost_messages=one.lost_messages) for one in damage
    ]
    in_messages = [
        Loss(what=f"{topic}: {reason}", offset=None, record="Message", lost_messages=messages)
        for (topic, reason), messages in lost.counts.items()
    ]
    return (*in_file, *in_messages)

"""What was lost of a log, wherever it was lost: in the container or in its messages."""

from collections.abc import Iterable
from dataclasses import dataclass

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

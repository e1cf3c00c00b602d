"""What is wrong with a log, where, and how much of it was lost."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Damage:
    """One damaged place of a log.

    Parameters
    ----------
    what
        What was found, and what became of the messages there.
    offset
        First byte of the damaged record or stretch in the file.
    record
        The kind of record (``"Chunk"``, ``"Message"``, ...) or stretch (``"summary"``).
    lost_messages
        How many messages are not given out because of it; None when that can't be known.
    """

    what: str
    offset: int
    record: str
    lost_messages: int | None


class DamageList:
    """Damage found so far, each place once however often the log is read."""

    def __init__(self) -> None:
        self._found: dict[tuple[int, str, str], Damage] = {}

    def add(self, what: str, *, offset: int, record: str, lost_messages: int | None) -> None:
        """Note one damaged place."""
        self.extend([Damage(what=what, offset=offset, record=record, lost_messages=lost_messages)])

    def extend(self, found: Iterable[Damage]) -> None:
        """Note several damaged places."""
        for damage in found:
            self._found.setdefault((damage.offset, damage.record, damage.what), damage)

    def in_file_order(self) -> tuple[Damage, ...]:
        """Return all damage, from the start of the file to its end."""
        return tuple(self._found[key] for key in sorted(self._found))

"""How much memory the content of a data file may take, told before it is taken.

A few bytes of a packed file can announce gigabytes of zeros, and a damaged length any number. What was measured
isn't like that: its last bits are noise, so that a number of 64 bits carries at least one that can't be packed
(Shannon, A Mathematical Theory of Communication, 1948). Files are read whose content is up to 64 times as large as
they are, whatever packs them; and any that is small beside what every machine has.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chladni.signals.errors import LogError, SetupError

SMALL_BYTES: Final = 128 * 2**20
"""Content that is read however well it is packed."""

_PACKING: Final = 64
_USUAL_MEMORY: Final = 16 * 2**30


def memory_bytes() -> int:
    """Half of the machine's memory: for a moment samples are held twice, as the file has them and as a series."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        # Other systems don't tell.
        return _USUAL_MEMORY // 2


@dataclass(slots=True, kw_only=True)
class Budget:
    """Memory that the content of one file may take.

    Attributes
    ----------
    path
        The file, which the refusal names.
    most
        Bytes that are allowed together.
    taken
        Bytes that were announced so far.
    """

    path: Path
    most: int
    taken: int = 0

    @classmethod
    def of_file(cls, path: Path, max_bytes: object = None) -> "Budget":
        """Give the budget of a file: what the caller allows, else what it can hold that was measured.

        Raises
        ------
        SetupError
            When what the caller allows is no number of bytes.
        LogError
            When the file can't be read.
        """
        if max_bytes is not None:
            if isinstance(max_bytes, bool) or not isinstance(max_bytes, int | float) or not 0 < max_bytes < 2**63:
                raise SetupError(f"{path}: max_bytes {max_bytes!r:.40} must be a number of bytes above zero")
            return cls(path=path, most=int(max_bytes))
        try:
            size = path.stat().st_size
        except OSError as error:
            raise LogError(f"{path}: can't be read: {error.strerror or error}") from error
        return cls(path=path, most=min(max(SMALL_BYTES, _PACKING * size), memory_bytes()))

    def take(self, size: int) -> None:
        """Count bytes that are about to be taken.

        Raises
        ------
        TooLargeError
            When it's more than is left.
        """
        self.taken += size
        if self.taken <= self.most:
            return
        remedy = f"if it's sound, raise max_bytes to read it (--read max_bytes={memory_bytes()})"
        if self.taken > memory_bytes():
            remedy = "it's more than half of this machine's memory; read it on a larger one, or save it in parts"
        raise TooLargeError(
            f"{self.path}: its content takes {self.taken} bytes in memory or more, {self.most} are allowed; {remedy}"
        )


class TooLargeError(LogError):
    """The content of a file takes more memory than is allowed."""


def read_whole(path: Path) -> bytes:
    """Read all bytes of a file.

    Raises
    ------
    LogError
        When it can't be read, or is larger than this machine can hold.
    """
    budget = Budget(path=path, most=memory_bytes())
    try:
        budget.take(path.stat().st_size)
        return path.read_bytes()
    except OSError as error:
        raise LogError(f"{path}: can't be read: {error.strerror or error}") from error

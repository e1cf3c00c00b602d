"""The last few things that were made, for threads that ask for them at once."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

MadeT = TypeVar("MadeT")


class Kept(Generic[MadeT]):
    """Keeps what was asked for last: at most so many things, the one that nobody asked for longest goes first."""

    def __init__(self, most: int) -> None:
        self._most, self._made, self._lock = most, OrderedDict[Hashable, MadeT](), Lock()

    def get(self, key: Hashable, make: Callable[[], MadeT]) -> MadeT:
        """Give what is kept under a key, made when there's nothing: for things that don't change.

        Threads that ask for the same at once may each make their own, and go on while others make something else.
        """
        with self._lock:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        made = make()
        self.put(key, made)
        return made

    def take(self, key: Hashable, make: Callable[[], MadeT]) -> MadeT:
        """Give it for oneself, until it's `put` back: for things that change when they are used."""
        with self._lock:
            if key in self._made:
                return self._made.pop(key)
        return make()

    def put(self, key: Hashable, made: MadeT) -> None:
        """Keep it as the last that was asked for."""
        with self._lock:
            self._made[key] = made
            self._made.move_to_end(key)
            if len(self._made) > self._most:
                self._made.popitem(last=False)

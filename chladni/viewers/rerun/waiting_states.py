"""States of a live source that wait to be drawn: bounded in number and in memory."""

import threading
from dataclasses import replace
from typing import Final

from chladni.signals.live_state import LiveState

#: States that wait, and the memory of their samples; beyond, there is no room for another.
MOST_STATES: Final = 64
MOST_BYTES: Final = 1 << 23


class WaitingStates:
    """A queue from the thread of the averages to that of the pictures."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._states: list[LiveState] = []
        self._bytes = 0
        self._ended = False

    def put(self, state: LiveState, *, patience_s: float) -> bool:
        """Add a state, if there is room within `patience_s`; whether there was."""
        size = sum(one.values.nbytes + (0 if one.valid is None else one.valid.nbytes) for one in state.series)
        with self._changed:
            if not self._changed.wait_for(lambda: self._has_room(size), timeout=patience_s):
                return False
            if self._states:
                # Only those of the last state are drawn, and they are larger than everything else.
                self._states[-1] = replace(self._states[-1], waterfalls=())
            self._states.append(state)
            self._bytes += size
            self._changed.notify_all()
            return True

    def _has_room(self, size: int) -> bool:
        # A state that is larger than all that may wait has room when it's alone.
        return not self._states or (len(self._states) < MOST_STATES and self._bytes + size <= MOST_BYTES)

    def take(self) -> list[LiveState]:
        """Wait for states and give them all; none when there are no more to come."""
        with self._changed:
            self._changed.wait_for(lambda: self._states or self._ended)
            taken, self._states, self._bytes = self._states, [], 0
            self._changed.notify_all()
            return taken

    def end(self) -> None:
        """Say that no more states come."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

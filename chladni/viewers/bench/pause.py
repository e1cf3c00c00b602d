"""Wait until the user rests."""

from collections.abc import Callable

from bokeh.document import Document


class Pause:
    """Calls `action` once nothing has happened for a while; at once where no server keeps time (a notebook)."""

    def __init__(self, document: Document | None, *, seconds: float, action: Callable[[], None]) -> None:
        served = document is not None and document.session_context is not None
        self._document = document if served else None
        self._milliseconds = round(1000 * seconds)
        self._action = action
        self._touches = 0

    def touch(self) -> None:
        """Begin the wait anew."""
        if self._document is None:
            self._action()
            return
        # Counted instead of taken back: a callback that has left can't be recalled.
        self._touches += 1
        touch = self._touches

        def when_rested() -> None:
            if touch == self._touches:
                self._action()

        self._document.add_timeout_callback(when_rested, self._milliseconds)

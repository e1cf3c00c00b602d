"""Signals that ask a process to end: files stay whole, and nothing is left beside them."""

import os
import signal
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import NoReturn

from chladni.io.atomic import remove_parts

#: ``timeout`` sends its signal twice, service managers two kinds of it: within this time they are one request.
ONE_REQUEST_S = 1.0
#: What is raised in the midst of a library may be swallowed there; nobody waits longer.
PATIENCE_S = 4.0


class Stopped(SystemExit):
    """A signal asked the program to end. The exit code is 128 and its number, as shells have it."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)
        self.number = number
        self.name = signal.Signals(number).name


class Listener:
    """Raises at the first signal, so that whatever is under way cleans up; later ones end the process.

    Attributes
    ----------
    heard
        Number of the first signal; None when there was none.
    """

    def __init__(self) -> None:
        self.heard: int | None = None
        self._since_s = 0.0

    def listen(self) -> None:
        """Let Ctrl-C raise `KeyboardInterrupt`, SIGTERM and SIGHUP raise `Stopped`, in the main thread."""
        on_signals(self, "SIGINT", "SIGTERM", "SIGHUP")

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Take a signal."""
        now_s = time.monotonic()
        if self.heard is None:
            self.heard, self._since_s = number, now_s
            last = threading.Timer(PATIENCE_S, end_at_once, (number,))
            last.daemon = True
            last.start()
            raise KeyboardInterrupt if number == signal.SIGINT else Stopped(number)
        if now_s - self._since_s > ONE_REQUEST_S:
            end_at_once(number)


#: Of this process.
LISTENER = Listener()


def end_at_once(number: int, _frame: FrameType | None = None) -> NoReturn:
    """End this process here and now, as after signal `number`; parts of files are removed."""
    remove_parts()
    os._exit(128 + number)


def on_signals(handler: Callable[[int, FrameType | None], object], *names: str) -> None:
    """Have signals handled, where this system has them."""
    for name in names:
        number = getattr(signal, name, None)
        # What whoever started us ignores stays ignored: nohup, and what a shell runs in the background.
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)

"""Entry point of the installed program; imports nothing that takes time before Ctrl-C is understood."""

import os
import sys
import warnings
from contextlib import suppress

#: What each library of linear algebra takes its number of threads from, when it's loaded.
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def run() -> None:
    """Run ``chladni`` and exit with its code; 130 when interrupted while it still starts."""
    _open_streams()
    _sum_in_one_order()
    doubts = _Doubts()
    if not os.environ.get("CHLADNI_TRACEBACK"):
        warnings.showwarning = doubts.take
    try:
        from chladni.apps.stopping import LISTENER

        LISTENER.listen()
        from chladni.cli.main import main

        code = main()
    except KeyboardInterrupt:
        with suppress(OSError):
            print("chladni: interrupted", file=sys.stderr)  # noqa: T201
        code = 130
    if code == 0:
        doubts.tell()
    sys.exit(_flushed(code))


def _sum_in_one_order() -> None:
    """Let linear algebra work in one thread, here and in processes to come: the last digits depend on their number.

    Also where the environment asks for more: a document is to be the same on every machine.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))


class _Doubts:
    """Warnings of libraries, each told once and in one line, where a command that succeeds has ended.

    What a failure says already says what is wrong.
    """

    def __init__(self) -> None:
        self._told: dict[str, None] = {}

    def take(self, message: Warning | str, *_where: object, **_more: object) -> None:
        self._told[" ".join(str(message).split())] = None

    def tell(self) -> None:
        if self._told:
            said = f"take extreme values with care: {'; '.join(self._told)}; CHLADNI_TRACEBACK=1 shows where"
            with suppress(OSError):
                print(f"chladni: {said}", file=sys.stderr)  # noqa: T201


def _open_streams() -> None:
    """Give each standard stream that was closed (``>&-``) a file, lest a log be opened under its number."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            # The lowest number that is free: this one.
            os.open(os.devnull, os.O_RDWR)
    if sys.stderr is None:
        # To None, Python prints on standard output.
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def _flushed(code: int) -> int:
    """Flush what is left, which Python would do with a traceback of its own."""
    for stream in (sys.stdout, sys.stderr):
        if stream is None:
            continue
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    return code

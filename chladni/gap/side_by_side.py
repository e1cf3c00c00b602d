"""Independent pieces of a diagnosis, worked on by all cores at once."""

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextvars import ContextVar, copy_context
from itertools import count
from threading import Event, Thread
from typing import Generic, TypeVar

from chladni.gap.calibration import THREADS

PieceT = TypeVar("PieceT")
DoneT = TypeVar("DoneT")

_IS_PIECE: ContextVar[bool] = ContextVar("is_piece", default=False)


def threads() -> int:
    """Threads that pieces are shared out over.

    One in a process that another one started, as those of a campaign: its siblings have the other cores.
    """
    if multiprocessing.parent_process() is not None:
        return 1
    return min(os.cpu_count() or 1, THREADS)


def side_by_side(
    work: Callable[[PieceT], DoneT], pieces: Sequence[PieceT], progress: Callable[[float], None] | None = None
) -> list[DoneT]:
    """Give what the work makes of each piece, in their order; they are done in threads, the caller's own among them.

    Threads, since kernels leave the interpreter free: pieces that are mostly machine code take half the time on two
    cores. Pieces of a piece are done one after another.

    Parameters
    ----------
    work
        Must not change what pieces share. Its first error, by the order of the pieces, is raised.
    progress
        Called by the caller's thread, with the share done.

    Examples
    --------
    >>> side_by_side(abs, [-1, 2, -3])
    [1, 2, 3]
    """
    if _IS_PIECE.get() or min(len(pieces), threads()) < 2:
        return _one_by_one(work, pieces, progress)
    shared = _Pieces(work, pieces)
    # Daemons: who interrupts a diagnosis doesn't wait for the fits that others are at.
    helpers = [
        Thread(target=copy_context().run, args=(shared.take_turns,), daemon=True, name=f"chladni-{place}")
        for place in range(min(len(pieces), threads()) - 1)
    ]
    try:
        for one in helpers:
            one.start()
        copy_context().run(shared.take_turns, progress)
        for one in helpers:
            one.join()
    finally:
        shared.stop.set()
    if progress is not None:
        progress(1.0)
    return shared.results()


class _Pieces(Generic[PieceT, DoneT]):
    """Pieces that threads take one after another, and what they made of them."""

    def __init__(self, work: Callable[[PieceT], DoneT], pieces: Sequence[PieceT]) -> None:
        self._work, self._pieces = work, pieces
        self._done: list[Future[DoneT]] = [Future() for _ in pieces]
        # A counter hands each number to one thread only.
        self._turns = count()
        self.stop = Event()

    def take_turns(self, progress: Callable[[float], None] | None = None) -> None:
        """Work on pieces that nobody has taken until there are none, or one has failed."""
        _IS_PIECE.set(True)
        while not self.stop.is_set() and (place := next(self._turns)) < len(self._pieces):
            try:
                self._done[place].set_result(self._work(self._pieces[place]))
            except Exception as error:  # noqa: BLE001  # raised by `results`, in the order of the pieces
                self._done[place].set_exception(error)
                self.stop.set()
            if progress is not None:
                progress(sum(one.done() for one in self._done) / len(self._done))

    def results(self) -> list[DoneT]:
        """Give the results, or raise the first error, when all threads have ended."""
        failed = [one for one in self._done if one.done() and one.exception() is not None]
        return [one.result(timeout=0.0) for one in failed or self._done]


def _one_by_one(
    work: Callable[[PieceT], DoneT], pieces: Sequence[PieceT], progress: Callable[[float], None] | None
) -> list[DoneT]:
    found = []
    for place, piece in enumerate(pieces):
        found.append(work(piece))
        if progress is not None:
            progress((place + 1) / len(pieces))
    return found

"""How many threads the linear algebra behind NumPy and SciPy takes."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import Lock


@contextmanager
def in_one_thread() -> Iterator[None]:
    """Let linear algebra work in one thread meanwhile, whatever the environment says; a decorator, too.

    One thread sums in one order, whatever the machine: the same input gives the same answer to the last bit. What is
    done here are products of small matrices by the thousand: shared out over threads, they take longer to meet than
    to multiply.

    Several threads of the caller's may be inside at once, and calls inside of calls: the first that comes takes the
    threads away, the last that goes gives them back.
    """
    _HELD.take()
    try:
        yield
    finally:
        _HELD.give_back()


class _Hold:
    """The limit that all who are inside share: what the last of them gives back is what the first found."""

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0

    def take(self) -> None:
        # SciPy brings a second library of its own, which can't be limited before it's loaded.
        import_module("scipy.linalg")
        from threadpoolctl import threadpool_limits

        with self._lock:
            if self._inside == 0:
                self._limit = threadpool_limits(limits=1, user_api="blas")
            self._inside += 1

    def give_back(self) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._limit.restore_original_limits()


_HELD = _Hold()

"""How many threads the linear algebra behind NumPy and SciPy takes."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module

from threadpoolctl import ThreadpoolController


@contextmanager
def in_one_thread() -> Iterator[None]:
    """Let linear algebra work in one thread meanwhile, whatever the environment says; a decorator, too.

    One thread sums in one order, whatever the machine: the same input gives the same answer to the last bit. What is
    done here are products of small matrices by the thousand: shared out over threads, they take longer to meet than
    to multiply.
    """
    with _libraries().limit(limits=1):
        yield


@cache
def _libraries() -> ThreadpoolController:
    """Find the libraries once: to look for them among all that is loaded takes longer than many a small problem."""
    # SciPy brings a second library of its own, which can't be limited before it's loaded.
    import_module("scipy.linalg")
    return ThreadpoolController().select(user_api="blas")

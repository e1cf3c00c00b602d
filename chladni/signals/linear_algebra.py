"""How many threads the linear algebra behind NumPy and SciPy takes."""

from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def in_one_thread() -> Iterator[None]:
    """Let linear algebra work in one thread meanwhile, whatever the environment says; a decorator, too.

    A diagnosis is many thousand products of small matrices: shared out over threads, they take longer to meet than to
    multiply. One thread also sums in one order, whatever the machine: the same input gives the same answer.
    """
    with threadpool_limits(limits=1, user_api="blas"):
        yield

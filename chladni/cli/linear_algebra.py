"""How many threads the linear algebra behind NumPy and SciPy takes."""

import os

# OpenBLAS listens to the first of these that is set.
THREADS = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")


def take_one_thread() -> None:
    """Let OpenBLAS work in one thread, unless the environment says how many; before NumPy is imported.

    A diagnosis is many thousand products of small matrices: shared out over threads, they take longer to meet than to
    multiply. Processes that are started from here inherit it.
    """
    if not any(name in os.environ for name in THREADS):
        os.environ[THREADS[0]] = "1"

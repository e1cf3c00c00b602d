"""What glibc does with memory that is free: it holds for the whole process."""

import ctypes
import platform
from collections.abc import Mapping
from typing import Final

#: Options of glibc's mallopt (malloc.h). Of what is spare the second takes an eighth at most.
TRIM_THRESHOLD: Final = -1
MMAP_THRESHOLD: Final = -3
ARENA_MAX: Final = -8
#: Arrays from this size on have pages of their own, which go back with them.
OWN_PAGES_BYTES: Final = 1 << 20


def set_allocator(options: Mapping[int, int]) -> bool:
    """Set options of mallopt; whether it was done: other libraries than glibc are left as they are."""
    if platform.libc_ver()[0] != "glibc":
        return False
    library = ctypes.CDLL(None)
    return all(library.mallopt(option, value) == 1 for option, value in options.items())


def return_memory() -> bool:
    """Let the memory of arrays go back to the system when they are gone, in a process that runs for days.

    By itself glibc raises the size from which arrays have pages of their own, up to 32 MB, and gives each thread an
    arena. Arrays of many sizes that come and go in several threads then leave ever more holes.

    Returns
    -------
    Whether it was done.
    """
    return set_allocator({MMAP_THRESHOLD: OWN_PAGES_BYTES, TRIM_THRESHOLD: 16 * OWN_PAGES_BYTES, ARENA_MAX: 2})


def trim_memory() -> None:
    """Give the system the pages that nothing is in now."""
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)

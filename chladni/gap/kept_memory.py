"""Memory that a process keeps for its next arrays."""

import ctypes
import platform

#: Options of glibc's mallopt (malloc.h), and what they are set to: the largest that it takes, and as much as is spare
#: beside a diagnosis that needs half of it.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
_SPARE, _LARGEST = 256 << 20, 32 << 20


def keep_memory() -> bool:
    """Let new arrays have the memory of those that are gone, instead of giving it back to the system each time.

    A diagnosis makes arrays of megabytes by the ten thousand. By itself glibc asks the system for pages of their own
    for most of them, all of which have to be cleared first: a tenth of the time. It's for a process that does nothing
    else, since it holds for all that the process does.

    Returns
    -------
    Whether it was done; other libraries than glibc are left as they are.
    """
    if platform.libc_ver()[0] != "glibc":
        return False
    library = ctypes.CDLL(None)
    options = ((_MMAP_THRESHOLD, _LARGEST), (_TRIM_THRESHOLD, _SPARE))
    return all(library.mallopt(option, value) == 1 for option, value in options)

"""Memory that a process keeps for its next arrays."""

import ctypes
import platform

from chladni.gap.calibration import SPARE_BYTES

#: Options of glibc's mallopt (malloc.h); the second takes an eighth of what is spare at most.
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3


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
    options = ((_MMAP_THRESHOLD, SPARE_BYTES // 8), (_TRIM_THRESHOLD, SPARE_BYTES))
    return all(library.mallopt(option, value) == 1 for option, value in options)

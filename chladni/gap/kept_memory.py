"""Memory that a process keeps for its next arrays."""

from chladni.gap.calibration import SPARE_BYTES
from chladni.signals.process_memory import MMAP_THRESHOLD, TRIM_THRESHOLD, set_allocator


def keep_memory() -> bool:
    """Let new arrays have the memory of those that are gone, instead of giving it back to the system each time.

    A diagnosis makes arrays of megabytes by the ten thousand. By itself glibc asks the system for pages of their own
    for most of them, all of which have to be cleared first: a tenth of the time. It's for a process that does nothing
    else, since it holds for all that the process does.

    Returns
    -------
    Whether it was done; other libraries than glibc are left as they are.
    """
    return set_allocator({MMAP_THRESHOLD: SPARE_BYTES // 8, TRIM_THRESHOLD: SPARE_BYTES})

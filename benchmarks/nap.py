"""Work that takes no processor: as many workers as one likes on any machine. It imports nothing that takes memory."""

import time


def nap(items: list[float]) -> bytes:
    """Sleep as long as all items say together."""
    time.sleep(sum(items))
    return b"x" * 2000 * len(items)

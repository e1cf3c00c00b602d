"""Messages that were sent or stored twice, told from samples that share the stamp of a coarse clock."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stamp_order import untangle
from chladni.signals.arrays import Whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeats:
    """Messages of a stream with the same stamp.

    Attributes
    ----------
    twin
        ``[message]``, an earlier message with the same stamp and samples, or itself.
    differ
        Whether others have the stamp of an earlier message, but samples of their own.
    """

    twin: Whole
    differ: bool


def repeats_of(stamps_ns: Whole, digests: NDArray[np.uint64]) -> Repeats | None:
    """Tell messages that were sent or stored twice from samples stamped by a coarse clock; None for no such."""
    tangled = untangle(stamps_ns)
    order = np.arange(stamps_ns.size) if tangled.order is None else tangled.order
    same = tangled.steps == 0
    alike = same & (digests[order[:-1]] == digests[order[1:]])
    if not alike.any():
        return None
    first = np.where(np.append(False, alike), 0, np.arange(order.size))
    twin = np.empty_like(order)
    twin[order] = order[np.maximum.accumulate(first)]
    return Repeats(twin=twin, differ=bool(np.any(same & ~alike)))


def digests_of(values: NDArray[np.floating]) -> NDArray[np.uint64]:
    """Give ``[sample]`` numbers that are equal where all channels of ``[channel, sample]`` are."""
    bits = values.view(np.uint32 if values.dtype == np.float32 else np.uint64)
    digests = np.zeros(values.shape[1], np.uint64)
    for row in bits:
        # An odd multiplier loses no bit, and what is added before tells the channels apart (Knuth, TAOCP 3, 6.4).
        digests = (digests ^ row) * np.uint64(0x9E3779B97F4A7C15)
        digests ^= digests >> np.uint64(32)
    return digests

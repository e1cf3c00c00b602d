"""The rate of a clock whose stamps come one by one."""

import tracemalloc

import numpy as np

from chladni.io.arrival import Arrivals
from chladni.io.live.running_rate import RunningRate
from chladni.io.stamps import StampChoice
from chladni.io.stream import Piece, Stream
from chladni.io.topic import Topic


def test_stamps_that_come_one_by_one_take_little_more_memory_than_their_numbers() -> None:
    topic = Topic(name="/a", schema_name="a", encoding="json", metadata={}, decoders={}, schema_text="")
    stream = Stream(topic=topic, choice=StampChoice(kind="log", reason=""), sources=())
    rate = RunningRate(stream, 1e6)
    count = 4096
    tracemalloc.start()
    try:
        for number in range(count):
            stamps_ns = np.array([number * 1_000_000])
            arrivals = Arrivals(log_ns=stamps_ns, sequence=np.zeros(1, np.uint32))
            values = np.zeros((1, 1), np.float32)
            rate.keep(
                Piece(stamps_ns=stamps_ns, counts=None, period_s=0.0, values=values, lost={}, arrivals=arrivals)
            )
        held = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    # Stamp, time of logging, counter: 20 bytes; a piece of its own has several hundred.
    assert held < 40 * count

"""Logs of known samples, and sources that give them bit by bit."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.io.live.live_log import LiveLog
from chladni.io.live.mcap_stream import McapStream
from chladni.io.live.reception import MessageSource, Reception, Told
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.make_logs import IMU, LogMaker, imu

START_NS = 1_700_000_000_000_000_000
IMU_CHANNELS = tuple(f"/imu.linear_acceleration.{axis}" for axis in "xyz")


def write_imus(
    path: Path,
    stamps_ns: Sequence[int] | np.ndarray[Any, Any],
    *,
    topics: Sequence[str] = ("/imu",),
    log_ns: Sequence[int] | np.ndarray[Any, Any] | None = None,
    keep: Callable[[str, int], bool] = lambda _topic, _number: True,
    seed: int = 1,
) -> Path:
    """Write Imu messages on each topic at these stamps, of noise; those that `keep` refuses are lost."""
    noise = np.random.default_rng(seed).standard_normal((len(stamps_ns), len(topics), 3)).astype(np.float64)
    logged = stamps_ns if log_ns is None else log_ns
    with LogMaker(path, chunk_size=1 << 14) as maker:
        ids = [maker.ros2(topic, "sensor_msgs/msg/Imu", IMU) for topic in topics]
        for number, (stamp_ns, log) in enumerate(zip(stamps_ns, logged, strict=True)):
            for place, topic in enumerate(topics):
                if keep(topic, number):
                    maker.write(ids[place], imu(int(stamp_ns), noise[number, place]), int(log))
    return path


class Bits(MessageSource):
    """The bytes of a log, in pieces of these lengths over and over; what is left is its end."""

    def __init__(self, content: bytes, lengths: Sequence[int] = (4096,), *, name: str = "bits") -> None:
        self.name = name
        self._stream = McapStream(name)
        self._parts = self._cut(content, lengths)

    @staticmethod
    def _cut(content: bytes, lengths: Sequence[int]) -> Iterator[bytes]:
        place, number = 0, 0
        while place < len(content):
            length = lengths[number % len(lengths)]
            yield content[place : place + length]
            place, number = place + length, number + 1

    @property
    def channels(self) -> Any:
        return self._stream.channels

    def receive(self, _timeout_s: float) -> Reception:
        part = next(self._parts, None)
        return self._stream.finish() if part is None else self._stream.feed(part)

    def close(self) -> None:
        pass


def read_live(source: MessageSource, **options: Any) -> tuple[list[TimeSeries], list[Told]]:
    """Everything that a live log gives until it ends."""
    live, told = LiveLog(source, **options), list[Told]()
    blocks: list[TimeSeries] = []
    while True:
        got = live.receive(0.0)
        blocks += got.blocks
        told += got.told
        if got.ended:
            return blocks, told


def joined(blocks: Sequence[TimeSeries], channels: Sequence[Channel] | None = None) -> np.ndarray[Any, Any]:
    """Samples of the blocks of one grid, one after another."""
    return np.concatenate([one.values for one in blocks if channels in (None, one.channels)], axis=1)

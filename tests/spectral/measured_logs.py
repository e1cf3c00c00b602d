"""Measured logs, read by the mcap library so that these tests lean on no reader of ours."""

from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries


def aircraft(folder: Path, level: int, topics: tuple[str, ...] = ("/shaker", "/payload_rail")) -> TimeSeries:
    """Force and accelerations of the aircraft; z is the third of the six doubles that end each message."""
    columns: dict[str, list[bytes]] = {topic: [] for topic in topics}
    with (folder / f"f16_level{level}.mcap").open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=list(topics), log_time_order=False):
            columns[channel.topic].append(message.data[-32:-24])
    values = np.array([np.frombuffer(b"".join(column), dtype="<f8") for column in columns.values()])
    channels = tuple(Channel(name=topic, unit="N" if topic == "/shaker" else "m/s^2") for topic in topics)
    return TimeSeries(values=values, sample_rate_hz=400.0, channels=channels)


def hammer(folder: Path) -> TimeSeries:
    """Force and response of five hits; each message ends with 512 samples of one channel, then of the other."""
    with (folder / "hammer.mcap").open("rb") as file:
        blocks = [
            np.frombuffer(message.data[-4096:], dtype="<f4").reshape(2, 512)
            for *_, message in make_reader(file).iter_messages(log_time_order=False)
        ]
    channels = (Channel(name="/daq.hammer", unit="N"), Channel(name="/daq.response", unit="m/s^2"))
    return TimeSeries(values=np.concatenate(blocks, axis=1), sample_rate_hz=51_200.0, channels=channels)
